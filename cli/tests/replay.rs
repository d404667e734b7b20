//! Tests of `pogema replay` and of the page of `pogema evaluate --html`.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod program;

use std::fs;

use serde_json::Value;

use program::pogema as run;

const SUITE: &str = "
maps: own.map
environment:
  name: Environment
  on_target: restart
  collision_system: soft
  max_episode_steps: 32
  map_name: own
  seed: {grid_search: [1, 2]}
  num_agents: {grid_search: [2, 3]}
algorithms:
  RHCR: {name: RHCR, nodes: 100}
  Dice: {name: random}
";

const MAP: &str = "type octile\nheight 4\nwidth 6\nmap\n......\n.@@.@.\n.@..@.\n......\n";

fn evaluated(more: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("suites")).unwrap();
    fs::write(folder.path().join("suites/small.yaml"), SUITE).unwrap();
    fs::write(folder.path().join("suites/own.map"), MAP).unwrap();
    let (text, error, status) =
        run(folder.path(), &[&["evaluate", "suites/small.yaml", "--out", "out"], more].concat());
    assert_eq!(status, 0, "{text}{error}");
    folder
}

#[test]
fn an_episode_is_replayed_by_its_number() {
    let folder = evaluated(&[]);
    let rows: Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("out/RHCR.json")).unwrap()).unwrap();
    let (text, error, status) =
        run(folder.path(), &["replay", "out", "RHCR", "3", "--trace", "t.jsonl", "--svg", "t.svg"]);
    assert_eq!((status, error.as_str()), (0, ""), "{text}");
    let throughput = rows[3]["metrics"]["avg_throughput"].as_f64().unwrap();
    assert!(throughput > 0.0 && text.contains(&format!("avg_throughput={throughput:.4}")[..20]), "{text}");
    let trace = fs::read_to_string(folder.path().join("t.jsonl")).unwrap();
    assert_eq!(trace.lines().count(), 3 + 32, "a header, the start, all steps and the end");
    assert!(fs::read_to_string(folder.path().join("t.svg")).unwrap().starts_with("<svg"));
    let (_, error, status) = run(folder.path(), &["render", "t.jsonl", "--png", "t.png"]);
    assert_eq!(status, 0, "{error}");
    // `replay` works from another folder: the results name the folder of the suite, which holds its maps.
    let (_, error, status) = run(&folder.path().join("out"), &["replay", ".", "Dice", "0"]);
    assert_eq!((status, error.as_str()), (0, ""));
}

#[test]
fn differences_from_the_results_are_reported() {
    let folder = evaluated(&[]);
    let path = folder.path().join("out/Dice.json");
    let text = fs::read_to_string(&path).unwrap();
    let at = text.find("\"a_collisions\":").unwrap();
    fs::write(&path, format!("{}\"a_collisions\":9{}", &text[..at], &text[at + 15..])).unwrap();
    let (_, error, status) = run(folder.path(), &["replay", "out", "Dice", "0"]);
    assert_eq!(status, 0);
    assert!(error.starts_with("note: the replay differs from the results: a_collisions "), "{error}");
    fs::write(&path, &text[..40]).unwrap();
    let (_, error, _) = run(folder.path(), &["replay", "out", "Dice", "0"]);
    assert!(
        error.starts_with("note: cannot compare the replay with the results: out/Dice.json: expected a list"),
        "{error}"
    );
    fs::remove_file(&path).unwrap();
    let (_, error, _) = run(folder.path(), &["replay", "out", "Dice", "0"]);
    assert_eq!(error, "note: cannot compare the replay with the results: `Dice` is not finished");
}

#[test]
fn invalid_requests_are_reported() {
    let folder = evaluated(&[]);
    for (arguments, expected) in [
        (
            ["replay", "out", "RHCE", "0"],
            "`algorithm` is `RHCE`, expected one of the suite's algorithms: RHCR, Dice",
        ),
        (["replay", "out", "RHCR", "4"], "`episode` is `4`, expected below 4"),
        (["replay", "suites", "RHCR", "0"], "suites: holds no results of `pogema evaluate`"),
    ] {
        let (text, error, status) = run(folder.path(), &arguments);
        assert!(error.contains(expected), "{error}");
        assert_eq!((text.as_str(), error.lines().count(), status), ("", 1, 2));
    }
}

#[test]
fn the_page_is_self_contained() {
    let folder = evaluated(&["--html"]);
    let page = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    for place in ["http:", "https:", "src=\"/", "@import", "url("] {
        assert!(!page.contains(place), "{place}");
    }
    assert_eq!(
        page.matches("data-replay=").count(),
        2 * 6,
        "the three worst and three best episodes of each algorithm"
    );
    assert!(page.contains("RHCR, nodes: 100") && page.contains("map_name: own"));
    assert!(page.contains("frame-src blob:") && !page.contains("unsafe-"));
    // A page of existing results, in another place; no episode is played.
    let again = ["evaluate", "suites/small.yaml", "--out", "out", "--resume", "--html", "page.html"];
    let (text, error, status) = run(folder.path(), &again);
    assert!(text.starts_with("0 episodes played") && error.ends_with("wrote page.html"), "{text}{error}");
    assert_eq!((status, fs::read_to_string(folder.path().join("page.html")).unwrap()), (0, page));
    // A page that cannot be written is reported before any episode is played.
    let nowhere = ["evaluate", "suites/small.yaml", "--out", "new", "--html", "no/page.html"];
    let (_, error, status) = run(folder.path(), &nowhere);
    assert!(error.contains("no/page.html: `no`: No such file"), "{error}");
    assert_eq!((status, folder.path().join("new").exists()), (2, false));
}
