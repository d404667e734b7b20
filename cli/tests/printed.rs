//! Tests of what the program prints: whole messages, escaped text, narrow terminals, and no panic where nothing can
//! be printed.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod program;

use std::fs::{self, File, OpenOptions};
use std::io::Read;
use std::process::{Command, Output, Stdio};

use nix::pty::{Winsize, openpty};
use program::command as pogema;

/// A device that is always full.
fn full() -> File {
    OpenOptions::new().write(true).open("/dev/full").unwrap()
}

/// Returns the writing end of a pipe whose reader is closed.
fn closed() -> Stdio {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    writer.into()
}

fn status(command: &mut Command) -> Option<i32> {
    command.status().unwrap().code()
}

const SUITE: &str = "
environment: {name: Environment, num_agents: 2, size: 8, seed: {grid_search: [0, 1]}, max_episode_steps: 8}
algorithms: {Random: {name: random}}
";

#[test]
fn messages_to_a_full_or_closed_standard_error_cause_no_panic() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("suite.yaml"), SUITE).unwrap();
    fs::write(folder.path().join("start.yaml"), "{map: '.#.', agents_xy: [[0, 1]], targets_xy: [[0, 2]]}")
        .unwrap();
    let at = folder.path();
    for (arguments, expected) in [
        (&["run", "bogus.yaml"][..], 2),
        (&["run", "--bogus"], 2),
        (&["maps"], 2),
        (&["run", "start.yaml", "--policy", "stay"], 0),
        (&["evaluate", "suite.yaml", "--out", "results", "--html", "--force"], 0),
        (&["evaluate", "suite.yaml", "--out", "results"], 2),
        (&["replay", "results", "Random", "9"], 2),
    ] {
        let run = || pogema(at, arguments);
        assert_eq!(status(run().stdout(Stdio::null()).stderr(full())), Some(expected), "{arguments:?}, full");
        assert_eq!(
            status(run().stdout(Stdio::null()).stderr(closed())),
            Some(expected),
            "{arguments:?}, closed"
        );
    }
}

#[test]
fn results_that_cannot_be_printed_are_an_error() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [
        &["--help"][..],
        &["--version"],
        &["help", "run"],
        &["run", "--help"],
        &[],
        &["maps", "list"],
        &["maps", "generate", "mazes"],
        &["run", "--seed", "1", "--json"],
    ] {
        let output = pogema(folder.path(), arguments).stdout(full()).stderr(Stdio::piped()).output().unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
        assert_eq!(error, "error: standard output: No space left on device (os error 28)\n", "{arguments:?}");
        // A reader such as `head` may stop early.
        let output =
            pogema(folder.path(), arguments).stdout(closed()).stderr(Stdio::piped()).output().unwrap();
        let expected = if arguments.is_empty() { 2 } else { 0 };
        assert_eq!((output.status.code(), output.stderr.len()), (Some(expected), 0), "{arguments:?}");
    }
}

#[test]
fn a_closed_pipe_loses_neither_files_nor_the_exit_status() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("plan.txt"), "(0,0)\n(5,5)\n").unwrap();
    for (arguments, expected, file) in [
        (&["run", "--seed", "1", "--render", "--trace", "out.jsonl"][..], 0, Some("out.jsonl")),
        (&["render", "out.jsonl", "--text", "--fps", "1000", "--html", "out.html"], 0, Some("out.html")),
        (&["validate", "plan.txt", "--seed", "1"], 1, None),
    ] {
        let output = pogema(at, arguments).stdout(closed()).stderr(Stdio::piped()).output().unwrap();
        assert_eq!((output.status.code(), output.stderr.len()), (Some(expected), 0), "{arguments:?}");
        assert!(file.is_none_or(|name| at.join(name).exists()), "{arguments:?}");
    }
}

#[test]
fn unprintable_characters_of_map_names_are_escaped() {
    let folder = tempfile::tempdir().unwrap();
    let name = "a\u{1b}[2J\u{202e}b\n\u{9b}1m.map";
    fs::write(folder.path().join(name), "type octile\nheight 1\nwidth 4\nmap\n....\n").unwrap();
    let output = |arguments: &[&str]| -> Output { pogema(folder.path(), arguments).output().unwrap() };
    assert!(output(&["maps", "export", name, "--to", "zip", "--out", "maps.zip"]).status.success());
    for arguments in [
        &["maps", "list", "a\u{1b}.2J", "--maps", "maps.zip"][..],
        &["maps", "list", "--maps", "maps.zip"],
        &["maps", "show", "maps.zip"],
        &["maps", "import", "maps.zip"],
        &["maps", "stats", "maps.zip"],
        &["maps", "stats", "maps.zip", "--json"],
        &["maps", "stats", "maps.zip", "--num-agents", "1", "--seed", "1"],
        &["maps", "list", "--maps", "maps.zip", "--maps", "maps.zip"],
        &["maps", "show", "a\u{202e}[", "--maps", "maps.zip"],
        &["run", "--map", name, "--bogus\u{9b}1m\u{202e}"],
    ] {
        let Output { stdout, stderr, .. } = output(arguments);
        let text = String::from_utf8(stdout).unwrap() + &String::from_utf8(stderr).unwrap();
        let is_raw = |letter: char| letter.is_control() && letter != '\n' || letter == '\u{202e}';
        assert!(!text.contains(is_raw), "{arguments:?}: {text:?}");
        assert!(text.contains("202e"), "{arguments:?}: {text}");
    }
}

/// Runs a command in a terminal of 40 columns. Returns the printed lines without control sequences. The lines include
/// each state of a progress bar.
fn in_narrow_terminal(mut command: Command) -> Vec<String> {
    let size = Winsize { ws_row: 24, ws_col: 40, ws_xpixel: 0, ws_ypixel: 0 };
    let terminal = openpty(&size, None).unwrap();
    let (stdout, stderr) = (terminal.slave.try_clone().unwrap(), terminal.slave);
    let mut child = command.stdin(Stdio::null()).stdout(stdout).stderr(stderr).spawn().unwrap();
    // The output ends when the last process closes the terminal.
    drop(command);
    let mut printed = Vec::new();
    let mut reader = File::from(terminal.master);
    let mut bytes = [0; 4096];
    // At the end, Linux reports an error.
    while let Ok(count @ 1..) = reader.read(&mut bytes) {
        printed.extend_from_slice(&bytes[..count]);
    }
    let text = console::strip_ansi_codes(std::str::from_utf8(&printed).unwrap()).into_owned();
    assert!(child.wait().unwrap().success(), "{text}");
    text.split(['\r', '\n']).map(|line| line.trim_end().to_owned()).collect()
}

#[test]
fn tables_and_progress_bars_fit_a_narrow_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let views = "results_views: {Means: {type: tabular, print_results: True, drop_keys: [seed]}}";
    fs::write(at.join("suite.yaml"), format!("{SUITE}{views}")).unwrap();
    let is_sentence = |line: &str| line.contains("; ") || line.starts_with("mean ± ");
    for (arguments, expected) in [
        (&["evaluate", "suite.yaml", "--out", "results"][..], "2/2, 0s left"),
        (&["views", "results"], "Algorithm  "),
        (&["maps", "list"], "map         four-rooms"),
        (&["bench", "--seconds", "0.001", "--rounds", "1", "--rows", "1 agent, 32"], "work "),
    ] {
        let lines = in_narrow_terminal(pogema(at, arguments));
        assert!(lines.iter().any(|line| line.contains(expected)), "{arguments:?}: {lines:#?}");
        for line in lines.iter().filter(|line| !is_sentence(line)) {
            assert!(console::measure_text_width(line) <= 40, "{arguments:?}: {line}");
        }
    }
}
