//! `pogema maps`, and maps in `pogema run`.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Output};

fn pogema(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pogema")).args(arguments).current_dir(folder).output().unwrap()
}

#[track_caller]
fn said(folder: &Path, arguments: &[&str]) -> String {
    let output = pogema(folder, arguments);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {errors}");
    assert_eq!(errors, "", "{arguments:?}");
    String::from_utf8(output.stdout).unwrap()
}

#[track_caller]
fn refused(folder: &Path, arguments: &[&str], parts: &[&str]) {
    let output = pogema(folder, arguments);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {errors}");
    assert_eq!(errors.lines().count(), 1, "{errors}");
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
    let set = said(at, &["maps", "generate", "mazes", "--seeds", "5..8", "--width-min", "9"]);
    assert_eq!(set.matches("\"mazes-seed-").count(), 3);
    said(at, &["maps", "generate", "mazes", "--seeds", "5..8", "--width-min", "9", "--out", "mazes.yaml"]);
    assert_eq!(std::fs::read_to_string(at.join("mazes.yaml")).unwrap(), set);
    assert_eq!(said(at, &["maps", "import", "mazes.yaml"]), set);
    assert!(said(at, &["maps", "list", "mazes-.*", "--maps", "mazes.yaml"]).contains("mazes-seed-6"));
    assert!(said(at, &["maps", "generate", "shelves", "--bays", "toolbox"]).contains('$'));
    assert_eq!(said(at, &["maps", "generate", "warehouse"]).lines().count(), 34);
    let random = ["maps", "generate", "random", "--seeds", "0..2", "--name", "mine", "--width-max", "17"];
    assert!(said(at, &random).starts_with("\"mine-seed-0\": |-\n"));
}

#[test]
fn maps_go_from_format_to_format() {
    let folder = folder(&[("city.map", CITY), ("pair.txt", "a..A\nB..b\n")]);
    let at = folder.path();
    said(at, &["maps", "export", "city.map", "--to", "text", "--out", "city.txt"]);
    assert_eq!(std::fs::read_to_string(at.join("city.txt")).unwrap(), "....\n.##.\n.##.\n#...\n");
    assert_eq!(
        said(at, &["maps", "export", "city.txt", "--to", "map"]),
        CITY.replace('T', "@").replace('S', ".")
    );
    let stripped = said(at, &["maps", "import", "city.map", "--strip-border"]);
    assert_eq!(stripped, "\"city\": |-\n  ##\n  ##\n");
    said(at, &["maps", "export", "city.map", "--to", "zip", "--out", "cities.zip"]);
    assert_eq!(said(at, &["maps", "import", "cities.zip"]), said(at, &["maps", "import", "city.map"]));
    said(at, &["maps", "export", "pair.txt", "--to", "scen", "--out", "pair.scen"]);
    said(at, &["maps", "export", "pair.txt", "--to", "map", "--out", "pair.map"]);
    let config = said(at, &["maps", "export", "pair.map", "--scenario", "pair.scen", "--to", "config"]);
    assert_eq!(config, said(at, &["maps", "export", "pair.txt", "--to", "config"]));
    assert!(config.contains("agents_xy: [[0, 0], [1, 3]]\ntargets_xy: [[0, 3], [1, 0]]\n"), "{config}");
    let back = ["maps", "export", "pair.map", "--scenario", "pair.scen", "--to", "text"];
    assert_eq!(said(at, &back), "a..A\nB..b\n");
    let one = ["maps", "export", "pair.map", "--scenario", "pair.scen", "--to", "text", "--num-agents", "1"];
    assert_eq!(said(at, &one), "a..A\n....\n");
    let tiles = said(at, &["maps", "tiles", "city.map", "--side", "2"]);
    assert_eq!(tiles.matches("\"city_0").count(), 4);
}

#[test]
fn maps_are_shown_and_judged() {
    let folder = folder(&[("pocket.txt", "a.B#.\nA.b#.\n####.\n.....\n"), ("row.txt", "aBbA\n")]);
    let at = folder.path();
    let shown = said(at, &["maps", "show", "row.txt"]);
    assert_eq!(shown, "row: 1 rows, 4 columns, 4 free cells, density 0.000, 1 component\naBbA\n");
    let small = said(at, &["maps", "show", "four-rooms", "--width", "7"]);
    assert_eq!(small.lines().skip(1).map(|line| line.chars().count()).collect::<Vec<_>>(), [7; 4]);
    let turn = said(at, &["maps", "show", "puzzle-square-turn"]);
    assert!(
        turn.ends_with("\n#####  #####\n#ab##  #DA##\n#dc##  #CB##\n#####  #####\n#####  #####\n"),
        "{turn}"
    );
    let judged = said(at, &["maps", "stats", "row.txt"]);
    assert!(judged.contains("unsolvable: agents 0, 1 share a corridor"), "{judged}");
    let judged = said(at, &["maps", "stats", "row.txt", "--on-target", "finish", "--json"]);
    let told: serde_json::Value = serde_json::from_str(&judged).unwrap();
    assert_eq!(told[0]["scenario"]["solvable"], true);
    let placed = said(at, &["maps", "stats", "pocket.txt", "--num-agents", "2", "--seed", "3"]);
    assert!(placed.contains("2 agents, sum of costs at least"), "{placed}");
    assert_eq!(said(at, &["maps", "stats", "puzzle-.*"]).matches("; unsolvable:").count(), 0);
}

#[test]
fn a_seed_chooses_among_maps() {
    let folder = folder(&[("set.yaml", "one: \"a.A\"\ntwo: \"a..A\"\nthree: \"a...A\"\n")]);
    let at = folder.path();
    let cells = |seed: &str| {
        let run = ["run", "--maps", "set.yaml", "--map", "one|t.*", "--seed", seed, "--json"];
        let told: serde_json::Value = serde_json::from_str(&said(at, &run)).unwrap();
        told["config"]["map"][0].as_array().unwrap().len()
    };
    let lengths: BTreeSet<usize> = (0..16).map(|seed| cells(&seed.to_string())).collect();
    assert_eq!(lengths, [3, 4, 5].into());
    std::fs::write(at.join("config.yaml"), "map_name: tw.\nseed: 1\n").unwrap();
    let run = ["run", "config.yaml", "--maps", "set.yaml", "--policy", "astar", "--json"];
    let told: serde_json::Value = serde_json::from_str(&said(at, &run)).unwrap();
    assert_eq!((&told["steps"], &told["metrics"]["CSR"]), (&3.into(), &1.0.into()));
    let puzzle =
        ["run", "--map", "puzzle-full-ring", "--num-agents", "3", "--set", "on_target=nothing", "--json"];
    let told: serde_json::Value = serde_json::from_str(&said(at, &puzzle)).unwrap();
    assert_eq!(told["config"]["num_agents"], 3);
}

#[test]
fn a_scenario_is_cut_to_the_agents_there_are() {
    let yaml = "agents_xy: [[0, 0], [0, 3]]\ntargets_xy: [[[0, 1], [0, 2]], [[0, 2], [0, 3]]]\n";
    let folder = folder(&[("row.txt", "....\n"), ("scenario.yaml", yaml)]);
    let at = folder.path();
    let run = ["run", "--map", "row.txt", "--scenario", "scenario.yaml", "--on-target", "restart", "--json"];
    let told: serde_json::Value = serde_json::from_str(&said(at, &run)).unwrap();
    assert_eq!(told["config"]["num_agents"], 2);
    let one: Vec<&str> = run.into_iter().chain(["--num-agents", "1"]).collect();
    let told: serde_json::Value = serde_json::from_str(&said(at, &one)).unwrap();
    assert_eq!(told["config"]["targets_xy"], serde_json::json!([[[0, 1], [0, 2]]]));
    let config = ["maps", "export", "row.txt", "--scenario", "scenario.yaml", "--to", "config"];
    assert!(said(at, &config).contains("targets_xy: [[[0, 1], [0, 2]], [[0, 2], [0, 3]]]"));
    let lost = ["maps", "export", "row.txt", "--scenario", "scenario.yaml", "--to", "scen"];
    refused(at, &lost, &["sequences"]);
}

#[test]
fn wrong_input_is_told_with_file_and_place() {
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
    let refuse = |arguments: &[&str], parts: &[&str]| refused(at, arguments, parts);
    refuse(&["maps", "show", "nowhere.map"], &["nowhere.map"]);
    refuse(&["maps", "show", "empty"], &["empty", "no map"]);
    refuse(&["maps", "show", "latin.txt"], &["latin.txt", "byte 3"]);
    refuse(&["maps", "show", "four-room"], &["`four-rooms`"]);
    refuse(&["maps", "import", "bad.map"], &["bad.map", "line 5, column 2", "`x`"]);
    refuse(&["maps", "import", "bad.yaml"], &["bad.yaml", "line 3, column 4"]);
    refuse(&["maps", "import", "two.yaml", "copy.yaml"], &["copy.yaml", "second map named `one`"]);
    refuse(&["maps", "export", "two.yaml", "--to", "text"], &["2 maps"]);
    refuse(&["maps", "export", "row.txt", "--to", "text", "--scenario", "far.scen"], &["far.scen", "9 rows"]);
    for to in ["text", "scen", "config", "set"] {
        let export = ["maps", "export", "row.txt", "--to", to, "--scenario", "far.yaml"];
        refuse(&export, &["far.yaml", "agents_xy", "(5, 5)"]);
    }
    refuse(&["maps", "stats", "row.txt", "--scenario", "loop.yaml"], &["loop.yaml", "targets_xy", "(7, 0)"]);
    refuse(&["maps", "export", "pools.yaml", "--to", "text"], &["possible_agents_xy", "(9, 9)"]);
    refuse(&["run", "five.yaml"], &["map_name", "`5`"]);
    refuse(&["maps", "tiles", "row.txt", "--side", "3"], &["`3`", "1 rows and 4 columns"]);
    refuse(&["maps", "stats", "row.txt", "--num-agents", "9", "--seed", "1"], &["num_agents"]);
    refuse(&["maps", "stats", "two.yaml", "--scenario", "far.scen"], &["2 maps"]);
    refuse(&["maps", "generate", "validation-maze"], &["`validation-mazes`"]);
    refuse(&["maps", "generate", "mazes", "--seeds", "3..3"], &["0..128"]);
    refuse(&["maps", "generate", "mazes", "--width-min", "99"], &["width_min", "`99`"]);
    refuse(&["maps", "generate", "mazes", "--out", "nowhere/mazes.yaml"], &["nowhere"]);
    refuse(&["maps", "list", "("], &["regular expression"]);
    refuse(&["run", "--map", "two.yaml"], &["two.yaml", "2 maps"]);
    refuse(&["run", "--scenario", "far.scen"], &["--scenario", "map"]);
    assert!(!at.join("nowhere").exists());
}
