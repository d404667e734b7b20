//! Checks the hand-written cases on the reference and the literal engine.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_conformance::{NamedEngine, cases, golden, play_on};

#[test]
fn every_case_holds_on_every_engine() {
    let mut wrong = Vec::new();
    let files = golden::files(&cases::folder(), ".yaml").unwrap();
    assert!(!files.is_empty(), "no cases in {}", cases::folder().display());
    for path in files {
        let case = cases::read(&path).unwrap();
        assert!(case.checks_something(), "{} expects nothing", path.display());
        for engine in [NamedEngine::REFERENCE, NamedEngine::LITERAL] {
            if let Some(mismatch) = case.mismatch(&play_on(engine, &case.request().unwrap())) {
                wrong.push(format!("{} on {}: {mismatch}", path.display(), engine.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
