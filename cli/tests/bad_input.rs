//! Tests of bad input: the program prints a message, exits with status 2 and writes nothing. Further tests cover input
//! that only triggers a warning, and a closed pipe.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;
mod program;

use std::path::Path;
use std::process::Stdio;

use common::TRACE;
use program::{assert_rejected, command, output as run};

/// The files of the folder in which every run starts.
const FILES: [(&str, &str); 17] = [
    ("unreadable.yaml", "size: 8\nmap: [\n"),
    ("unknown-key.yaml", "colision_system: soft\n"),
    ("wrong-type.yaml", "size: 8\nnum_agents: two\n"),
    ("out-of-range.yaml", "obs_radius: 129\n"),
    ("nan.yaml", "density: .nan\n"),
    ("list.yaml", "- size: 8\n"),
    ("ragged.yaml", "map: |\n  ...\n  ..\n"),
    ("odd.txt", "..#\n.?.\n"),
    ("twins.yaml", "{agents_xy: [[0, 0], [0, 0]], targets_xy: [[0, 1], [1, 0]]}"),
    ("goals.yaml", "{agents_xy: [[0, 0], [0, 1]], targets_xy: [[1, 0]]}"),
    ("two.json", r#"{"map": "aA\nbB"}"#),
    ("one-action.jsonl", "[4, 4]\n\n[0]\n"),
    ("action-9.jsonl", "[4, 9]\n"),
    ("no-actions.jsonl", "[4, 4]\nup, down\n"),
    ("trace.jsonl", TRACE),
    ("old.jsonl", "what was there before\n"),
    ("blank.yaml", ""),
];

const FPS: &str = "`--fps` is `1e300`, expected 0.001 to 1000";
const FPS_TINY: &str = "`--fps` is `1e-300`, expected 0.001 to 50 for a GIF";

/// Arguments and the error message that they cause.
const REJECTED: [(&str, &str); 82] = [
    ("run --num-agents two", "invalid value 'two' for '--num-agents <N>': invalid digit found in string"),
    (
        "run --sped 3",
        "unexpected argument '--sped' found\n\n  tip: a similar argument exists: '--seed'\n\nUsage: pogema run --seed \
         <S> [CONFIG]",
    ),
    (
        "plan --planner lakam",
        "invalid value 'lakam' for '--planner <NAME>'\n  [possible values: lacam, pibt, pbs, ecbs, cbs]\n\n  tip: a \
         similar value exists: 'lacam'",
    ),
    ("run unreadable.yaml", "unreadable.yaml: config: line 2, column 6: unclosed bracket '['"),
    (
        "run unknown-key.yaml",
        "unknown-key.yaml: config: unknown field `colision_system`; did you mean `collision_system`?",
    ),
    (
        "run wrong-type.yaml",
        "wrong-type.yaml: config: `num_agents` is `\"two\"`, expected a whole number from 1 to 10000000",
    ),
    ("run --set persistent=1", "`--set persistent` is `1`, expected true or false"),
    (
        "run out-of-range.yaml",
        "out-of-range.yaml: config: `obs_radius` is `129`, expected a whole number from 1 to 128",
    ),
    ("run --size 1", "`--size` is `1`, expected a whole number from 2 to 4096"),
    ("run --density 1.5", "`--density` is `1.5`, expected a number from 0 to 1"),
    ("run --density nan", "`--density` is `\"NaN\"`, expected a number from 0 to 1"),
    ("run nan.yaml", "nan.yaml: config: line 1, column 10: `density` is `NaN`, expected a finite number"),
    ("run list.yaml", "list.yaml: expected fields and values such as `size: 8`"),
    ("run two.json --set sise=4", "`--set` is `sise`, expected a config field; did you mean `size`?"),
    // The flag is at fault, not the file.
    (
        "run two.json --set map=.?",
        "`--set map`: map: line 1, column 2: unknown character `?`, expected one of `.#@$!`, a-z or A-Z",
    ),
    ("run --set size", "`--set` is `size`, expected FIELD=VALUE, such as `empty_outside=false`"),
    (
        "run ragged.yaml",
        "ragged.yaml: map: line 2, column 3: the row has 2 cells, expected 3 as in the first row",
    ),
    (
        "run --map odd.txt",
        "odd.txt: map: line 2, column 2: unknown character `?`, expected one of `.#@$!`, a-z or A-Z",
    ),
    (
        "run --map five-rooms",
        "five-rooms: no such file; config: `map_name` is `five-rooms`, expected a pattern that matches a \
         known map; did you mean `four-rooms`?",
    ),
    ("run twins.yaml", "twins.yaml: instance: agent 1: start (0, 0) is the start of agent 0 too"),
    (
        "run goals.yaml",
        "goals.yaml: config: `targets_xy` is `a list of 1`, expected a list of 2, one for each agent in agents_xy",
    ),
    (
        "run --size 3 --density 0 --seed 1 --num-agents 5",
        "`--num-agents` is `5`, expected at most 4; the map has no room for more",
    ),
    ("run missing.yaml", "missing.yaml: No such file or directory (os error 2)"),
    (
        "run two.json --policy file --actions missing.jsonl",
        "missing.jsonl: No such file or directory (os error 2)",
    ),
    (
        "run two.json --policy file --actions one-action.jsonl --trace new.jsonl",
        "one-action.jsonl: line 3: actions has length 1, expected 2",
    ),
    (
        "run two.json --policy file --actions action-9.jsonl --trace old.jsonl",
        "action-9.jsonl: line 1: action of agent 1 is `9`, expected 0 (stay), 1 (up), 2 (down), 3 (left) or 4 \
         (right)",
    ),
    (
        "run two.json --policy file --actions no-actions.jsonl",
        "no-actions.jsonl: line 2: found `up, down`, expected a list of action numbers such as [0, 4]",
    ),
    ("run two.json --policy file --actions trace.jsonl", "trace.jsonl: the trace has 1 agent, expected 2"),
    ("run two.json --policy file", "`--policy file` needs `--actions FILE`"),
    ("run two.json --actions trace.jsonl", "`--actions` needs `--policy file`"),
    // Long runs: if the output were checked only at the end, the test would time out.
    (
        "run --steps 9000000000 --policy stay --trace no/where.jsonl",
        "no/where.jsonl: `no`: No such file or directory (os error 2)",
    ),
    (
        "run --steps 9000000000 --policy stay --trace blank.yaml/x",
        "blank.yaml/x: `blank.yaml` is not a folder",
    ),
    (
        "conform --vectors .",
        ".: contains other files, expected a new or empty folder, or a folder of vectors",
    ),
    ("conform --cases 9000000000 --json ./", "./: is not a regular file"),
    ("bench --rows nothing", "`--rows` is `nothing`, expected a part of a row's name, such as `64 agents`"),
    ("bench --seconds 0", "`--seconds` is `0`, expected a time above 0"),
    ("bench --rounds 0", "invalid value '0' for '--rounds <N>': 0 is not in 1..18446744073709551615"),
    ("bench --json no/where.json", "no/where.json: `no`: No such file or directory (os error 2)"),
    (
        "render",
        "the following required arguments were not provided:\n  <TRACE>\n\nUsage: pogema render <TRACE>",
    ),
    (
        "conform --html x",
        "the following required arguments were not provided:\n  --port <COMMAND>\n\nUsage: pogema conform --port \
         <COMMAND> --html <FILE>",
    ),
    (
        "run two.json --policy file --actions blank.yaml",
        "blank.yaml: no actions, expected a trace or a list of action numbers per line",
    ),
    ("render trace.jsonl --svg a.svg --fps 1e300", FPS),
    ("render trace.jsonl --fps 1e300", FPS),
    ("render trace.jsonl --gif a.gif --fps 1e-300", FPS_TINY),
    (
        "maps stats four-rooms --num-agents 4000000000",
        "`--num-agents` has no effect: the map has no agents; `--seed` draws them, `--scenario` reads them",
    ),
    ("render nowhere.jsonl", "nowhere.jsonl: No such file or directory (os error 2)"),
    ("render old.jsonl", "old.jsonl: trace: line 1: column 1: expected value"),
    (
        "render trace.jsonl --svg nowhere/a.svg",
        "nowhere/a.svg: `nowhere`: No such file or directory (os error 2)",
    ),
    ("render trace.jsonl --frame 1", "`--frame` is `1`, expected 0 to 0"),
    ("render trace.jsonl --png a.png --frame 1", "`--frame` is `1`, expected 0 to 0"),
    ("render trace.jsonl --svg a.svg --egocentric 1", "`--egocentric` is `1`, expected 0 to 0"),
    ("render trace.jsonl --png a.png --width 0", "`--width` is `0`, expected at least 1"),
    (
        "render trace.jsonl --png a.png --width 90000",
        "size of the picture is `90000 x 72000 pixels`, expected 1 to 67108864 pixels in all: choose another width",
    ),
    ("render trace.jsonl --gif a.gif --fps 0", "`--fps` is `0`, expected 0.001 to 50 for a GIF"),
    ("render trace.jsonl --gif a.gif --fps 51", "`--fps` is `51`, expected 0.001 to 50 for a GIF"),
    (
        "render trace.jsonl --gif a.gif --fps 0.001",
        "number of frames is `40000`, expected at most 20000: draw fewer steps or more steps a second",
    ),
    ("render trace.jsonl --svg a --png a", "`--svg` and `--png` name the same file, `a`"),
    ("run --trace a --html ./a", "`--trace` and `--html` name the same file, `./a`"),
    ("plan --out a --result ./a", "`--out` and `--result` name the same file, `./a`"),
    (
        "render trace.jsonl --steps 0..0 --frame 18446744073709551615",
        "`--frame` is `18446744073709551615`, expected 0 to 0",
    ),
    (
        "maps show five-rooms",
        "five-rooms: no such file; config: `map_name` is `five-rooms`, expected a pattern that matches a known map; \
         did you mean `four-rooms`?",
    ),
    (
        "render trace.jsonl --video a.avi",
        "a.avi: unknown video format, expected a name ending in `.mp4` or `.webm`",
    ),
    (
        "render trace.jsonl --steps 3..1",
        "invalid value '3..1' for '--steps <A..B>': found `3..1`, expected `A..B` with A at most B, such as `10..20`",
    ),
    ("render trace.jsonl --steps 0..1", "`--steps` is `1`, expected 0 to 0"),
    (
        "render trace.jsonl --colors red",
        "invalid value 'red' for '--colors <COLORS>': colour is `red`, expected a colour such as `#c1433c`",
    ),
    ("run --gif a.gif --view 5", "`--egocentric` is `5`, expected 0 to 0"),
    ("run two.json --trace two.json", "`--trace` would overwrite `two.json`, which the command reads"),
    ("plan two.json --out ./two.json", "`--out` would overwrite `./two.json`, which the command reads"),
    (
        "run two.json --policy file --actions one-action.jsonl --trace one-action.jsonl",
        "`--trace` would overwrite `one-action.jsonl`, which the command reads",
    ),
    (
        "render trace.jsonl --html trace.jsonl",
        "`--html` would overwrite `trace.jsonl`, which the command reads",
    ),
    (
        "conform --trace trace.jsonl --json trace.jsonl",
        "`--json` would overwrite `trace.jsonl`, which the command reads",
    ),
    ("maps show four-rooms --svg a --png ./a", "`--svg` and `--png` name the same file, `./a`"),
    (
        "run --seed 1 --set seed=2",
        "`--set seed` is `2`, expected no value, because `--seed` sets `seed`, too",
    ),
    ("run --map four-rooms --size 9", "`--size` is `9`, expected no value, because a map is given"),
    ("run two.json --set density=0.1", "`--set density` is `0.1`, expected no value, because a map is given"),
    (
        "run --map puzzle-crossroads --set targets_xy=[[0,0]]",
        "`--set targets_xy` is `[[0,0]]`, expected `agents_xy` beside it, because the map has its own starts and goals",
    ),
    ("plan --steps 0", "`--steps` is `0`, expected at least 1 for a plan"),
    ("maps generate validation-random --seeds 0..4", "`--seeds` is only for `random` and `mazes`"),
    (
        "maps generate shelves --walls-rows 60000",
        "`--walls-rows` is `60000`, expected fewer: the map would have 300003 rows, and 1 to 65279 are possible",
    ),
    ("maps generate random --wall-width 9", "`--wall-width` is only for `shelves`"),
    (
        "maps generate random --obstacle-density-min 2",
        "`--obstacle-density-min` is `2`, expected at most obstacle_density_max, which is 0.3",
    ),
    (
        "maps stats four-rooms --num-agents 0",
        "invalid value '0' for '--num-agents <N>': 0 is not in 1..18446744073709551615",
    ),
];

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in FILES {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn lines(text: &[u8]) -> Vec<&str> {
    std::str::from_utf8(text).unwrap().lines().collect()
}

#[test]
fn bad_input_is_rejected_with_a_message() {
    let folder = folder();
    for (arguments, expected) in REJECTED {
        assert_rejected(folder.path(), &arguments.split(' ').collect::<Vec<_>>(), expected);
    }
}

#[test]
fn a_trace_of_another_version_is_rejected() {
    for (what, old, new) in
        [("spec", "pogema-1.4.0/1", "pogema-2.0/1"), ("format", "pogema-trace/1", "other/7")]
    {
        let folder = folder();
        let trace = TRACE.replace(old, new).replace("\"soft\"", "\"softer\"");
        let path = folder.path().join("trace.jsonl");
        std::fs::write(&path, trace).unwrap();
        let output = run(folder.path(), &["run", "--policy", "file", "--actions", "trace.jsonl"]);
        let later = if what == "format" { "`pogema-trace/2` or " } else { "" };
        let expected =
            format!("error: trace.jsonl: trace: line 1: the {what} is `{new}`, expected {later}`{old}`");
        assert_eq!(lines(&output.stderr), [expected]);
        assert_eq!((output.stdout.len(), output.status.code()), (0, Some(2)));
    }
}

#[test]
fn control_characters_in_input_are_escaped() {
    let folder = folder();
    let field = "a\nb\u{1b}[2J=1";
    let expected = "`--set` is `a\\nb\\u{1b}[2J`, expected a config field";
    assert_rejected(folder.path(), &["run", "--set", field], expected);
    assert_rejected(folder.path(), &["run", "no\nfile"], "no\\nfile: No such file or directory (os error 2)");
}

#[cfg(unix)]
#[test]
fn a_device_is_rejected_as_output_file() {
    use std::os::unix::fs::FileTypeExt;

    let folder = folder();
    assert_rejected(folder.path(), &["run", "--trace", "/dev/null"], "/dev/null: is not a regular file");
    assert!(std::fs::metadata("/dev/null").unwrap().file_type().is_char_device());
}

#[test]
fn an_obstacle_under_a_start_triggers_a_warning() {
    let folder = folder();
    let config = "{map: '.#.', agents_xy: [[0, 1]], targets_xy: [[0, 2]]}";
    std::fs::write(folder.path().join("start.yaml"), config).unwrap();
    let output = run(folder.path(), &["run", "start.yaml", "--policy", "stay", "--trace", "out.jsonl"]);
    let expected = "warning: the start of agent 0 is on an obstacle, cell (0, 1) counted without the border; the \
                    cell becomes free";
    assert_eq!(lines(&output.stderr), [expected]);
    assert_eq!((lines(&output.stdout).len(), output.status.code()), (1, Some(0)));
    let again = run(folder.path(), &["run", "start.yaml", "--policy", "file", "--actions", "out.jsonl"]);
    assert_eq!(again.stdout, output.stdout);
    assert_eq!(lines(&run(folder.path(), &["plan", "start.yaml"]).stderr), [expected]);
}

#[test]
fn a_closed_pipe_is_not_an_error() {
    let arguments = ["run", "--seed", "1", "--steps", "2000", "--render", "--policy", "stay"];
    let mut run = command(Path::new("."), &arguments);
    let mut process = run.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(process.stdout.take());
    let output = process.wait_with_output().unwrap();
    assert_eq!((lines(&output.stderr).len(), output.status.code()), (0, Some(0)));
}
