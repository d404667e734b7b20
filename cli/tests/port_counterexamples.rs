//! Tests of `pogema conform --port` with ports that crash, hang or refuse: what the report and its replays show.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;
mod program;

use std::path::Path;

use common::{CROWDED, write_wrong_port};

/// Refuses starts on obstacles.
const REFUSING: [&str; 2] = [
    "        # A wall one cell wide",
    "        if any(instance[\"map\"][row][col] == \"#\" for row, col in self.starts):\n            raise ValueError(\"a start is an obstacle\")\n        # A wall one cell wide",
];
/// Ends at the 50th question.
const CRASHING: [&str; 2] = [
    "    for line in sys.stdin:\n",
    "    for number, line in enumerate(sys.stdin):\n        if number == 49:\n            sys.exit(7)\n",
];
/// Ends at a step in which agents 0 and 1 move.
const CRASHING_IF_TWO_MOVE: [&str; 2] = [
    "        moves = [MOVES[action] for action in actions]\n",
    "        moves = [MOVES[action] for action in actions]\n        if all(actions[:2]) and len(actions) > 1:\n            sys.exit(7)\n",
];
/// Never answers.
const MUTE: [&str; 2] = ["    for line in sys.stdin:\n", "    for line in sys.stdin:\n        continue\n"];
/// Observes windows of two bytes.
const SHORT_WINDOWS: [&str; 2] = ["pack(bits) for bits", "pack(bits[:-1]).ljust(4, '0')[:4] for bits"];

/// Returns a folder with `port.py`, the template with planted errors.
fn folder(wrong: &[[&str; 2]]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_wrong_port(&folder.path().join("port.py"), wrong);
    folder
}

/// Runs `pogema` and returns its exit status and all that it prints.
fn pogema(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let (text, error, status) = program::pogema(folder, arguments);
    (status, text + "\n" + &error)
}

fn conform(folder: &Path, more: &[&str]) -> (i32, String) {
    let port = ["conform", "--port", "python3.11 port.py", "--workers", "2"];
    pogema(folder, &[&port, more].concat())
}

/// Replays the commands of a report, and checks that each shows the heading above it.
fn assert_replays(folder: &Path, report: &str, expected_status: i32) {
    let mut heading = "";
    let mut num_replays = 0;
    for line in report.lines() {
        if line.starts_with("FAIL") || line.starts_with("ERROR") {
            heading = line.rsplit_once(", ").unwrap().0;
        }
        let Some(replay) = line.strip_prefix("  play it again: pogema ") else { continue };
        let words = shell_words::split(replay).unwrap();
        let (status, text) = pogema(folder, &words.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(status, expected_status, "{replay}: {text}");
        assert!(text.contains(heading), "{heading}\n{replay}\n{text}");
        num_replays += 1;
    }
    assert!(num_replays > 0, "{report}");
}

/// Returns the number of agents of a kept case.
fn num_agents(path: &Path) -> usize {
    let case = pogema_conformance::cases::read(path).unwrap();
    let played = pogema_conformance::play(&case.request().unwrap());
    played.records[0].state().unwrap().cells.len()
}

#[test]
fn a_refused_instance_is_shown_and_replayed() {
    let folder = folder(&[REFUSING]);
    let (status, text) = conform(folder.path(), &["--cases", "0"]);
    assert_eq!(status, 1, "{text}");
    let headings: Vec<&str> = text.lines().filter(|line| line.starts_with("FAIL")).collect();
    assert_eq!(headings.len(), 1, "{text}");
    assert!(headings[0].starts_with("FAIL place/explicit: error differs, "), "{text}");
    assert!(text.contains("  when: one agent, one on an obstacle\n"), "{text}");
    assert!(text.contains("a at [0,0] hides the goal of a, an obstacle\n"), "{text}");
    assert_replays(folder.path(), &text, 1);
}

#[test]
fn a_report_quotes_the_rule_and_says_where_to_read_on() {
    let folder = folder(&[CROWDED]);
    let (_, text) = conform(folder.path(), &["--cases", "0", "--part", "cases", "--html", "report.html"]);
    let statement = "`collision_system: priority`, the default, handles the active agents one by one";
    let expected = [
        &format!("  rule: {statement}"),
        "  read on: https://pogema-rs.github.io/pogema-rs/spec/collide.html#collidepriority\n",
        "  (a, b… agents; A, B… their goals; ",
    ];
    for part in expected {
        assert!(text.contains(part), "{part} in {text}");
    }
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains(statement), "{page}");
}

#[test]
fn a_port_that_crashes_repeatedly_gets_a_small_counterexample() {
    let folder = folder(&[CROWDED, CRASHING]);
    let (status, text) = conform(folder.path(), &["--cases", "200", "--part", "drawn"]);
    assert_eq!(status, 3, "{text}");
    assert!(text.contains("ERROR ended (exit status: 7) instead of answering `"), "{text}");
    let kept = folder.path().join("pogema-found/collide-priority-cell.yaml");
    assert!(num_agents(&kept) <= 3, "{text}");
    assert!(!text.contains("cases not run"), "{text}");
}

#[test]
fn a_crash_is_shrunk_kept_and_replayed() {
    let folder = folder(&[CRASHING_IF_TWO_MOVE]);
    let (status, text) = conform(folder.path(), &["--cases", "0", "--part", "cases"]);
    assert_eq!(status, 3, "{text}");
    assert!(text.contains("  operation 1: ended (exit status: 7) instead of answering `step`\n"), "{text}");
    let kept = "pogema-found/protocol-ended-exit-status-7-instead-of-answering-step.yaml";
    assert_eq!(num_agents(&folder.path().join(kept)), 2, "{text}");
    assert_replays(folder.path(), &text, 3);
}

#[test]
fn a_mute_port_is_reported_once() {
    let folder = folder(&[MUTE]);
    let (status, text) = conform(folder.path(), &["--timeout", "0.5"]);
    assert_eq!(status, 3, "{text}");
    let end = "\nERROR gave no answer to `hello` within 3 s, ";
    let (table, error) = text.split_once(end).unwrap();
    assert!(table.contains("(protocol)") && !table.contains('/'), "{text}");
    assert!(!error.contains("cases of") && !error.contains("smallest"), "{text}");
    assert!(!error.contains("gave no answer"), "the cause is shown twice in {text}");
}

#[test]
fn windows_of_another_shape_are_one_difference() {
    let folder = folder(&[SHORT_WINDOWS]);
    let (status, text) = conform(folder.path(), &["--cases", "20"]);
    assert_eq!(status, 1, "{text}");
    let headings: Vec<&str> = text.lines().filter(|line| line.starts_with("FAIL")).collect();
    assert_eq!(headings.len(), 1, "{text}");
    assert!(headings[0].starts_with("FAIL observe/default: shape of observations differs, "), "{text}");
    assert!(!text.contains("cases not run"), "{text}");
    assert_replays(folder.path(), &text, 1);
}

#[test]
fn unknown_rules_and_simd_paths_are_rejected() {
    let folder = folder(&[]);
    for (wrong, nearest) in [("nonsense/*", "observe/mapf"), ("colide/soft*", "collide/soft")] {
        let (status, text) = conform(folder.path(), &["--rules", wrong]);
        assert_eq!(status, 2, "{text}");
        let expected = format!("expected a pattern that matches a rule; did you mean `{nearest}`?");
        assert!(text.contains(&expected), "{text}");
    }
    for command in ["conform", "port"] {
        let output =
            program::command(folder.path(), &[command]).env("POGEMA_SIMD", "bogus").output().unwrap();
        assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0));
        let text = std::str::from_utf8(&output.stderr).unwrap();
        let expected = "`POGEMA_SIMD` is `bogus`, expected `scalar`, `avx2` or `avx512`";
        assert!(text.contains(expected), "{text}");
    }
}

#[test]
fn one_known_entry_does_not_hide_two_causes() {
    const TWO: [&str; 2] = [
        "and there not in taken",
        "and (there not in taken or agent == 1) and not (agent == 0 and right == 1 and there not in taken)",
    ];
    let folder = folder(&[TWO]);
    let known = |more: &str| {
        format!("- {{rule: collide/priority, what: cell, since: 2026-11-22, reason: r{more}}}\n")
    };
    let run = |list: &str| {
        std::fs::write(folder.path().join("known.yaml"), list).unwrap();
        conform(folder.path(), &["--cases", "50", "--rules", "collide/priority", "--known", "known.yaml"])
    };
    let (status, text) = run(&known(""));
    assert_eq!(status, 1, "{text}");
    let when: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("  when: ")).collect();
    assert!(when.len() >= 2, "{text}");
    let all: String = when.iter().map(|when| known(&format!(", when: '{when}'"))).collect();
    let (status, text) = run(&all);
    assert_eq!(status, 0, "{text}");
    assert_eq!(text.matches("KNOWN collide/priority: cell").count(), when.len(), "{text}");
}
