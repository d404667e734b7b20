//! Tests of `pogema maps`, and of maps in `pogema run`.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod program;

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;

use program::{command, output};

#[track_caller]
fn stdout_of(folder: &Path, arguments: &[&str]) -> String {
    let output = output(folder, arguments);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {errors}");
    assert_eq!(errors, "", "{arguments:?}");
    String::from_utf8(output.stdout).unwrap()
}

#[track_caller]
fn assert_error(folder: &Path, arguments: &[&str], parts: &[&str]) {
    let output = output(folder, arguments);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {errors}");
    assert!(
        errors.lines().count() == 1 || errors.ends_with("For more information, try '--help'.\n"),
        "{errors}"
    );
    assert!(output.stdout.is_empty(), "{arguments:?}");
    for part in parts {
        assert!(errors.contains(part), "`{part}` is not in: {errors}");
    }
}

fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

const CITY: &str = "type octile\nheight 4\nwidth 4\nmap\n....\n.@@.\n.@@.\nT..S\n";

#[test]
fn a_generated_set_is_read_back() {
    let folder = folder(&[]);
    let at = folder.path();
    let set = stdout_of(at, &["maps", "generate", "mazes", "--seeds", "5..8", "--width-min", "9"]);
    assert_eq!(set.matches("\"mazes-seed-").count(), 3);
    stdout_of(
        at,
        &["maps", "generate", "mazes", "--seeds", "5..8", "--width-min", "9", "--out", "mazes.yaml"],
    );
    assert_eq!(std::fs::read_to_string(at.join("mazes.yaml")).unwrap(), set);
    assert_eq!(stdout_of(at, &["maps", "import", "mazes.yaml"]), set);
    assert!(stdout_of(at, &["maps", "list", "mazes-.*", "--maps", "mazes.yaml"]).contains("mazes-seed-6"));
    assert!(stdout_of(at, &["maps", "generate", "shelves", "--bays", "toolbox"]).contains('$'));
    assert_eq!(stdout_of(at, &["maps", "generate", "warehouse"]).lines().count(), 34);
    let random = ["maps", "generate", "random", "--seeds", "0..2", "--name", "mine", "--width-max", "17"];
    assert!(stdout_of(at, &random).starts_with("\"mine-seed-0\": |-\n"));
}

#[test]
fn commands_that_take_a_map_accept_maps_of_the_paper() {
    let folder = folder(&[("config.yaml", "map_name: validation-mazes-seed-005\nseed: 1\nnum_agents: 2\n")]);
    let at = folder.path();
    let (maze, random) = ("validation-mazes-seed-005", "validation-random-seed-000");
    let shown = stdout_of(at, &["maps", "show", maze]);
    assert!(shown.starts_with("validation-mazes-seed-005: 21 rows, 21 columns, "), "{shown}");
    let set = stdout_of(at, &["maps", "generate", "validation-mazes"]);
    let own = stdout_of(at, &["maps", "export", maze, "--to", "set"]);
    assert!(set.contains(&own), "{own}");
    let task = ["--map", random, "--num-agents", "4", "--seed", "1"];
    stdout_of(at, &[&["plan", "--nodes", "1000", "--out", "plan.txt"], &task[..]].concat());
    stdout_of(at, &[&["validate", "plan.txt"], &task[..]].concat());
    stdout_of(at, &[&["run", "--steps", "3"], &task[..]].concat());
    stdout_of(at, &["run", "config.yaml", "--steps", "3"]);
    stdout_of(at, &["run", "--map", "validation-random-seed-00.", "--seed", "1", "--steps", "3"]);
    assert!(stdout_of(at, &["maps", "stats", "wfi_warehouse"]).contains("| wfi_warehouse |"));
    assert!(stdout_of(at, &["maps", "tiles", maze, "--side", "7"]).contains("validation-mazes-seed-005"));
    assert_eq!(stdout_of(at, &["maps", "list", "training-mazes-seed-012."]).lines().count(), 2 + 2);
    assert_error(
        at,
        &["maps", "show", "validation-mazes-seed-128"],
        &["did you mean `validation-mazes-seed-"],
    );
}

#[test]
fn generated_maps_are_written_one_by_one() {
    let folder = folder(&[]);
    let arguments = ["maps", "generate", "mazes", "--seeds", "0..1000000000000"];
    let mut generate = command(folder.path(), &arguments);
    let mut process = generate.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut output = BufReader::new(process.stdout.take().unwrap());
    let mut first = String::new();
    output.read_line(&mut first).unwrap();
    assert_eq!(first, "\"mazes-seed-000000000000\": |-\n");
    drop(output);
    let rest = process.wait_with_output().unwrap();
    let note = String::from_utf8(rest.stderr).unwrap();
    assert!(
        note.starts_with("note: 1000000000000 maps to generate, about ") && note.ends_with("iB in all\n"),
        "{note}"
    );
    assert_eq!(rest.status.code(), Some(0));
}

#[test]
fn maps_convert_between_formats() {
    let folder = folder(&[("city.map", CITY), ("pair.txt", "a..A\nB..b\n")]);
    let at = folder.path();
    stdout_of(at, &["maps", "export", "city.map", "--to", "text", "--out", "city.txt"]);
    assert_eq!(std::fs::read_to_string(at.join("city.txt")).unwrap(), "....\n.##.\n.##.\n#...\n");
    assert_eq!(
        stdout_of(at, &["maps", "export", "city.txt", "--to", "map"]),
        CITY.replace('T', "@").replace('S', ".")
    );
    let stripped = stdout_of(at, &["maps", "import", "city.map", "--strip-border"]);
    assert_eq!(stripped, "\"city\": |-\n  ##\n  ##\n");
    stdout_of(at, &["maps", "export", "city.map", "--to", "zip", "--out", "cities.zip"]);
    assert_eq!(
        stdout_of(at, &["maps", "import", "cities.zip"]),
        stdout_of(at, &["maps", "import", "city.map"])
    );
    stdout_of(at, &["maps", "export", "pair.txt", "--to", "scen", "--out", "pair.scen"]);
    stdout_of(at, &["maps", "export", "pair.txt", "--to", "map", "--out", "pair.map"]);
    let config = stdout_of(at, &["maps", "export", "pair.map", "--scenario", "pair.scen", "--to", "config"]);
    assert_eq!(config, stdout_of(at, &["maps", "export", "pair.txt", "--to", "config"]));
    assert!(config.contains("agents_xy: [[0, 0], [1, 3]]\ntargets_xy: [[0, 3], [1, 0]]\n"), "{config}");
    let back = ["maps", "export", "pair.map", "--scenario", "pair.scen", "--to", "text"];
    assert_eq!(stdout_of(at, &back), "a..A\nB..b\n");
    let one = ["maps", "export", "pair.map", "--scenario", "pair.scen", "--to", "text", "--num-agents", "1"];
    assert_eq!(stdout_of(at, &one), "a..A\n....\n");
    let tiles = stdout_of(at, &["maps", "tiles", "city.map", "--side", "2"]);
    assert_eq!(tiles.matches("\"city_0").count(), 4);
}

#[test]
fn configs_without_matching_starts_and_goals_are_rejected() {
    let folder = folder(&[
        ("lone.yaml", "map: \"....\"\nagents_xy: [[0, 0]]\n"),
        ("unequal.yaml", "map: \"....\"\nagents_xy: [[0, 0], [0, 1]]\ntargets_xy: [[0, 2]]\n"),
        ("pool.yaml", "map: \"....\"\npossible_targets_xy: [[0, 2]]\n"),
    ]);
    let parts = ["targets_xy", "agents_xy", "error: "];
    for file in ["lone.yaml", "unequal.yaml"] {
        for command in [&["run", "--map", file][..], &["maps", "stats", file], &["maps", "show", file]] {
            assert_error(folder.path(), command, &[&parts[..], &[file]].concat());
        }
        for format in ["text", "scen", "config", "set"] {
            assert_error(folder.path(), &["maps", "export", file, "--to", format], &parts);
        }
    }
    assert_error(folder.path(), &["maps", "show", "pool.yaml"], &["pool.yaml", "possible_agents_xy"]);
}

#[test]
fn exported_configs_keep_sequences_and_pools_and_other_formats_reject_them() {
    let sequences =
        "map: \"....\"\nagents_xy: [[0, 0]]\ntargets_xy: [[[0, 1], [0, 2]]]\non_target: restart\n";
    let pools =
        "map: \"..#.\"\npossible_agents_xy: [[0, 3], [0, 0]]\npossible_targets_xy: [[0, 0], [0, 2]]\n";
    let folder = folder(&[("sequences.yaml", sequences), ("pools.yaml", pools)]);
    let at = folder.path();
    let config = stdout_of(at, &["maps", "export", "sequences.yaml", "--to", "config"]);
    assert_eq!(config, "map: |-\n  ....\nagents_xy: [[0, 0]]\ntargets_xy: [[[0, 1], [0, 2]]]\n");
    let config = stdout_of(at, &["maps", "export", "pools.yaml", "--to", "config"]);
    let fields = "possible_agents_xy: [[0, 3], [0, 0]]\npossible_targets_xy: [[0, 0], [0, 2]]\n";
    assert_eq!(config, format!("map: |-\n  ..#.\n{fields}"));
    for format in ["text", "set", "scen"] {
        assert_error(at, &["maps", "export", "sequences.yaml", "--to", format], &["targets_xy", "sequences"]);
    }
    for format in ["text", "set"] {
        assert_error(at, &["maps", "export", "pools.yaml", "--to", format], &["possible_agents_xy"]);
    }
    assert_error(at, &["maps", "export", "pools.yaml", "--to", "scen"], &["`pools` has no starts and goals"]);
    let run = ["run", "--map", "sequences.yaml", "--on-target", "restart", "--json"];
    let summary: serde_json::Value = serde_json::from_str(&stdout_of(at, &run)).unwrap();
    assert_eq!(summary["config"]["targets_xy"], serde_json::json!([[[0, 1], [0, 2]]]));
}

#[test]
fn maps_are_shown_and_analysed() {
    let folder = folder(&[("pocket.txt", "a.B#.\nA.b#.\n####.\n.....\n"), ("row.txt", "aBbA\n")]);
    let at = folder.path();
    let shown = stdout_of(at, &["maps", "show", "row.txt"]);
    assert_eq!(shown, "row: 1 row, 4 columns, 4 free cells, density 0.000, 1 component\naBbA\n");
    let small = stdout_of(at, &["maps", "show", "four-rooms", "--width", "7"]);
    assert_eq!(small.lines().skip(1).map(|line| line.chars().count()).collect::<Vec<_>>(), [7; 4]);
    let turn = stdout_of(at, &["maps", "show", "puzzle-square-turn"]);
    assert!(
        turn.ends_with("\n#####  #####\n#ab##  #DA##\n#dc##  #CB##\n#####  #####\n#####  #####\n"),
        "{turn}"
    );
    let stats = stdout_of(at, &["maps", "stats", "row.txt"]);
    assert!(stats.contains("unsolvable: agents 0, 1 share a corridor"), "{stats}");
    let stats = stdout_of(at, &["maps", "stats", "row.txt", "--on-target", "finish", "--json"]);
    let summary: serde_json::Value = serde_json::from_str(&stats).unwrap();
    assert_eq!(summary[0]["scenario"]["solvable"], true);
    let placed = stdout_of(at, &["maps", "stats", "pocket.txt", "--num-agents", "2", "--seed", "3"]);
    assert!(placed.contains("2 agents, sum of costs at least"), "{placed}");
    assert_eq!(stdout_of(at, &["maps", "stats", "puzzle-.*"]).matches("; unsolvable:").count(), 0);
}

#[test]
fn the_seed_chooses_among_matching_maps() {
    let folder = folder(&[("set.yaml", "one: \"a.A\"\ntwo: \"a..A\"\nthree: \"a...A\"\n")]);
    let at = folder.path();
    let cells = |seed: &str| {
        let run = ["run", "--maps", "set.yaml", "--map", "one|t.*", "--seed", seed, "--json"];
        let summary: serde_json::Value = serde_json::from_str(&stdout_of(at, &run)).unwrap();
        summary["config"]["map"][0].as_array().unwrap().len()
    };
    let lengths: BTreeSet<usize> = (0..16).map(|seed| cells(&seed.to_string())).collect();
    assert_eq!(lengths, [3, 4, 5].into());
    std::fs::write(at.join("config.yaml"), "map_name: tw.\nseed: 1\n").unwrap();
    let run = ["run", "config.yaml", "--maps", "set.yaml", "--policy", "astar", "--json"];
    let summary: serde_json::Value = serde_json::from_str(&stdout_of(at, &run)).unwrap();
    assert_eq!((&summary["steps"], &summary["metrics"]["CSR"]), (&3.into(), &1.0.into()));
    let puzzle =
        ["run", "--map", "puzzle-full-ring", "--num-agents", "3", "--set", "on_target=nothing", "--json"];
    let summary: serde_json::Value = serde_json::from_str(&stdout_of(at, &puzzle)).unwrap();
    assert_eq!(summary["config"]["num_agents"], 3);
}

#[test]
fn a_scenario_is_truncated_to_the_number_of_agents() {
    let yaml = "agents_xy: [[0, 0], [0, 3]]\ntargets_xy: [[[0, 1], [0, 2]], [[0, 2], [0, 3]]]\n";
    let folder = folder(&[("row.txt", "....\n"), ("scenario.yaml", yaml)]);
    let at = folder.path();
    let run = ["run", "--map", "row.txt", "--scenario", "scenario.yaml", "--on-target", "restart", "--json"];
    let summary: serde_json::Value = serde_json::from_str(&stdout_of(at, &run)).unwrap();
    assert_eq!(summary["config"]["num_agents"], 2);
    let one: Vec<&str> = run.into_iter().chain(["--num-agents", "1"]).collect();
    let summary: serde_json::Value = serde_json::from_str(&stdout_of(at, &one)).unwrap();
    assert_eq!(summary["config"]["targets_xy"], serde_json::json!([[[0, 1], [0, 2]]]));
    let config = ["maps", "export", "row.txt", "--scenario", "scenario.yaml", "--to", "config"];
    assert!(stdout_of(at, &config).contains("targets_xy: [[[0, 1], [0, 2]], [[0, 2], [0, 3]]]"));
    let lost = ["maps", "export", "row.txt", "--scenario", "scenario.yaml", "--to", "scen"];
    assert_error(at, &lost, &["sequences"]);
}

#[test]
fn wrong_input_is_reported_with_file_and_position() {
    let files = [
        ("bad.map", "type octile\nheight 1\nwidth 2\nmap\n.x\n"),
        ("bad.yaml", "one: |-\n  ..\n  .?\n"),
        ("two.yaml", "one: ..\ntwo: ..\n"),
        ("copy.yaml", "one: ..\n"),
        ("far.scen", "version 1\n0\tm\t9\t9\t0\t0\t8\t8\t1\n"),
        ("row.txt", "....\n"),
        ("far.yaml", "agents_xy: [[5, 5]]\ntargets_xy: [[0, 1]]\n"),
        ("loop.yaml", "agents_xy: [[0, 0]]\ntargets_xy: [[[0, 1], [7, 0]]]\n"),
        ("pools.yaml", "map: \"....\"\npossible_agents_xy: [[9, 9]]\npossible_targets_xy: [[0, 0]]\n"),
        ("five.yaml", "map_name: 5\n"),
    ];
    let folder = folder(&files);
    let at = folder.path();
    std::fs::write(at.join("latin.txt"), b"..\xe9.").unwrap();
    std::fs::create_dir(at.join("empty")).unwrap();
    let reject = |arguments: &[&str], parts: &[&str]| assert_error(at, arguments, parts);
    reject(&["maps", "show", "nowhere.map"], &["nowhere.map: no such file"]);
    reject(&["maps", "show", "empty"], &["empty", "no map"]);
    reject(&["maps", "show", "latin.txt"], &["latin.txt", "byte 3"]);
    reject(&["maps", "show", "four-room"], &["`four-rooms`"]);
    reject(&["maps", "import", "bad.map"], &["bad.map", "line 5, column 2", "`x`"]);
    reject(&["maps", "import", "bad.yaml"], &["bad.yaml", "line 3, column 4"]);
    reject(&["maps", "import", "two.yaml", "copy.yaml"], &["copy.yaml", "second map named `one`"]);
    reject(&["maps", "export", "two.yaml", "--to", "text"], &["2 maps"]);
    reject(&["maps", "export", "row.txt", "--to", "text", "--scenario", "far.scen"], &["far.scen", "9 rows"]);
    for to in ["text", "scen", "config", "set"] {
        let export = ["maps", "export", "row.txt", "--to", to, "--scenario", "far.yaml"];
        reject(&export, &["far.yaml", "agents_xy", "(5, 5)"]);
    }
    for to in ["map", "zip"] {
        let export = ["maps", "export", "row.txt", "--to", to, "--scenario", "far.scen"];
        reject(&export, &["`--scenario` has no effect with `--to ", "`--to scen` writes those"]);
    }
    reject(&["maps", "stats", "row.txt", "--scenario", "loop.yaml"], &["loop.yaml", "targets_xy", "(7, 0)"]);
    reject(&["maps", "export", "pools.yaml", "--to", "text"], &["possible_agents_xy", "(9, 9)"]);
    reject(&["run", "five.yaml"], &["map_name", "`5`"]);
    reject(&["maps", "tiles", "row.txt", "--side", "3"], &["`3`", "1 row and 4 columns"]);
    reject(&["maps", "stats", "row.txt", "--num-agents", "9", "--seed", "1"], &["`num_agents` is `9`"]);
    reject(&["maps", "stats", "two.yaml", "--scenario", "far.scen"], &["2 maps"]);
    reject(&["maps", "generate", "validation-maze"], &["`validation-mazes`"]);
    reject(&["maps", "generate", "mazes", "--seeds", "3..3"], &["0..128"]);
    reject(&["maps", "generate", "mazes", "--width-min", "99"], &["`--width-min` is `99`", "`99`"]);
    reject(&["maps", "generate", "mazes", "--out", "nowhere/mazes.yaml"], &["nowhere"]);
    reject(&["maps", "list", "("], &["regular expression"]);
    reject(&["run", "--map", "two.yaml"], &["two.yaml", "2 maps"]);
    reject(&["run", "--scenario", "far.scen"], &["--scenario", "map"]);
    assert!(!at.join("nowhere").exists());
    // These errors concern the starts and goals of the scenario, not those of the config.
    std::fs::write(at.join("config.yaml"), "map: '....'\n").unwrap();
    std::fs::write(at.join("twins.yaml"), "agents_xy: [[0, 0], [0, 0]]\ntargets_xy: [[0, 1], [0, 2]]\n")
        .unwrap();
    let twins = ["run", "config.yaml", "--scenario", "twins.yaml"];
    reject(&twins, &["error: twins.yaml: instance: agent 1: start (0, 0) is the start of agent 0"]);
    reject(
        &[&twins[..], &["--on-target", "restart"]].concat(),
        &["error: twins.yaml: `targets_xy` is `one goal per agent`"],
    );
}
