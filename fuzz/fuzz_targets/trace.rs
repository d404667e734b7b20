//! Fuzzes traces: each is rejected with a one-line error, or survives a round trip.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pogema_core::Trace;

fuzz_target!(|text: &[u8]| {
    match Trace::read(text) {
        Err(error) => assert!(!error.to_string().contains(char::is_control)),
        Ok(trace) => {
            let mut written = Vec::new();
            trace.write(&mut written).expect("writing to memory");
            assert_eq!(Trace::read(written.as_slice()).as_ref(), Ok(&trace));
        }
    }
});
