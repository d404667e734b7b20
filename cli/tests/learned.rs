//! Tests of learned policies in `pogema run`, `evaluate` and `replay`.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod program;

use std::fs;
use std::path::{Path, PathBuf};

use program::pogema;

/// Returns a folder with the suite `descent.yaml` and its network.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let suites = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../suites/policies");
    for name in ["descent.safetensors", "descent.json", "descent.yaml"] {
        fs::copy(suites.join(name), folder.path().join(name)).unwrap();
    }
    folder
}

const RUN: [&str; 7] = ["run", "--size", "12", "--num-agents", "6", "--seed", "1"];

fn run(folder: &Path, more: &[&str]) -> (String, String, i32) {
    pogema(folder, &[&RUN, more].concat())
}

#[test]
fn a_network_plays_and_its_trace_replays() {
    let folder = folder();
    let learned = ["--policy", "network", "--weights", "descent.safetensors", "--trace", "trace.jsonl"];
    let (summary, error, status) = run(folder.path(), &learned);
    assert_eq!((error.as_str(), status), ("", 0));
    assert_eq!(run(folder.path(), &learned).0, summary);
    let replayed = run(folder.path(), &["--policy", "file", "--actions", "trace.jsonl"]);
    assert_eq!(replayed, (summary.clone(), String::new(), 0));
    let other_seed = [&learned[..4], &["--planner-seed", "1"]].concat();
    assert_ne!(run(folder.path(), &other_seed).0, summary);
}

#[test]
fn policies_with_weights_in_the_program_need_no_file() {
    let folder = folder();
    for policy in [
        "aswitcher",
        "epom",
        "follower",
        "follower-large",
        "follower-small",
        "ippo",
        "iql",
        "mappo",
        "qmix",
        "qplex",
        "vdn",
    ] {
        let (summary, error, status) = run(folder.path(), &["--policy", policy]);
        assert_eq!((error.as_str(), status), ("", 0));
        let (other, error, status) =
            run(folder.path(), &["--policy", policy, "--weights", "descent.safetensors"]);
        assert_eq!((error.as_str(), status), ("", 0));
        assert_ne!(other, summary);
    }
    // The network of LSwitcher has different outputs from the other networks, so no other file fits.
    let (switcher, error, status) = run(folder.path(), &["--policy", "lswitcher"]);
    assert_eq!((error.as_str(), status), ("", 0));
    assert_ne!(switcher, run(folder.path(), &["--policy", "aswitcher"]).0);
    let suite = fs::read_to_string(folder.path().join("descent.yaml")).unwrap();
    let suite = suite.replace("{name: network, weights: descent.safetensors}", "{name: QMIX}");
    fs::write(folder.path().join("shipped.yaml"), suite).unwrap();
    let (_, error, status) = pogema(folder.path(), &["evaluate", "shipped.yaml", "--out", "out"]);
    assert_eq!(status, 0, "{error}");
    let (_, error, status) = pogema(folder.path(), &["replay", "out", "Descent", "2"]);
    assert_eq!(status, 0, "{error}");
    assert!(!error.contains("differ"), "{error}");
}

#[test]
fn wrong_input_is_reported_in_one_line() {
    let folder = folder();
    fs::write(folder.path().join("text.safetensors"), "weights").unwrap();
    fs::copy(folder.path().join("descent.json"), folder.path().join("text.json")).unwrap();
    let json = fs::read_to_string(folder.path().join("descent.json")).unwrap();
    let copy = |name: &str, json: String| {
        fs::copy(
            folder.path().join("descent.safetensors"),
            folder.path().join(format!("{name}.safetensors")),
        )
        .unwrap();
        fs::write(folder.path().join(format!("{name}.json")), json).unwrap();
    };
    copy("wide", json.replace("\"radius\": 1", "\"radius\": 2"));
    copy("blind", json.lines().filter(|line| !line.contains("encoder")).collect());
    let cases: [(&[&str], &str); 8] = [
        (&["--policy", "mats-lp"], "`--policy mats-lp` needs `--weights FILE`"),
        (
            &["--policy", "astar", "--weights", "descent.safetensors"],
            "`--weights` needs a learned policy: `--policy` with one of aswitcher, epom, follower, follower-large, \
             follower-small, ippo, iql, lswitcher, mappo, mats-lp, network, qmix, qplex, vdn",
        ),
        (
            &["--mask-actions"],
            "`--mask-actions` needs a learned policy: `--policy` with one of aswitcher, epom, follower, \
             follower-large, follower-small, ippo, iql, lswitcher, mappo, mats-lp, network, qmix, qplex, vdn",
        ),
        (
            &["--policy", "network", "--weights", "none.safetensors"],
            "none.safetensors: No such file or directory (os error 2)",
        ),
        (
            &["--policy", "network", "--weights", "text.safetensors"],
            "text.safetensors: not a safetensors file: ",
        ),
        (
            &["--policy", "network", "--weights", "wide.safetensors"],
            "wide.safetensors: the encoder writes windows of shape [1, 5, 5] and 0 scalars, the network expects \
             [1, 3, 3] and 0",
        ),
        (
            &["--policy", "network", "--weights", "blind.safetensors"],
            "blind.safetensors: the network names no encoder, expected `encoder` in its JSON file",
        ),
        (
            &["--policy", "network", "--weights", "descent.safetensors", "--future-goals"],
            "`network` does not support `future_goals`; only lifelong planners do",
        ),
    ];
    for (arguments, expected) in cases {
        let (text, error, status) = run(folder.path(), &[arguments, &["--trace", "out.jsonl"]].concat());
        assert_eq!((text.as_str(), status), ("", 2), "{arguments:?}: {error}");
        assert!(error.starts_with(&format!("error: {expected}")), "{arguments:?}: {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
        assert!(!folder.path().join("out.jsonl").exists());
    }
}

/// Writes a network for MATS-LP whose action preferences depend on what its window shows. If `value` is given, the
/// network has a critic.
fn write_search_network(folder: &Path, name: &str, value: Option<&str>) {
    let layers = [Some(("a", 5)), value.map(|value| (value, 1))].into_iter().flatten();
    let (mut header, mut data) = (serde_json::Map::new(), Vec::new());
    for (layer, outputs) in layers {
        for (end, shape) in [("weight", vec![outputs, 18]), ("bias", vec![outputs])] {
            let len: usize = shape.iter().product();
            let begin = data.len();
            data.extend((0..len).flat_map(|index| ((index * 7 % 11) as f32 / 11.0).to_le_bytes()));
            let offsets = [begin, data.len()];
            let entry = serde_json::json!({"dtype": "F32", "shape": shape, "data_offsets": offsets});
            header.insert(format!("{layer}.{end}"), entry);
        }
    }
    let header = serde_json::Value::Object(header).to_string();
    let bytes = [&(header.len() as u64).to_le_bytes(), header.as_bytes(), &data].concat();
    fs::write(folder.join(format!("{name}.safetensors")), bytes).unwrap();
    let architecture =
        serde_json::json!({"window": [2, 3, 3], "layers": ["flatten"], "actions": "a", "value": value});
    let config = serde_json::json!({"version": 1, "architecture": architecture});
    fs::write(folder.join(format!("{name}.json")), config.to_string()).unwrap();
}

#[test]
fn a_search_takes_its_settings_from_flags() {
    let folder = folder();
    write_search_network(folder.path(), "critic", Some("v"));
    write_search_network(folder.path(), "no-critic", None);
    let search = |flags: &[&str]| run(folder.path(), &[&["--policy", "mats-lp"], flags].concat());
    let critic = ["--weights", "critic.safetensors"];
    let (few, error, status) = search(&[&critic[..], &["--expansions", "2"]].concat());
    assert_eq!((error.as_str(), status), ("", 0));
    let (many, error, status) = search(&[&critic[..], &["--expansions", "40"]].concat());
    assert_eq!((error.as_str(), status), ("", 0));
    assert_ne!(few, many);
    let (as_in_paper, error, status) =
        search(&[&critic[..], &["--expansions", "40", "--faithful", "false"]].concat());
    assert_eq!((error.as_str(), status), ("", 0));
    assert_ne!(as_in_paper, many);
    for (flags, expected) in [
        (
            &["--weights", "no-critic.safetensors", "--faithful", "false"][..],
            "`--faithful` is `false`, expected true",
        ),
        (
            &["--weights", "critic.safetensors", "--expansions", "0"],
            "`--expansions` is `0`, expected 1 to 100000",
        ),
        (&["--weights", "critic.safetensors", "--faithful", "maybe"], "invalid value 'maybe'"),
        (&["--policy", "qmix", "--expansions", "9"], "the policy has no tree search; only `mats-lp` has"),
        (&["--policy", "astar", "--faithful", "true"], "`--faithful` needs a learned policy"),
        (
            &["--policy", "qmix", "--nodes", "9"],
            "`--nodes` needs a planner: `--policy` with one of lacam, pibt",
        ),
        (&["--policy", "astar", "--seconds", "9"], "`--seconds` needs a planner: `--policy` with one of"),
    ] {
        let flags = if flags.contains(&"--policy") {
            flags.to_vec()
        } else {
            [&["--policy", "mats-lp"], flags].concat()
        };
        let (text, error, status) = run(folder.path(), &flags);
        assert_eq!((text.as_str(), status), ("", 2), "{flags:?}: {error}");
        assert!(error.contains(expected), "{flags:?}: {error}");
    }
}

#[test]
fn results_replay_and_are_the_same_for_any_number_of_threads() {
    let folder = folder();
    let suite = fs::read_to_string(folder.path().join("descent.yaml")).unwrap();
    let shipped = ["aswitcher", "epom", "follower", "lswitcher", "qmix"];
    let added = shipped.map(|name| format!("  {name}: {{name: {name}}}\n")).concat();
    let suite = suite.replace("algorithms:\n", &format!("algorithms:\n{added}"));
    fs::write(folder.path().join("descent.yaml"), suite).unwrap();
    let results: Vec<Vec<String>> = ["1", "2", "8"]
        .map(|threads| {
            let (_, error, status) = pogema(
                folder.path(),
                &["evaluate", "descent.yaml", "--out", threads, "--threads", threads, "--html"],
            );
            assert_eq!(status, 0, "{error}");
            let rows = |name: &&str| {
                let rows =
                    fs::read_to_string(folder.path().join(threads).join(format!("{name}.json"))).unwrap();
                // Run times differ.
                let is_time = |line: &&str| line.contains("runtime") || line.contains("network_time");
                rows.lines().filter(|line| !is_time(line)).collect::<Vec<_>>().join("\n")
            };
            ["Descent", "Greedy"].iter().chain(&shipped).map(rows).collect()
        })
        .into();
    assert!(results.iter().all(|result| *result == results[0]), "{results:#?}");
    assert_ne!(results[0][0], results[0][1]);
    let (text, error, status) = pogema(folder.path(), &["views", "1"]);
    assert_eq!(status, 0, "{error}");
    assert!(text.contains("Descent") && text.contains("Network Time (seconds)"), "{text}");
    for (name, has_network) in [("Descent", true), ("Random", false)] {
        let path = folder.path().join("1").join(format!("{name}.episodes.json"));
        let episodes: Vec<serde_json::Value> = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
        for episode in episodes {
            let network = episode["network_seconds"].as_f64();
            assert_eq!(network.is_some(), has_network);
            assert!(network.is_none_or(|time| time > 0.0 && time < episode["seconds"].as_f64().unwrap()));
        }
    }
    let replay = ["replay", "1", "Descent", "2", "--trace", "replay.jsonl"];
    let (_, error, status) = pogema(folder.path(), &replay);
    assert_eq!(status, 0, "{error}");
    assert!(!error.contains("differ"), "{error}");
}

#[test]
fn errors_of_wrong_suites_name_file_line_and_key() {
    let folder = folder();
    let suite = fs::read_to_string(folder.path().join("descent.yaml")).unwrap();
    let descent = "{name: network, weights: descent.safetensors}";
    let line = suite.lines().position(|line| line.contains(descent)).unwrap() + 1;
    let cases = [
        ("{name: network}", "`Descent.weights` is missing, expected the path of a network"),
        ("{name: network, weights: 3}", "`Descent.weights` is `3`, expected the path of a network"),
        (
            "{name: network, weights: descent.safetensors, sampling: best}",
            "`Descent.sampling` is `best`, expected one of `softmax`, `follower`, `greedy`",
        ),
        ("{name: random, weights: descent.safetensors}", "`Descent.weights`: `random` has no network"),
        ("{name: astar, nodes: 100}", "`Descent.nodes`: `astar` is not a planner, so it has no budget"),
        ("{name: qmix, seconds: 2}", "`Descent.seconds`: `qmix` is not a planner, so it has no budget"),
        (
            "{name: lacam, future_goals: true}",
            "`Descent.future_goals` is `true`, expected false, because only a lifelong planner uses it",
        ),
        (
            "{name: rhcr, single_attempt: true}",
            "`Descent.single_attempt` is `true`, expected false, because only a one-shot planner uses it",
        ),
        (
            "{name: network, weight: descent.safetensors}",
            "unknown parameter `Descent.weight`; did you mean `weights`?",
        ),
    ];
    for (algorithm, expected) in cases {
        fs::write(folder.path().join("wrong.yaml"), suite.replace(descent, algorithm)).unwrap();
        let (_, error, status) = pogema(folder.path(), &["evaluate", "wrong.yaml", "--out", "out"]);
        assert_eq!((error, status), (format!("error: wrong.yaml: line {line}: {expected}"), 2));
        assert!(!folder.path().join("out").exists());
    }
}

#[test]
fn a_run_with_other_weights_is_not_continued() {
    let folder = folder();
    let evaluate = || pogema(folder.path(), &["evaluate", "descent.yaml", "--out", "out", "--resume"]);
    assert_eq!(evaluate().2, 0);
    let expected = "error: out: has results of algorithms whose weights have changed: `Descent`, `Greedy`; choose \
                    another folder, or delete `Descent.*`, `Greedy.*` and play again";
    for name in ["descent.safetensors", "descent.json"] {
        let path = folder.path().join(name);
        let original = fs::read(&path).unwrap();
        let mut changed = original.clone();
        // Changes a bit of the last weight, or adds a line break to the JSON file.
        *changed.last_mut().unwrap() ^= 2;
        fs::write(&path, if name.ends_with("json") { [&original[..], b"\n"].concat() } else { changed })
            .unwrap();
        let before = fs::read(folder.path().join("out/about.json")).unwrap();
        let (_, error, status) = evaluate();
        assert_eq!((error.as_str(), status), (expected, 2), "{name}");
        assert_eq!(fs::read(folder.path().join("out/about.json")).unwrap(), before);
        fs::write(&path, original).unwrap();
        assert_eq!(evaluate().2, 0);
    }
    // Deletes the files that the message names.
    let weights = folder.path().join("descent.safetensors");
    let mut changed = fs::read(&weights).unwrap();
    *changed.last_mut().unwrap() ^= 2;
    fs::write(&weights, changed).unwrap();
    assert_eq!(evaluate().2, 2);
    for name in ["Descent.json", "Descent.episodes.json", "Greedy.json", "Greedy.episodes.json"] {
        fs::remove_file(folder.path().join("out").join(name)).unwrap();
    }
    let (text, error, status) = evaluate();
    assert!(text.contains("episodes played; all results are complete"), "{text}{error}");
    assert_eq!(status, 0);
    // Results of earlier releases do not name their weights.
    let about = folder.path().join("out/about.json");
    let mut manifest: serde_json::Value = serde_json::from_slice(&fs::read(&about).unwrap()).unwrap();
    assert!(manifest.as_object_mut().unwrap().remove("weights").is_some());
    fs::write(&about, manifest.to_string()).unwrap();
    assert_eq!(evaluate().2, 0);
}
