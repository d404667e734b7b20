//! `pogema conform --trace`: what a port wrote is checked like what it answers.

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
fn a_trace_of_ours_conforms_and_an_altered_one_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let (right, wrong) = (folder.path().join("right.jsonl"), folder.path().join("wrong.jsonl"));
    write_trace(&right);
    let text = std::fs::read_to_string(&right).unwrap();
    let altered = text.replacen(r#""rewards":[0.0"#, r#""rewards":[1.0"#, 1);
    assert_ne!(text, altered);
    std::fs::write(&wrong, altered).unwrap();

    let output = pogema(&["conform", "--trace", right.to_str().unwrap()]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{said}");
    assert!(said.contains("conforms to all it claims: 1 cases, 20 steps"), "{said}");

    let output = pogema(&["conform", "--trace", right.to_str().unwrap(), wrong.to_str().unwrap()]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("FAIL reward/own: reward differs, once") && said.contains("wrong.jsonl"), "{said}");
}

#[test]
fn what_is_no_trace_is_refused_in_one_line() {
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
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {told}");
        assert_eq!(told.lines().count(), 1, "{arguments:?}: {told}");
    }
}
