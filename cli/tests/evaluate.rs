//! Tests of `pogema evaluate`: complete runs, interrupted runs, and wrong input.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod program;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use program::pogema as run;

const PROGRAM: &str = env!("CARGO_BIN_EXE_pogema");

fn folder_with(suite: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("suite.yaml"), suite).unwrap();
    folder
}

const EVALUATE: [&str; 4] = ["evaluate", "suite.yaml", "--out", "out"];
const RESUME: [&str; 5] = ["evaluate", "suite.yaml", "--out", "out", "--resume"];

const SUITE: &str = "
environment:
  name: Environment
  on_target: nothing
  collision_system: soft
  max_episode_steps: 128
  obs_radius: 5
  size: 16
  density: 0.2
  seed: {grid_search: [3, 1, 2]}
  num_agents: {grid_search: [4, 8]}
algorithms:
  Dice: {name: random}
  LaCAM: {name: LaCAM, nodes: 500, num_process: 2, parallel_backend: balanced_dask, device: cpu}
  A star: {name: \"A*\"}
";

fn read(folder: &Path, name: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join("out").join(name)).unwrap()).unwrap()
}

#[test]
fn results_follow_the_order_of_the_suite() {
    let folder = folder_with(SUITE);
    let (text, error, status) = run(folder.path(), &EVALUATE);
    assert_eq!((text.as_str(), status), ("18 episodes played; all results are complete: out", 0), "{error}");
    for algorithm in ["Dice", "LaCAM", "A star"] {
        let rows = read(folder.path(), &format!("{algorithm}.json"));
        let rows = rows.as_array().unwrap();
        let order = rows.iter().map(|row| {
            let varied = &row["env_grid_search"];
            (varied["seed"].as_u64().unwrap(), varied["num_agents"].as_u64().unwrap())
        });
        assert_eq!(order.collect::<Vec<_>>(), [(3, 4), (3, 8), (1, 4), (1, 8), (2, 4), (2, 8)]);
        assert!(rows.iter().all(|row| row["algorithm"] == algorithm));
        let episodes = read(folder.path(), &format!("{algorithm}.episodes.json"));
        for (index, episode) in episodes.as_array().unwrap().iter().enumerate() {
            assert_eq!(episode["episode"], index);
            assert_eq!(episode["seed"], rows[index]["env_grid_search"]["seed"]);
            assert_eq!(episode["config"]["num_agents"], rows[index]["env_grid_search"]["num_agents"]);
            assert_eq!(episode["config"]["size"], 16);
            assert!(episode["seconds"].as_f64().is_some_and(|seconds| seconds >= 0.0));
            assert_eq!(episode["run"], 0);
        }
        assert_eq!(episodes.as_array().unwrap().len(), rows.len());
        assert!(!folder.path().join(format!("out/{algorithm}.jsonl")).exists());
    }
    // The metrics equal those of the same episodes played one by one on the reference.
    for (index, seed, num_agents) in [(1, "3", "8"), (4, "2", "4")] {
        for (algorithm, policy) in [("Dice", "random"), ("A star", "astar")] {
            let settings = ["--seed", seed, "--num-agents", num_agents, "--size", "16", "--density", "0.2"];
            let rules = ["--on-target", "nothing", "--collision-system", "soft", "--steps", "128"];
            let policy = ["run", "--json", "--obs-radius", "5", "--policy", policy];
            let (text, ..) = run(folder.path(), &[policy.as_slice(), &settings, &rules].concat());
            let summary: Value = serde_json::from_str(&text).unwrap();
            let rows = read(folder.path(), &format!("{algorithm}.json"));
            let numbers = |metrics: &Value| -> BTreeMap<String, Option<f64>> {
                let all = metrics.as_object().unwrap().iter();
                all.map(|(name, value)| (name.clone(), value.as_f64())).collect()
            };
            assert_eq!(numbers(&rows[index]["metrics"]), numbers(&summary["metrics"]), "{algorithm} {index}");
        }
    }
}

/// Returns all files of the results, except those that record durations or the run that played each episode.
fn bytes(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(folder.join("out")).unwrap();
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let name = |path: &Path| path.file_name().unwrap().to_str().unwrap().to_owned();
    files.retain(|path| !name(path).ends_with(".episodes.json") && name(path) != "about.json");
    files.iter().map(|path| (name(path), fs::read(path).unwrap())).collect()
}

/// Returns the size of the episode lines written so far.
fn num_bytes(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder.join("out")).into_iter().flatten().flatten();
    let lines = entries.filter(|entry| entry.file_name().to_string_lossy().ends_with(".jsonl"));
    lines.filter_map(|entry| entry.metadata().ok()).map(|metadata| metadata.len()).sum()
}

#[test]
fn a_killed_and_resumed_run_gives_the_same_bytes() {
    // Enough episodes that the run is killed before it has played them all, even on a fast machine.
    let seeds: Vec<u32> = (0..200).collect();
    let suite = SUITE.replace("[3, 1, 2]", &format!("{seeds:?}"));
    let (whole, broken) = (folder_with(&suite), folder_with(&suite));
    assert_eq!(run(whole.path(), &EVALUATE).2, 0);
    let expected_bytes = bytes(whole.path());
    let is_whole = || broken.path().join("out/A star.json").exists();
    let mut num_killed = 0;
    for attempt in 0..100 {
        let command = if broken.path().join("out/about.json").exists() { &RESUME[..] } else { &EVALUATE };
        let mut child = Command::new(PROGRAM);
        child.args(command).current_dir(broken.path()).stdout(Stdio::null()).stderr(Stdio::null());
        let before = num_bytes(broken.path());
        let mut child = child.spawn().unwrap();
        // Kill the early runs after a delay that grows with each attempt. Kill the others only after they have written
        // something. This covers all stages of a run on machines of any speed.
        let is_early = attempt < 20;
        while !is_early && num_bytes(broken.path()) == before && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_micros(200));
        }
        std::thread::sleep(if is_early {
            Duration::from_micros(150 * attempt)
        } else {
            Duration::from_millis(attempt % 9)
        });
        child.kill().unwrap();
        num_killed += usize::from(!child.wait().unwrap().success());
        if is_whole() {
            break;
        }
    }
    assert!(num_killed > 2, "the run was killed only {num_killed} times");
    let (text, error, status) = run(broken.path(), &RESUME);
    assert_eq!(status, 0, "{text}{error}");
    assert!(
        bytes(broken.path()) == expected_bytes,
        "the files differ from those of the uninterrupted run, expected {} files",
        expected_bytes.len()
    );
}

/// A limit on the size of files stops a write in the middle, like a full disk.
#[cfg(unix)]
#[test]
fn a_full_disk_loses_no_episode() {
    let (whole, full) = (folder_with(SUITE), folder_with(SUITE));
    assert_eq!(run(whole.path(), &EVALUATE).2, 0);
    // The file of episode lines reaches this limit, a kilobyte, after some episodes.
    let mut limited = Command::new("bash");
    limited.args(["-c", "trap '' XFSZ; ulimit -f 1; exec \"$0\" \"$@\"", PROGRAM]).args(EVALUATE);
    let output = limited.current_dir(full.path()).output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert!(error.contains("Dice.jsonl: File too large"), "{error}");
    let lines = fs::read_to_string(full.path().join("out/Dice.jsonl")).unwrap();
    assert!((1..6).contains(&lines.lines().count()) && lines.ends_with('\n'), "{lines}");
    let (text, error, status) = run(full.path(), &RESUME);
    assert_eq!(status, 0, "{text}{error}");
    assert_eq!(bytes(full.path()), bytes(whole.path()));
}

#[test]
fn the_episode_of_a_torn_last_line_is_played_again_and_other_damage_is_reported() {
    let folder = folder_with(SUITE);
    assert_eq!(run(folder.path(), &EVALUATE).2, 0);
    let expected_bytes = bytes(folder.path());
    let path = |name: &str| folder.path().join("out").join(name);
    fs::remove_file(path("Dice.json")).unwrap();
    let line = r#"{"index":2,"metrics":{"ISR":0.5},"runtime":0.25}"#;
    fs::write(path("Dice.jsonl"), format!("{line}\n{}", &line[..20])).unwrap();
    let (text, ..) = run(folder.path(), &RESUME);
    assert!(text.starts_with("5 episodes played; all results are complete"), "{text}");
    let rows = read(folder.path(), "Dice.json");
    assert_eq!(rows[2]["metrics"], serde_json::json!({"ISR": 0.5}), "a stored episode is not played again");
    for (text, expected) in [
        (format!("{line}\n{line}\n"), "Dice.jsonl: line 2: duplicate episode `2`, first in line 1"),
        (line.replace('2', "9") + "\n", "Dice.jsonl: line 1: episode `9`, expected one below 6"),
        (format!("{line}\nnonsense\n"), "Dice.jsonl: line 2: expected"),
        (line.replace("runtime", "runtme") + "\n", "Dice.jsonl: line 1: unknown field `runtme`"),
    ] {
        fs::remove_file(path("Dice.json")).ok();
        fs::write(path("Dice.jsonl"), &text).unwrap();
        let (_, error, status) = run(folder.path(), &RESUME);
        assert!(error.contains(expected), "{error}");
        assert_eq!((status, fs::read_to_string(path("Dice.jsonl")).unwrap()), (2, text));
    }
    assert_eq!(run(folder.path(), &[&EVALUATE[..], &["--force"]].concat()).2, 0);
    assert_eq!(bytes(folder.path()), expected_bytes);
}

#[test]
fn a_wrong_view_is_rejected_before_play() {
    let folder =
        folder_with(&format!("{SUITE}\nresults_views:\n  Costs: {{type: plot, x: num_agents, z: SoC}}\n"));
    let (_, error, status) = run(folder.path(), &EVALUATE);
    assert!(error.contains("suite.yaml: line 18: unknown key `z` in view `Costs`"), "{error}");
    assert_eq!((status, folder.path().join("out").exists()), (2, false));
}

#[test]
fn a_folder_with_foreign_files_is_left_unchanged() {
    let folder = folder_with(SUITE);
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("letter.json"), "{}").unwrap();
    for more in [&[][..], &["--force"], &["--resume"]] {
        let (_, error, status) = run(folder.path(), &[&EVALUATE, more].concat());
        assert!(error.contains("holds `letter.json`, which no evaluation wrote"), "{error}");
        assert_eq!((status, fs::read_to_string(out.join("letter.json")).unwrap().as_str()), (2, "{}"));
        assert_eq!(
            fs::read_dir(&out).unwrap().count(),
            1,
            "a rejected run leaves nothing, not even its lock"
        );
    }
}

#[test]
fn a_changed_suite_is_not_resumed() {
    let folder = folder_with(SUITE);
    let out = folder.path().join("out");
    assert_eq!(run(folder.path(), &EVALUATE).2, 0);
    let before = bytes(folder.path());
    let (_, error, _) = run(folder.path(), &EVALUATE);
    assert!(error.contains("`--resume` continues them, `--force` deletes them"), "{error}");
    for (from, to, expected) in [
        ("density: 0.2", "density: 0.3", "results for environments that differ"),
        (
            "nodes: 500",
            "nodes: 400",
            "whose parameters have changed: `LaCAM`; choose another folder, or delete `LaCAM.*`",
        ),
    ] {
        fs::write(folder.path().join("suite.yaml"), SUITE.replace(from, to)).unwrap();
        let (_, error, status) = run(folder.path(), &RESUME);
        assert!(error.contains(expected), "{error}");
        assert_eq!((status, bytes(folder.path())), (2, before.clone()));
    }
    // Algorithms may be added; the results of removed ones stay.
    let changed = SUITE.replace("  A star: {name: \"A*\"}\n", "  Idle: {name: stay}\n");
    fs::write(folder.path().join("suite.yaml"), changed).unwrap();
    let (text, error, _) = run(folder.path(), &RESUME);
    assert!(text.starts_with("6 episodes played"), "{text}{error}");
    assert!(out.join("A star.json").exists() && out.join("Idle.json").exists());
}

#[test]
fn a_failed_episode_is_reported_and_the_run_continues() {
    let suite = SUITE.replace("num_agents: {grid_search: [4, 8]}", "num_agents: {grid_search: [4, 200]}");
    let folder = folder_with(&suite.replace("size: 16", "size: 14").replace("density: 0.2", "density: 0"));
    let (_, error, status) = run(folder.path(), &EVALUATE);
    assert_eq!(status, 2);
    assert!(
        error.contains("9 episodes could not be played") && error.contains("LaCAM.failed.jsonl"),
        "{error}"
    );
    let lines = fs::read_to_string(folder.path().join("out/Dice.failed.jsonl")).unwrap();
    for line in lines.lines() {
        let failed: Value = serde_json::from_str(line).unwrap();
        assert_eq!(
            (&failed["env_grid_search"]["num_agents"], &failed["config"]["num_agents"]),
            (&200.into(), &200.into())
        );
        assert!(
            failed["config"]["seed"].is_u64() && failed["error"].as_str().unwrap().contains("agents"),
            "{line}"
        );
    }
    assert_eq!(lines.lines().count(), 3);
    assert_eq!(fs::read_to_string(folder.path().join("out/Dice.jsonl")).unwrap().lines().count(), 3);
    // The page fails as well, but the error still names the cause.
    let (_, error, status) = run(folder.path(), &[&RESUME[..], &["--html"]].concat());
    assert!(error.contains("9 episodes could not be played"), "{error}");
    assert_eq!(status, 2);
}

#[test]
fn errors_in_a_suite_are_reported_with_line_numbers() {
    let folder = folder_with("");
    for (from, to, expected) in [
        (
            "  size: 16",
            "  sise: 16",
            "suite.yaml: line 8: unknown key `sise` in environment; did you mean `size`?",
        ),
        ("nodes: 500", "nods: 500", "unknown parameter `LaCAM.nods`; did you mean `nodes`?"),
        (
            "nodes: 500",
            "nodes: many",
            "line 14: `LaCAM.nodes` is `many`, expected a whole number of 0 or more",
        ),
        ("{name: random}", "{name: SCRIMP}", "line 13: `Dice.name`: `SCRIMP` is not built in"),
        ("{name: random}", "{nam: random}", "line 13: `Dice` lacks the field `name`"),
        ("balanced_dask", "cloud", "`LaCAM.parallel_backend` is `cloud`, expected one of sequential"),
        (
            "num_process: 2",
            "num_process: 0",
            "`LaCAM.num_process` is `0`, expected a whole number of 1 or more",
        ),
        ("  Dice:", "  about:", "line 13: `about`, expected a name that is valid for a file of results"),
        ("  Dice:", "  a/b:", "line 13: `a/b`, expected a name that is valid for a file of results"),
        ("  Dice:", "  About:", "line 13: `About`, expected a name that is valid for a file of results"),
        ("  Dice:", "  LaCAM.failed:", "`LaCAM.failed`, expected a name that is valid for a file of results"),
        (
            "  Dice:",
            "  lacam:",
            "line 14: `LaCAM`, expected a name that differs from `lacam` in more than case: file systems may ignore case",
        ),
        (
            "size: 16",
            "map_name: four-rooms\n  use_maps: false",
            "config: `map_name` is `four-rooms`, expected no name with `use_maps: false`",
        ),
        ("[3, 1, 2]", "[]", "expected at least one value of each varied field"),
        ("[3, 1, 2]", "[3, -1]", "line 10: config: `seed` is `-1`, expected a whole number of 0 or more"),
        ("seed: {grid_search: [3, 1, 2]}", "size: 4", "duplicate key `size`"),
        ("density: 0.2", "density: {grid_search: [0.1, 2]}", "line 9: config: `density`"),
        (
            "size: 16",
            "map_name: {grid_search: [wall-e, wall-f, four-rooms]}",
            "`map_name`: 2 unknown maps: `wall-e`, `wall-f`; expected names or patterns of known maps",
        ),
        ("size: 16", "map_name: four-room", "did you mean `four-rooms`?"),
        ("name: Environment", "name: MyEnv", "line 3: config: `name` is `MyEnv`, expected `Environment`"),
        ("algorithms:", "algorithm:", "unknown key `algorithm` in the file; did you mean `algorithms`?"),
    ] {
        assert!(SUITE.contains(from), "{from}");
        fs::write(folder.path().join("suite.yaml"), SUITE.replacen(from, to, 1)).unwrap();
        let (_, error, status) = run(folder.path(), &EVALUATE);
        assert!(error.contains(expected), "{to}: {error}");
        assert_eq!((error.lines().count(), status), (1, 2), "{error}");
        assert!(!folder.path().join("out").exists(), "{to}");
    }
}

#[test]
fn algorithms_from_another_file_replace_those_of_the_suite() {
    let folder = folder_with(SUITE);
    let path = |name: &str| folder.path().join(name);
    let quick =
        "algorithms:\n  Quick: {name: LaCAM, nodes: 100, single_attempt: true}\n  Dice: {name: random}\n";
    fs::write(path("quick.yaml"), quick).unwrap();
    let replaced =
        |more: &[&str]| run(folder.path(), &[&EVALUATE[..], &["--algorithms", "quick.yaml"], more].concat());
    let (text, error, _) = replaced(&[]);
    assert!(text.starts_with("12 episodes played; all results are complete"), "{text}{error}");
    assert_eq!(fs::read_to_string(path("out/suite.yaml")).unwrap(), SUITE);
    assert_eq!(fs::read_to_string(path("out/algorithms.yaml")).unwrap(), quick);
    assert!(!path("out/LaCAM.json").exists());
    // The lower bound is in the file of episodes and not among the metrics.
    let (rows, episodes) = (read(folder.path(), "Quick.json"), read(folder.path(), "Quick.episodes.json"));
    for (row, episode) in rows.as_array().unwrap().iter().zip(episodes.as_array().unwrap()) {
        assert!(row["metrics"].get("lower_bound").is_none());
        assert!(episode["lower_bound"].as_u64().unwrap() <= row["metrics"]["SoC"].as_u64().unwrap());
    }
    assert!(read(folder.path(), "Dice.episodes.json")[0].get("lower_bound").is_none());
    let (text, notes, status) = run(folder.path(), &["replay", "out", "Quick", "1"]);
    assert_eq!((notes.as_str(), status), ("", 0), "{text}");
    for (from, to, expected) in [
        (
            "nodes: 100",
            "nodes: 200",
            "whose parameters have changed: `Quick`; choose another folder, or delete `Quick.*`",
        ),
        ("nodes", "nods", "quick.yaml: line 2: unknown parameter `Quick.nods`; did you mean `nodes`?"),
        ("{name: LaCAM", "{nam: LaCAM", "quick.yaml: line 2: `Quick` lacks the field `name`"),
        ("true", "often", "quick.yaml: line 2: `Quick.single_attempt` is `often`, expected true or false"),
        (
            "algorithms:",
            "algorithm:",
            "quick.yaml: line 2: unknown key `algorithm` in the file; did you mean",
        ),
        ("algorithms:", "maps: x\nalgorithms:", "quick.yaml: line 1: unknown key `maps` in the file"),
    ] {
        fs::write(path("quick.yaml"), quick.replacen(from, to, 1)).unwrap();
        let (_, error, status) = replaced(&["--resume"]);
        assert!(error.contains(expected), "{to}: {error}");
        assert_eq!((error.lines().count(), status), (1, 2), "{error}");
    }
    // The suite's own algorithms are added to the existing results.
    let (text, error, _) = run(folder.path(), &RESUME);
    assert!(text.starts_with("12 episodes played; all results are complete"), "{text}{error}");
    assert!(path("out/Quick.json").exists() && !path("out/algorithms.yaml").exists());
}

#[test]
fn only_one_shot_planners_accept_a_single_attempt() {
    let folder = folder_with(&SUITE.replace("{name: random}", "{name: random, single_attempt: true}"));
    let (_, error, status) = run(folder.path(), &EVALUATE);
    assert!(
        error.contains(
            "`Dice.single_attempt` is `true`, expected false, because only a one-shot planner uses it"
        ),
        "{error}"
    );
    assert_eq!((status, folder.path().join("out").exists()), (2, false));
    let cbs = "{name: cbs, nodes: 1, single_attempt: true}";
    let folder = folder_with(&SUITE.replace("{name: random}", cbs).replace("[3, 1, 2]", "[3]"));
    assert_eq!(run(folder.path(), &EVALUATE).2, 0);
    let (rows, episodes) = (read(folder.path(), "Dice.json"), read(folder.path(), "Dice.episodes.json"));
    assert_eq!(rows[1]["metrics"]["ISR"], 0.0, "without a plan, agents stay where they are");
    assert!(episodes[1]["lower_bound"].as_u64().unwrap() > 0);
}

#[test]
fn results_on_changed_maps_are_not_continued() {
    let suite = "environment: {name: Environment, map_name: two, seed: {grid_search: [0, 1]}, max_episode_steps: 8}\n\
        algorithms: {Random: {name: random}}\n";
    let folder = folder_with(suite);
    let write_map =
        |map: &str| fs::write(folder.path().join("maps.yaml"), format!("two: |\n  {map}\n")).unwrap();
    write_map("aA.\n  Bb.");
    assert_eq!(run(folder.path(), &EVALUATE).2, 0);
    // The number of agents is that of the map.
    let episodes = read(folder.path(), "Random.episodes.json");
    assert_eq!(
        (&episodes[1]["config"]["num_agents"], &episodes[1]["config"]["map_name"]),
        (&2.into(), &"two".into())
    );
    let before = bytes(folder.path());
    write_map("aA#\n  Bb.");
    let (_, error, status) = run(folder.path(), &RESUME);
    assert!(error.contains("has results on maps or scenarios that have changed: `two`"), "{error}");
    assert_eq!((status, bytes(folder.path())), (2, before));
    write_map("aA.\n  Bb.");
    assert_eq!(run(folder.path(), &RESUME).2, 0);
}

#[test]
fn a_report_replaces_neither_results_nor_the_suite() {
    let folder = folder_with(&SUITE.replace("[3, 1, 2]", "[3]").replace("[4, 8]", "[4]"));
    let evaluate = |path: &str| run(folder.path(), &[&EVALUATE[..], &["--force", "--html", path]].concat());
    for (path, expected) in [
        ("suite.yaml", "`--html` would overwrite `suite.yaml`, which the command reads"),
        ("out/about.json", "out/about.json: is in the folder of the results"),
        ("./out/Dice.json", "is in the folder of the results, expected a name that ends in `.html`"),
    ] {
        let (_, error, status) = evaluate(path);
        assert!(error.contains(expected), "{path}: {error}");
        assert_eq!((status, folder.path().join("out").exists()), (2, false), "{path}");
    }
    // The folder is made by this run.
    assert_eq!(evaluate("out/page.html").2, 0);
    assert!(folder.path().join("out/page.html").exists());
}

#[test]
fn a_damaged_manifest_is_reported_with_a_remedy() {
    let folder = folder_with(SUITE);
    fs::create_dir(folder.path().join("out")).unwrap();
    fs::write(folder.path().join("out/about.json"), "").unwrap();
    let (_, error, status) = run(folder.path(), &[&EVALUATE[..], &["--force"]].concat());
    assert!(error.contains("about.json: EOF while parsing"), "{error}");
    assert!(error.ends_with("choose another folder, or delete this one"), "{error}");
    assert_eq!((status, error.lines().count()), (2, 1));
}

#[test]
fn the_maps_of_the_paper_are_known_by_name() {
    let suite = SUITE.replace(
        "size: 16",
        "map_name: {grid_search: [validation-mazes-seed-000, 'validation-random-seed-(00[1-3])']}",
    );
    let suite = suite.replace("density: 0.2", "use_maps: true").replace("[3, 1, 2]", "[5]");
    let folder = folder_with(&suite);
    let (text, error, status) = run(folder.path(), &EVALUATE);
    assert_eq!((status, error.as_str()), (0, ""), "{text}");
    let rows = read(folder.path(), "LaCAM.json");
    assert_eq!(rows[2]["env_grid_search"]["map_name"], "validation-random-seed-(00[1-3])");
}

#[test]
fn an_unknown_simd_path_is_rejected_before_the_first_episode() {
    let folder = folder_with(SUITE);
    let output = program::command(folder.path(), &EVALUATE).env("POGEMA_SIMD", "bogus").output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), error.lines().count()), (Some(2), 1), "{error}");
    assert!(error.contains("`POGEMA_SIMD` is `bogus`, expected `scalar`"), "{error}");
    assert!(!folder.path().join("out").exists());
}
