//! Checks that the JSON test vectors are up to date and follow their schema, and that writing them leaves other files
//! alone.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use pogema_conformance::vectors::{schema, write};
use pogema_conformance::{cases, golden};
use serde_json::Value;

/// The largest size of the folder. Units: bytes.
const MAX_SIZE: usize = 5_000_000;

fn kept() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("vectors")
}

fn read(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

fn names(folder: &Path) -> BTreeSet<PathBuf> {
    let files = golden::files(folder, ".json").unwrap();
    files.iter().map(|path| path.strip_prefix(folder).unwrap().to_owned()).collect()
}

#[test]
fn the_vectors_of_the_repository_are_up_to_date() {
    if std::env::var_os("BLESS").is_some() {
        write(&kept()).unwrap();
    }
    let fresh = tempfile::tempdir().unwrap();
    let written = write(fresh.path()).unwrap();
    assert!(written.num_vectors > written.num_rules);
    assert_eq!(names(&kept()), names(fresh.path()), "run this test with BLESS=1");
    let mut size = 0;
    for name in names(fresh.path()) {
        let text = std::fs::read(fresh.path().join(&name)).unwrap();
        assert!(std::fs::read(kept().join(&name)).unwrap() == text, "{name:?}: run this test with BLESS=1");
        size += text.len();
    }
    assert!(size <= MAX_SIZE, "the vectors have {size} bytes, expected at most {MAX_SIZE}");
}

#[test]
fn every_file_follows_the_schema_and_every_case_has_a_vector() {
    let schema = schema();
    let validator = jsonschema::validator_for(&schema).unwrap();
    let mut vectors = BTreeSet::new();
    let manifest = read(&kept().join("manifest.json"));
    for file in manifest["files"].as_array().unwrap() {
        let rule = read(&kept().join(file["path"].as_str().unwrap()));
        assert!(validator.is_valid(&rule), "{}: {:?}", file["path"], validator.validate(&rule));
        assert_eq!(
            (&rule["rule"], rule["vectors"].as_array().unwrap().len()),
            (&file["rule"], file["num_vectors"].as_u64().unwrap() as usize)
        );
        vectors.extend(
            rule["vectors"]
                .as_array()
                .unwrap()
                .iter()
                .map(|vector| vector["name"].as_str().unwrap().to_owned()),
        );
    }
    for path in golden::files(&cases::folder(), ".yaml").unwrap() {
        let name = path.strip_prefix(cases::folder()).unwrap().with_extension("");
        assert!(vectors.contains(name.to_str().unwrap()), "{name:?}");
    }
    let mut wrong = read(&kept().join("move/actions.json"));
    wrong["vectors"][0]["exchanges"][0]["answer"]["cells"] = "everywhere".into();
    assert!(!validator.is_valid(&wrong));
}

#[test]
fn a_folder_with_other_files_stays_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    for manifest in [
        None,
        Some("{}"),
        Some(
            r#"{"format": "pogema-vectors/1", "spec": "", "version": "", "schema": "", "files": [{"rule": "", "path": "../outside", "num_vectors": 1, "sha256": ""}]}"#,
        ),
    ] {
        std::fs::write(folder.path().join("thesis.tex"), "text").unwrap();
        if let Some(text) = manifest {
            std::fs::write(folder.path().join("manifest.json"), text).unwrap();
        }
        let error = write(folder.path()).unwrap_err().to_string();
        assert!(
            error.ends_with("contains other files, expected a new or empty folder, or a folder of vectors"),
            "{error}"
        );
        assert_eq!(names(folder.path()).len(), usize::from(manifest.is_some()));
        let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).ok();
        assert_eq!(read("thesis.tex").as_deref(), Some("text"));
        assert_eq!(read("manifest.json").as_deref(), manifest);
    }
}

#[test]
fn a_second_write_removes_the_files_that_are_no_longer_written() {
    let folder = tempfile::tempdir().unwrap();
    for name in names(&kept()) {
        let copy = folder.path().join(&name);
        std::fs::create_dir_all(copy.parent().unwrap()).unwrap();
        std::fs::copy(kept().join(&name), copy).unwrap();
    }
    let path = folder.path().join("manifest.json");
    let mut manifest = read(&path);
    manifest["files"][0]["path"] = "gone.json".into();
    std::fs::write(&path, manifest.to_string()).unwrap();
    std::fs::write(folder.path().join("check.py"), "").unwrap();
    // A run that is killed after the deletion and before the new manifest leaves a manifest that lists a missing file.
    for leftover in [Some("{}"), None] {
        std::fs::write(&path, manifest.to_string()).unwrap();
        leftover.map_or(Ok(()), |text| std::fs::write(folder.path().join("gone.json"), text)).unwrap();
        write(folder.path()).unwrap();
        assert_eq!(names(folder.path()), names(&kept()));
    }
    assert!(folder.path().join("check.py").exists());
}
