//! The program under test.

use std::path::Path;
use std::process::Command;

/// Runs `pogema` in a folder; returns standard output and standard error without trailing white space, and the exit
/// status.
pub fn pogema(folder: &Path, arguments: &[&str]) -> (String, String, i32) {
    let program = env!("CARGO_BIN_EXE_pogema");
    let output = Command::new(program).args(arguments).current_dir(folder).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap().trim_end().to_owned();
    (text(output.stdout), text(output.stderr), output.status.code().unwrap())
}
