//! Tests of the commands that read traces: `conform --trace`, `render` and `run --policy file`.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod program;

use std::path::Path;

use program::pogema;

fn write_trace(folder: &Path, name: &str) {
    let arguments =
        ["run", "--map", "four-rooms", "--num-agents", "6", "--seed", "1", "--steps", "20", "--trace", name];
    let (_, error, status) = pogema(folder, &arguments);
    assert_eq!(status, 0, "{error}");
}

#[test]
fn our_trace_conforms_and_an_altered_one_diverges() {
    let folder = tempfile::tempdir().unwrap();
    write_trace(folder.path(), "right.jsonl");
    let trace = std::fs::read_to_string(folder.path().join("right.jsonl")).unwrap();
    // A port may write the older format, which lacks the last line with the hash.
    let older = trace.replacen("pogema-trace/2", "pogema-trace/1", 1);
    let (older, _) = older.trim_end().rsplit_once('\n').unwrap();
    let altered = older.replacen(r#""rewards":[0.0"#, r#""rewards":[1.0"#, 1);
    assert_ne!(older, altered);
    std::fs::write(folder.path().join("wrong.jsonl"), altered).unwrap();

    let (text, _, status) = pogema(folder.path(), &["conform", "--trace", "right.jsonl"]);
    assert_eq!(status, 0, "{text}");
    assert!(text.contains("conforms to all it claims: 1 case, 20 steps"), "{text}");

    let (text, _, status) = pogema(folder.path(), &["conform", "--trace", "right.jsonl", "wrong.jsonl"]);
    assert_eq!(status, 1, "{text}");
    assert!(text.contains("FAIL reward/own: reward differs, once") && text.contains("wrong.jsonl"), "{text}");
}

#[test]
fn a_cut_trace_is_rejected_wherever_a_trace_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.jsonl");
    write_trace(folder.path(), "cut.jsonl");
    let whole = std::fs::read_to_string(&path).unwrap();
    let lines: Vec<&str> = whole.split_inclusive('\n').collect();
    let run = "run --map four-rooms --num-agents 6 --policy file --actions cut.jsonl";
    for kept in [2, 3, lines.len() - 1] {
        std::fs::write(&path, lines[..kept].concat()).unwrap();
        for arguments in ["render cut.jsonl", "conform --trace cut.jsonl", run] {
            let words: Vec<&str> = arguments.split(' ').collect();
            let (text, error, status) = pogema(folder.path(), &words);
            let line = kept + 1;
            let expected = format!("line {line}: the trace ends before its last line");
            assert!(error.contains(&expected), "{arguments}: {error}");
            assert_eq!((status, text.as_str()), (2, ""), "{arguments}");
        }
    }
}

#[test]
fn invalid_traces_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("empty"), "").unwrap();
    for (arguments, expected) in [
        ("conform --trace empty", "the trace ends before the header"),
        ("conform --trace missing", "missing: No such file"),
        ("conform --trace missing --port true", "cannot be used with '--port <COMMAND>'"),
        ("conform --trace", "a value is required for '--trace <FILE>...'"),
    ] {
        let (_, error, status) = pogema(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
        assert_eq!(status, 2, "{arguments}: {error}");
        let is_usage = error.ends_with("For more information, try '--help'.");
        assert!(error.lines().count() == 1 || is_usage, "{arguments}: {error}");
        assert!(error.contains(expected), "{arguments}: {error}");
    }
}
