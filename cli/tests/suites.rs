//! Tests of the script that writes the page of results, on a few steps of each set.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const SETS: [&str; 6] =
    ["01-random", "02-mazes", "03-warehouse", "04-movingai", "05-puzzles", "06-pathfinding"];

/// Writes small maps under the names of the maps that the program does not contain.
fn write_maps(folder: &Path) {
    let open = "  ........................\n";
    let maps = [
        ("Berlin_1_256_00", open.repeat(20)),
        ("Berlin_1_256", open.repeat(4)),
        ("puzzle-00", open.repeat(2)),
    ];
    let maps = maps.map(|(name, rows)| format!("{name}: |-\n{rows}"));
    fs::write(folder.join("maps.yaml"), maps.concat()).unwrap();
}

/// Writes published means of QMIX that are all 0.5.
fn write_means(folder: &Path) {
    let mut text = "setting,dataset,algorithm,num_agents,ISR,avg_throughput\n".to_owned();
    for (set, num_agents) in SETS.into_iter().zip([8, 8, 32, 64, 2, 1]) {
        writeln!(text, "MAPF,{set},QMIX,{num_agents},0.5,\nLMAPF,{set},QMIX,{num_agents},,0.5").unwrap();
    }
    fs::write(folder.join("published.csv"), text).unwrap();
}

/// Returns all files of the results of a setting. They hold the number of the run and the duration of each episode.
fn results(setting: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let paths = |folder: &Path| fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let all = paths(setting).flat_map(|folder| paths(&folder).collect::<Vec<_>>());
    all.map(|path| (path.clone(), fs::read(path).unwrap())).collect()
}

#[test]
fn all_suites_play_and_the_page_of_results_is_written() {
    let folder = tempfile::tempdir().unwrap();
    write_maps(folder.path());
    write_means(folder.path());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../suites/run");
    let run = || {
        let mut command = Command::new("bash");
        command.arg(&script).arg("--quick").args(["maps.yaml", "published.csv", "out"]);
        command.current_dir(folder.path()).env("POGEMA", env!("CARGO_BIN_EXE_pogema"));
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        fs::read_to_string(folder.path().join("out/page/results.md")).unwrap()
    };
    let page = run();
    for set in SETS {
        assert_eq!(page.matches(&format!("### {set}\n")).count(), 2, "{set}");
    }
    let planners = ["LaCAM", "RHCR", "PIBT", "Guided PIBT", "AStar"];
    let learned = [
        "Follower",
        "Follower-small",
        "Follower-large",
        "EPOM",
        "ASwitcher",
        "LSwitcher",
        "IQL",
        "VDN",
        "QMIX",
        "QPLEX",
        "IPPO",
        "MAPPO",
    ];
    for algorithm in planners.into_iter().chain(learned) {
        assert!(page.contains(&format!("| {algorithm}")), "{algorithm}: {page}");
    }
    let heads =
        page.lines().filter(|line| line.starts_with("| Folder") && line.ends_with("| agents |   QMIX |"));
    assert_eq!(heads.count(), 2, "{page}");
    let pictures = page.lines().filter_map(|line| line.strip_prefix("![")?.split_once("](results/"));
    let files: Vec<_> = pictures.map(|(_, file)| file.trim_end_matches(')')).collect();
    for file in &files {
        assert!(folder.path().join("out/page/results").join(file).exists(), "{file}");
    }
    assert!(files.len() > 10 && page.matches("![").count() == files.len(), "{page}");
    let all = || ["mapf", "lmapf"].map(|setting| results(&folder.path().join("out").join(setting)));
    let before = all();
    assert!(before.iter().all(|results| results.keys().any(|path| path.ends_with("QMIX.episodes.json"))));
    let again = run();
    assert!(all() == before, "the second run has played episodes again");
    assert_eq!(again, page);
}
