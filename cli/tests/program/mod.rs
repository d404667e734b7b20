//! The program under test.

#![allow(dead_code, reason = "each test uses a part")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The end of the message about arguments that the program does not accept.
const MORE: &str = "\n\nFor more information, try '--help'.";

/// Returns the command that runs `pogema` in a folder.
pub fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pogema"));
    command.args(arguments).current_dir(folder);
    command
}

/// Runs `pogema` in a folder.
pub fn output(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

/// Runs `pogema` in a folder; returns standard output and standard error without trailing white space, and the exit
/// status.
pub fn pogema(folder: &Path, arguments: &[&str]) -> (String, String, i32) {
    let output = output(folder, arguments);
    let text = |bytes| String::from_utf8(bytes).unwrap().trim_end().to_owned();
    (text(output.stdout), text(output.stderr), output.status.code().unwrap())
}

/// Returns the paths and contents of all files in a folder.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    paths.map(|path| (path.clone(), std::fs::read(path).unwrap())).collect()
}

/// Checks that a run fails with one message and leaves all files of its folder unchanged.
pub fn assert_rejected(folder: &Path, arguments: &[&str], expected: &str) {
    let before = contents(folder);
    let output = output(folder, arguments);
    let error = std::str::from_utf8(&output.stderr).unwrap().strip_suffix('\n').unwrap();
    // Only messages about arguments may have several lines.
    let error = error.strip_suffix(MORE).unwrap_or_else(|| {
        assert_eq!(error.lines().count(), 1, "{arguments:?}");
        error
    });
    assert_eq!(error, format!("error: {expected}"), "{arguments:?}");
    assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{arguments:?}");
    assert!(contents(folder) == before, "{arguments:?}: files have changed");
}
