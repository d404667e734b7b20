//! Tests of `pogema plan`, and of planners as policies of `pogema run`.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod program;

use serde_json::Value;

use program::pogema as run;

const TASK: [&str; 6] = ["--map", "four-rooms", "--num-agents", "4", "--seed", "1"];

#[test]
fn every_planner_writes_valid_plans() {
    let folder = tempfile::tempdir().unwrap();
    for planner in ["lacam", "pibt", "pbs", "ecbs", "cbs"] {
        let plan = ["plan", "--planner", planner, "--nodes", "300", "--json", "--out", "plan.txt"];
        let files = ["--result", "result.txt", "--trace", "plan.jsonl"];
        let (text, error, status) = run(folder.path(), &[&plan, files.as_slice(), &TASK].concat());
        assert_eq!((error.as_str(), status), ("", 0), "{planner}");
        let summary: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(summary["outcome"], "solved", "{planner}");
        let [cost, bound] = ["sum_of_costs", "lower_bound"].map(|key| summary[key].as_u64().unwrap());
        assert!(cost >= bound, "{summary}");
        for arguments in [
            [&["validate", "plan.txt"], TASK.as_slice()].concat(),
            vec!["validate", "result.txt", "--map", "four-rooms"],
        ] {
            let (text, error, status) = run(folder.path(), &arguments);
            let costs = format!("sum of costs {}, makespan {}", summary["sum_of_costs"], summary["makespan"]);
            assert!(
                text.starts_with("valid: 4 agents") && text.ends_with(&costs),
                "{planner}: {text}{error}"
            );
            assert_eq!(status, 0);
        }
        // The trace conforms to the rules.
        let (_, error, status) = run(folder.path(), &["conform", "--trace", "plan.jsonl"]);
        assert_eq!((error.as_str(), status), ("", 0), "{planner}");
    }
}

#[test]
fn without_a_plan_the_status_is_one_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("row.txt"), "...\n").unwrap();
    std::fs::write(folder.path().join("swap.yaml"), "agents_xy: [[0,0],[0,2]]\ntargets_xy: [[0,2],[0,0]]\n")
        .unwrap();
    let task = ["--map", "row.txt", "--scenario", "swap.yaml"];
    let (text, _, status) = run(folder.path(), &[&["plan", "--out", "plan.txt"], task.as_slice()].concat());
    assert!(text.starts_with("impossible: "), "{text}");
    assert_eq!(status, 1);
    assert!(!folder.path().join("plan.txt").exists());
    let late = ["plan", "--nodes", "0", "--json"];
    let (text, _, status) = run(folder.path(), &[&late, TASK.as_slice()].concat());
    let summary: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(summary["outcome"], "timed_out");
    assert!(summary["lower_bound"].as_u64() > Some(0), "{summary}");
    assert_eq!(status, 1);
}

#[test]
fn a_result_is_valid_with_the_arguments_that_made_it_or_with_none_if_it_names_its_map() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("random.yaml"), "size: 8\nseed: 3\nnum_agents: 3\n").unwrap();
    let flags = ["--size", "8", "--num-agents", "3", "--seed", "1"];
    for (made, read) in [(&TASK[..], &[][..]), (&["random.yaml"], &["random.yaml"]), (&flags, &flags)] {
        let plan = ["plan", "--nodes", "100", "--result", "result.txt"];
        let (_, error, status) = run(folder.path(), &[&plan, made].concat());
        assert_eq!((error.as_str(), status), ("", 0), "{made:?}");
        let (text, error, status) = run(folder.path(), &[&["validate", "result.txt"], read].concat());
        assert_eq!((error.as_str(), status), ("", 0), "{read:?}: {text}");
    }
}

#[test]
fn every_way_to_set_the_number_of_steps_limits_plans() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("short.yaml"), "max_episode_steps: 3\n").unwrap();
    for limit in [&["--steps", "3"][..], &["--set", "max_episode_steps=3"], &["short.yaml"]] {
        let (text, _, status) =
            run(folder.path(), &[&["plan", "--nodes", "100"], TASK.as_slice(), limit].concat());
        assert!(text.starts_with("impossible: "), "{limit:?}: {text}");
        assert_eq!(status, 1);
    }
}

#[test]
fn planners_play_whole_episodes() {
    let folder = tempfile::tempdir().unwrap();
    for policy in ["lacam", "pibt", "pbs", "ecbs", "cbs"] {
        let arguments = ["run", "--policy", policy, "--nodes", "300", "--json", "--set", "on_target=nothing"];
        let arguments = [&arguments, TASK.as_slice(), &["--collision-system", "soft"]].concat();
        let (text, error, status) = run(folder.path(), &arguments);
        assert_eq!((error.as_str(), status), ("", 0), "{policy}");
        let summary: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(summary["metrics"]["CSR"], 1.0, "{policy}: {summary}");
        assert_eq!(summary["metrics"]["a_collisions"], 0.0, "{policy}: {summary}");
    }
    for policy in ["rhcr", "pibt", "guided-pibt"] {
        let arguments = ["run", "--policy", policy, "--nodes", "300", "--json", "--on-target", "restart"];
        let arguments = [&arguments, TASK.as_slice(), &["--collision-system", "soft"]].concat();
        let (text, error, status) = run(folder.path(), &arguments);
        assert_eq!((error.as_str(), status), ("", 0), "{policy}");
        let summary: Value = serde_json::from_str(&text).unwrap();
        assert!(summary["metrics"]["avg_throughput"].as_f64().unwrap() > 0.2, "{policy}: {summary}");
        assert_eq!(summary["metrics"]["a_collisions"], 0.0, "{policy}: {summary}");
    }
    let with_future_goals =
        ["run", "--policy", "rhcr", "--nodes", "300", "--on-target", "restart", "--future-goals"];
    let with_future_goals = [&with_future_goals, TASK.as_slice(), &["--collision-system", "soft"]].concat();
    let (_, error, status) = run(folder.path(), &with_future_goals);
    assert_eq!((error.as_str(), status), ("", 0));
}

#[test]
fn invalid_arguments_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, part) in [
        (vec!["plan", "--planner", "none"], "invalid value 'none' for '--planner <NAME>'"),
        (vec!["plan", "--seconds", "-1"], "unexpected argument '-1' found"),
        (vec!["plan", "--seconds=-1"], "`--seconds` is `-1`, expected 0 to 1e19 seconds"),
        (vec!["plan", "--seconds", "inf"], "`--seconds` is `inf`, expected 0 to 1e19 seconds"),
        (vec!["plan", "--seconds", "2e19"], "expected 0 to 1e19 seconds"),
        (vec!["plan", "--threads", "1025"], "1025 is not in 1..=1024"),
        (vec!["plan", "--out", "no/such/folder"], "no/such/folder: `no/such`: No such file"),
        (vec!["run", "--policy", "lacam", "--future-goals"], "`lacam` does not support `future_goals`"),
        (
            vec!["run", "--policy", "pibt", "--future-goals", "--on-target", "restart"],
            "expected a planner that uses future goals, such as `rhcr`",
        ),
    ] {
        let (_, error, status) = run(folder.path(), &arguments);
        let is_usage = error.ends_with("For more information, try '--help'.");
        assert_eq!((status, error.lines().count() == 1 || is_usage), (2, true), "{arguments:?}: {error}");
        assert!(error.contains(part), "{arguments:?}: {error}");
    }
}
