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
    // A port may write the older format, which has no last line.
    let older = trace.replacen("pogema-trace/2", "pogema-trace/1", 1);
    let (older, _) = older.trim_end().rsplit_once('\n').unwrap();
    let altered = older.replacen(r#""rewards":[0.0"#, r#""rewards":[1.0"#, 1);
    assert_ne!(older, altered);
    std::fs::write(&wrong, altered).unwrap();

    let output = pogema(&["conform", "--trace", right.to_str().unwrap()]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{text}");
    assert!(text.contains("conforms to all it claims: 1 case, 20 steps"), "{text}");

    let output = pogema(&["conform", "--trace", right.to_str().unwrap(), wrong.to_str().unwrap()]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("FAIL reward/own: reward differs, once") && text.contains("wrong.jsonl"), "{text}");
}

#[test]
fn a_cut_trace_is_rejected_wherever_a_trace_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.jsonl");
    write_trace(&path);
    let whole = std::fs::read_to_string(&path).unwrap();
    let lines: Vec<&str> = whole.split_inclusive('\n').collect();
    for kept in [2, 3, lines.len() - 1] {
        std::fs::write(&path, lines[..kept].concat()).unwrap();
        let path = path.to_str().unwrap();
        let run = ["run", "--map", "four-rooms", "--num-agents", "6", "--policy", "file", "--actions", path];
        for arguments in [&["render", path][..], &["conform", "--trace", path], &run] {
            let output = pogema(arguments);
            let error = String::from_utf8(output.stderr).unwrap();
            let line = kept + 1;
            let expected = format!("line {line}: the trace ends before its last line");
            assert!(error.contains(&expected), "{arguments:?}: {error}");
            assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{arguments:?}");
        }
    }
}

#[test]
fn invalid_traces_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("empty");
    std::fs::write(&path, "").unwrap();
    for (arguments, expected) in [
        (vec!["conform", "--trace", path.to_str().unwrap()], "the trace ends before the header"),
        (vec!["conform", "--trace", "missing"], "missing: No such file"),
        (vec!["conform", "--trace", "missing", "--port", "true"], "cannot be used with '--port <COMMAND>'"),
        (vec!["conform", "--trace"], "a value is required for '--trace <FILE>...'"),
    ] {
        let output = pogema(&arguments);
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
        let is_usage = error.ends_with("For more information, try '--help'.\n");
        assert!(error.lines().count() == 1 || is_usage, "{arguments:?}: {error}");
        assert!(error.contains(expected), "{arguments:?}: {error}");
    }
}
