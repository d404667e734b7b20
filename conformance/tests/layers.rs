//! Who may depend on whom.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeMap;

use cargo_metadata::{DependencyKind, MetadataCommand};

/// A crate uses lower layers only, never its own.
const LAYERS: [(&str, u8); 8] = [
    ("pogema-core", 0),
    ("pogema-reference", 1),
    ("pogema-fast", 1),
    ("pogema-maps", 1),
    ("pogema-planners", 1),
    ("pogema-conformance", 2),
    ("pogema", 3),
    ("pogema-benches", 3),
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
