//! Tests of `pogema validate` with valid and invalid plans.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod program;

use std::path::Path;

use program::pogema;

fn run(folder: &Path, arguments: &[&str]) -> (String, String, i32) {
    pogema(folder, &[&["validate"], arguments].concat())
}

/// Returns a folder with a map, a scenario of two agents and the given files.
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let map = "type octile\nheight 3\nwidth 3\nmap\n...\n.@.\n...\n";
    let scenario = "agents_xy: [[0, 0], [0, 2]]\ntargets_xy: [[0, 1], [1, 2]]\n";
    for (name, text) in [("three.map", map), ("two.yaml", scenario)].iter().chain(files) {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

const TASK: [&str; 5] = ["plan.txt", "--map", "three.map", "--scenario", "two.yaml"];

#[test]
fn a_valid_plan_is_reported_with_its_costs() {
    let folder = folder(&[("plan.txt", "0: (0,0) (0,2)\n1: (0,0) (1,2)\n2: (0,1) (1,2)\n")]);
    let (text, _, status) = run(folder.path(), &TASK);
    assert_eq!((text.as_str(), status), ("valid: 2 agents, 2 steps; sum of costs 3, makespan 2", 0));
}

#[test]
fn the_first_conflict_is_reported_and_drawn() {
    let folder = folder(&[("plan.txt", "0: (0,0) (0,2)\n1: (0,1) (0,1)\n")]);
    let (text, _, status) = run(folder.path(), &TASK);
    let expected = "not valid: step 1: agents 0 and 1 are both at (0, 1)\n\n\
        rows 0 to 2, columns 0 to 2; a is agent 0, b is agent 1\n\
        before step 1:\n    a.b\n    .#.\n    ...\nafter it:\n    .X.\n    .#.\n    ...";
    assert_eq!((text.as_str(), status), (expected, 1));
    let json: serde_json::Value = {
        let arguments = [TASK.as_slice(), &["--json"]].concat();
        serde_json::from_str(&run(folder.path(), &arguments).0).unwrap()
    };
    assert_eq!(json["valid"], false);
    assert_eq!(json["conflict"]["agents"], serde_json::json!([0, 1]));
}

#[test]
fn a_config_without_a_number_of_agents_takes_that_of_the_plan() {
    let files = [
        ("plan.txt", "0: (0,0) (0,2)\n1: (0,0) (1,2)\n2: (0,1) (1,2)\n"),
        (
            "null.yaml",
            "num_agents: null\nagents_xy: [[0, 0], [0, 2], [2, 0]]\ntargets_xy: [[0, 1], [1, 2], [2, 1]]\n",
        ),
        (
            "three.yaml",
            "num_agents: 3\nagents_xy: [[0, 0], [0, 2], [2, 0]]\ntargets_xy: [[0, 1], [1, 2], [2, 1]]\n",
        ),
    ];
    let folder = folder(&files);
    let config = |name| run(folder.path(), &["plan.txt", name, "--map", "three.map"]).0;
    assert_eq!(config("null.yaml"), "valid: 2 agents, 2 steps; sum of costs 3, makespan 2");
    assert_eq!(config("three.yaml"), "not valid: the plan has 2 agents, expected 3, the number of starts");
}

#[test]
fn a_plan_longer_than_its_step_limit_is_not_valid() {
    let folder = folder(&[("plan.txt", "0: (0,0) (0,2)\n1: (0,0) (1,2)\n2: (0,1) (1,2)\n3: (0,1) (1,2)\n")]);
    let within = |steps| run(folder.path(), &[TASK.as_slice(), &["--steps", steps]].concat());
    // Idle steps after the last arrival do not count.
    assert_eq!(within("2").2, 0);
    let (text, _, status) = within("1");
    let expected = "not valid: agent 0 arrives in step 2, expected at most step 1\n\n\
        rows 0 to 2, columns 0 to 2; a is agent 0\n\
        before step 1:\n    a.o\n    .#.\n    ...\nafter it:\n    a..\n    .#o\n    ...";
    assert_eq!((text.as_str(), status), (expected, 1));
}

#[test]
fn any_end_accepts_agents_off_their_goals() {
    let folder = folder(&[("plan.txt", "(0,0) (0,2)\n(0,0) (1,2)\n")]);
    let (text, _, status) = run(folder.path(), &TASK);
    assert!(text.starts_with("not valid: agent 0 ends at (0, 0), expected its goal"), "{text}");
    assert_eq!(status, 1);
    assert_eq!(run(folder.path(), &[TASK.as_slice(), &["--any-end"]].concat()).2, 0);
}

#[test]
fn a_result_file_supplies_map_and_agents() {
    let result = "agents=2\nmap_file=maps/three.map\nstarts=(0,0),(2,0),\ngoals=(1,0),(2,1),\n\
        solution=\n0:(0,0),(2,0),\n1:(1,0),(2,1),\n";
    let folder = folder(&[("result.txt", result), ("lost.txt", &result.replace("three", "four"))]);
    let (text, _, status) = run(folder.path(), &["result.txt"]);
    assert_eq!((text.as_str(), status), ("valid: 2 agents, 1 step; sum of costs 2, makespan 1", 0));
    let (_, error, status) = run(folder.path(), &["lost.txt"]);
    let expected =
        "error: lost.txt: map `maps/four.map` not found, expected it next to the plan, or `--map FILE`";
    assert_eq!((error.as_str(), status), (expected, 2));
    assert_eq!(run(folder.path(), &["lost.txt", "--map", "three.map"]).2, 0);
}

#[test]
fn a_plan_is_never_judged_on_another_instance() {
    let result = "map_file=three.map\nstarts=(0,0),(2,0),\ngoals=(1,0),(2,1),\nsolution=\n0:(0,0),(2,0),\n1:(1,0),(2,1),\n";
    let folder = folder(&[
        ("plan.txt", "0: (0,0) (0,2)\n1: (0,1) (1,2)\n"),
        ("result.txt", result),
        ("nowhere.txt", &result.replace("three.map", "")),
        ("empty.txt", &result.replace("three.map", "empty.yaml")),
        ("starts.txt", &result.replace("goals=", "targets=")),
        ("empty.yaml", ""),
        ("other.yaml", "agents_xy: [[0, 0], [0, 2]]\ntargets_xy: [[0, 1], [2, 2]]\n"),
    ]);
    let unknown = "expected the instance of the plan: `--map` with `--scenario`, a config, or the `--seed`";
    let differs = "its starts and goals are not those of the instance that the other arguments name";
    for (arguments, expected) in [
        (&["plan.txt"][..], unknown),
        (&["plan.txt", "--map", "three.map"], unknown),
        (&["nowhere.txt"], unknown),
        (&["empty.txt"], "empty.yaml: no map in this file"),
        (&["starts.txt"], "starts.txt: expected both `starts` and `goals`, or neither"),
        (&["result.txt", "--seed", "1"], differs),
        (&["result.txt", "--map", "three.map", "--scenario", "other.yaml"], differs),
        (&["result.txt", "--num-agents", "3"], "result.txt: the plan has 2 agents, expected 3"),
    ] {
        let (text, error, status) = run(folder.path(), arguments);
        assert!(error.contains(expected), "{arguments:?}: {text}{error}");
        assert_eq!((status, error.lines().count()), (2, 1), "{arguments:?}");
    }
    for arguments in [
        &["result.txt", "--map", "three.map", "--scenario", "two.yaml"][..],
        &["nowhere.txt", "--map", "three.map"],
    ] {
        assert_eq!(run(folder.path(), arguments).2, 0, "{arguments:?}");
    }
}

#[test]
fn a_result_file_with_more_starts_than_agents_is_reported() {
    let result = "map_file=three.map\nstarts=(0,0),(2,0),(2,2),\ngoals=(1,0),(2,1),(1,2),\nsolution=\n0:(0,0),(2,0),\n";
    let folder = folder(&[("result.txt", result)]);
    let (text, _, status) = run(folder.path(), &["result.txt"]);
    assert_eq!(
        (text.as_str(), status),
        ("not valid: the plan has 2 agents, expected 3, the number of starts", 1)
    );
    let json: serde_json::Value =
        serde_json::from_str(&run(folder.path(), &["result.txt", "--json"]).0).unwrap();
    assert_eq!(json["conflict"]["cell"], serde_json::Value::Null);
}

#[test]
fn invalid_plans_are_reported_in_one_line() {
    let folder = folder(&[("plan.txt", "0: (0,0) (0,2)\n1: (0,1) 5\n"), ("short.txt", "0: (0,0)\n")]);
    let error_of = |arguments: &[&str]| {
        let (_, error, status) = run(folder.path(), arguments);
        assert_eq!((status, error.lines().count()), (2, 1), "{error}");
        error
    };
    assert_eq!(error_of(&TASK), "error: plan.txt: line 2: found `5`, expected a cell such as `(3,4)`");
    assert!(error_of(&["none.txt", "--map", "three.map"]).starts_with("error: none.txt: No such file"));
    // A plan for one agent is checked against the scenario truncated to its first agent.
    let short = [&["short.txt"], &TASK[1..]].concat();
    assert!(run(folder.path(), &short).0.starts_with("not valid: agent 0 ends at (0, 0)"));
}
