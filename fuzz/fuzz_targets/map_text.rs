//! Map texts: read or refused in one line, never a panic.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Err(error) = pogema_maps::parse_map_text(text) {
        assert_eq!(error.to_string().lines().count(), 1);
    }
});
