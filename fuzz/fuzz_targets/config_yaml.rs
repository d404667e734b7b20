//! Configs: read or refused in one line, and what was read can be made into an instance or is refused.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pogema_maps::{GridConfig, InstanceSource};

fuzz_target!(|text: &str| {
    match GridConfig::from_yaml(text) {
        Err(error) => assert_eq!(error.to_string().lines().count(), 1),
        Ok(config) if config.height * config.width < 10_000 => {
            let _ = InstanceSource::new(config, None).and_then(|mut source| source.generate());
        }
        Ok(_) => {}
    }
});
