//! Fuzzes configs: each is read, or rejected with a one-line error. A config that was read survives a round trip, and
//! becomes an instance or is rejected.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pogema_maps::{GridConfig, InstanceSource};

fuzz_target!(|text: &str| {
    match GridConfig::from_yaml(text) {
        Err(error) => assert!(!error.to_string().contains(char::is_control)),
        Ok(config) => {
            assert_eq!(GridConfig::from_value(&config.to_value()).as_ref(), Ok(&config));
            if config.height * config.width < 10_000 {
                let _ = InstanceSource::new(config, None).and_then(|mut source| source.generate());
            }
        }
    }
});
