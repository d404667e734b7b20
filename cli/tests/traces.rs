//! Tests of `pogema conform --trace`, which checks traces that a port wrote.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::path::Path;
use std::process::{Command, Output};

fn pogema(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pogema")).args(arguments).output().unwrap()
}

fn write_trace(path: &Path) {
    let path = path.to_str().unwrap();
    let arguments =
        ["run", "--map", "four-rooms", "--num-agents", "6", "--seed", "1", "--steps", "20", "--trace", path];
    assert!(pogema(&arguments).status.success());
}

#[test]
fn our_trace_conforms_and_an_altered_one_diverges() {
    let folder = tempfile::tempdir().unwrap();
    let (right, wrong) = (folder.path().join("right.jsonl"), folder.path().join("wrong.jsonl"));
    write_trace(&right);
    let trace = std::fs::read_to_string(&right).unwrap();
    let altered = trace.replacen(r#""rewards":[0.0"#, r#""rewards":[1.0"#, 1);
    assert_ne!(trace, altered);
    std::fs::write(&wrong, altered).unwrap();

    let output = pogema(&["conform", "--trace", right.to_str().unwrap()]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{text}");
    assert!(text.contains("conforms to all it claims: 1 cases, 20 steps"), "{text}");

    let output = pogema(&["conform", "--trace", right.to_str().unwrap(), wrong.to_str().unwrap()]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("FAIL reward/own: reward differs, once") && text.contains("wrong.jsonl"), "{text}");
}

#[test]
fn invalid_traces_are_rejected_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("empty");
    std::fs::write(&path, "").unwrap();
    for arguments in [
        vec!["conform", "--trace", path.to_str().unwrap()],
        vec!["conform", "--trace", "missing"],
        vec!["conform", "--trace", "missing", "--port", "true"],
        vec!["conform", "--trace"],
    ] {
        let output = pogema(&arguments);
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
        assert_eq!(error.lines().count(), 1, "{arguments:?}: {error}");
    }
}
