//! Fuzzes map texts: each is rejected with a one-line error, or becomes a map whose rows, parsed again, give the same
//! map.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pogema_maps::parse_map_text;

fuzz_target!(|text: &str| {
    match parse_map_text(text) {
        Err(error) => assert!(!error.to_string().contains(char::is_control)),
        Ok(parsed) => {
            let drawn = parse_map_text(&parsed.map.rows().join("\n")).map(|drawn| drawn.map);
            assert_eq!(drawn, Ok(parsed.map));
        }
    }
});
