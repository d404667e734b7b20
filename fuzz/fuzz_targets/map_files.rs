//! Fuzzes map sets, archives, MovingAI maps and scenarios: each is rejected with a one-line error, or survives a round
//! trip; archives are only read. The first byte selects the format.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pogema_core::Error;
use pogema_maps::formats::{
    Scenario, Water, read_archive, read_movingai, read_scen, read_set, write_movingai, write_scen, write_set,
};

fn checked<T>(read: Result<T, Error>) -> Option<T> {
    read.inspect_err(|error| assert!(!error.to_string().contains(char::is_control))).ok()
}

fuzz_target!(|bytes: &[u8]| {
    let Some((&kind, rest)) = bytes.split_first() else { return };
    if kind == b'z' {
        checked(read_archive(std::io::Cursor::new(rest), Water::Free));
        return;
    }
    let Ok(text) = std::str::from_utf8(rest) else { return };
    match kind {
        b's' => {
            let Some(maps) = checked(read_set(text)) else { return };
            // Some maps cannot be written as text, for example a map with two goals on one cell.
            if let Some(written) = checked(write_set(&maps)) {
                assert_eq!(read_set(&written), Ok(maps));
            }
        }
        b'm' => {
            if let Some(map) = checked(read_movingai(text, Water::Obstacle)) {
                assert_eq!(read_movingai(&write_movingai(&map), Water::Obstacle), Ok(map));
            }
        }
        b'c' => {
            let Some(tasks) = checked(read_scen(text)) else { return };
            if let Some(written) = checked(write_scen(&tasks)) {
                assert_eq!(read_scen(&written), Ok(tasks));
            }
        }
        _ => {
            if let Some(scenario) = checked(Scenario::from_yaml(text)) {
                let fields = serde_json::Value::Object(scenario.fields()).to_string();
                assert_eq!(Scenario::from_yaml(&fields), Ok(scenario));
            }
        }
    }
});
