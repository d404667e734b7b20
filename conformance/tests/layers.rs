//! Who may depend on whom, and where unsafe code may stand.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use cargo_metadata::{DependencyKind, MetadataCommand};
use pogema_conformance::golden;

/// A crate uses lower layers only, never its own.
const LAYERS: [(&str, u8); 13] = [
    ("pogema-core", 0),
    ("workspace-hack", 0),
    ("pogema-numpy", 0),
    ("pogema-reference", 1),
    ("pogema-fast", 1),
    ("pogema-maps", 1),
    ("pogema-planners", 1),
    ("pogema-render", 1),
    ("pogema-conformance", 3),
    ("pogema-toolbox", 3),
    ("pogema", 4),
    ("pogema-benches", 4),
    ("pogema-python", 4),
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

/// Everywhere else the compiler refuses it.
const MAY_BE_UNSAFE: [&str; 1] = ["fast/src/simd/mod.rs"];

#[test]
fn unsafe_code_is_allowed_in_named_modules_only() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let metadata = MetadataCommand::new().no_deps().exec().unwrap();
    let mut allowing = BTreeSet::new();
    for package in &metadata.packages {
        let folder = Path::new(&package.manifest_path).parent().unwrap();
        for path in golden::files(folder, ".rs").unwrap() {
            let local = path.strip_prefix(root).unwrap().display().to_string();
            let is_source = local.split('/').nth(1) == Some("src");
            if is_source && std::fs::read_to_string(&path).unwrap().contains("allow(unsafe_code") {
                allowing.insert(local);
            }
        }
    }
    assert_eq!(allowing, MAY_BE_UNSAFE.into_iter().map(str::to_owned).collect());
}
