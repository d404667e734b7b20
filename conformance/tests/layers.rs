//! Checks the dependencies between the crates, the features of external dependencies, and the licence notices.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use cargo_metadata::{DependencyKind, MetadataCommand};

/// The layer of each crate; a crate may use crates of lower layers only.
const LAYERS: [(&str, u8); 15] = [
    ("pogema-core", 0),
    ("workspace-hack", 0),
    ("pogema-numpy", 0),
    ("pogema-reference", 1),
    ("pogema-fast", 1),
    ("pogema-maps", 1),
    ("pogema-planners", 1),
    ("pogema-policies", 2),
    ("pogema-render", 1),
    ("pogema-conformance", 3),
    ("pogema-toolbox", 3),
    ("pogema", 4),
    ("pogema-cli", 5),
    ("pogema-benches", 5),
    ("pogema-python", 5),
];

#[test]
fn crates_use_lower_layers_only() {
    let layers: BTreeMap<&str, u8> = LAYERS.into_iter().collect();
    let metadata = MetadataCommand::new().no_deps().exec().unwrap();
    for package in &metadata.packages {
        let own =
            layers.get(package.name.as_str()).unwrap_or_else(|| panic!("{} has no layer", package.name));
        for dependency in
            package.dependencies.iter().filter(|dependency| dependency.kind != DependencyKind::Development)
        {
            if let Some(other) = layers.get(dependency.name.as_str()) {
                assert!(other < own, "{} may not use {}", package.name, dependency.name);
            }
        }
    }
    assert_eq!(metadata.packages.len(), LAYERS.len());
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// Returns the lists of features with which a set of packages builds each external dependency: a dependency may be
/// built more than once.
fn features(selection: &[&str]) -> BTreeMap<String, BTreeSet<String>> {
    let root = root();
    let mut command = std::process::Command::new(env!("CARGO"));
    command.args(["tree", "--offline", "--prefix", "none", "--format", "{p}|{f}"]).args(selection);
    let output = command.current_dir(root).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let pairs = text.lines().filter_map(|line| line.trim_end_matches(" (*)").split_once('|'));
    let is_external = |package: &str| !package.contains(&*root.to_string_lossy());
    let mut all = BTreeMap::<String, BTreeSet<String>>::new();
    for (package, features) in pairs.filter(|(package, _)| is_external(package)) {
        all.entry(package.into()).or_default().insert(features.into());
    }
    all
}

/// If the features differ, cargo builds a dependency, and everything that depends on it, a second time. The checks
/// build the program together with its tests, so its features include those of its tests.
#[test]
fn the_program_and_the_wheel_use_the_features_of_the_tests() {
    let tests = features(&["--edges", "all"]);
    let program = features(&["--package", "pogema-cli", "--edges", "all"]);
    let wheel =
        ["--package", "pogema-python", "--features", "pyo3/extension-module", "--edges", "normal,build"];
    for (what, theirs) in [("program", program), ("wheel", features(&wheel))] {
        for (package, features) in theirs {
            let of_tests = tests.get(&package).unwrap_or(&features);
            assert!(
                features.is_subset(of_tests),
                "{package} of the {what} has {features:?}, expected {of_tests:?}: add its features to workspace-hack"
            );
        }
    }
}

/// The licences of all dependencies must accompany the compiled wheel and program.
#[test]
fn the_notices_list_the_dependencies_of_the_wheel_and_the_program() {
    let settings = std::fs::read_to_string(root().join("about.toml")).unwrap();
    let list = settings.split("targets = [").nth(1).unwrap().split(']').next().unwrap();
    let targets: Vec<&str> =
        list.split('"').skip(1).step_by(2).flat_map(|target| ["--target", target]).collect();
    for (package, folder) in [("pogema-python", "python"), ("pogema-cli", "cli")] {
        let selection = [&["--package", package, "--edges", "normal"], &*targets].concat();
        let used = features(&selection).into_keys();
        let used: BTreeSet<String> =
            used.map(|package| package.replace(" (proc-macro)", "").replace(" v", " ")).collect();
        let path = root().join(folder).join("THIRD-PARTY.txt");
        let text = std::fs::read_to_string(&path).unwrap();
        let (above, below) = ("=".repeat(80), "-".repeat(80));
        let lists = text.split(&above).skip(1).map(|section| section.split(&below).next().unwrap());
        let listed: BTreeSet<String> = lists
            .flat_map(|list| list.lines().filter_map(|line| line.strip_prefix("    ")))
            .filter(|package| package.contains(' '))
            .map(String::from)
            .collect();
        let missing: Vec<&String> = used.difference(&listed).collect();
        let surplus: Vec<&String> = listed.difference(&used).collect();
        assert!(
            missing.is_empty() && surplus.is_empty(),
            "{}: {missing:?} are missing, {surplus:?} are not used; run `BLESS=1 ./check notices`",
            path.display()
        );
    }
}
