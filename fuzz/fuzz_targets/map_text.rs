//! Map texts: refused in one line, or read as the map that its rows draw.
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
