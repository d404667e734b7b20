//! Writing a file replaces regular files only, and follows symbolic links.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::os::unix::net::UnixListener;
use std::path::Path;

use pogema_core::Error;
use pogema_core::files::{write_both, write_whole};

/// Returns the names in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let name = |entry: Result<fs::DirEntry, _>| entry.unwrap().file_name().into_string().unwrap();
    let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(name).collect();
    names.sort();
    names
}

#[test]
fn a_link_stays_and_its_target_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("sub")).unwrap();
    fs::write(at("target"), "old").unwrap();
    symlink("../target", at("sub/link")).unwrap();
    symlink("sub/link", at("second")).unwrap();
    symlink("missing", at("dangling")).unwrap();
    write_whole(&at("sub/link"), b"one").unwrap();
    assert_eq!(fs::read_to_string(at("target")).unwrap(), "one");
    write_both((&at("second"), b"two"), (&at("dangling"), b"three")).unwrap();
    assert_eq!(fs::read_to_string(at("target")).unwrap(), "two");
    assert_eq!(fs::read_to_string(at("missing")).unwrap(), "three");
    for link in ["sub/link", "second", "dangling"] {
        assert!(at(link).is_symlink(), "{link}");
    }
    assert_eq!(names(folder.path()), ["dangling", "missing", "second", "sub", "target"]);
}

#[test]
fn a_replaced_file_keeps_its_permissions() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file");
    for mode in [0o600, 0o644] {
        fs::write(&path, "old").unwrap();
        fs::set_permissions(&path, PermissionsExt::from_mode(mode)).unwrap();
        write_whole(&path, b"new").unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, mode);
    }
}

#[test]
fn only_regular_files_are_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("folder")).unwrap();
    let _socket = UnixListener::bind(at("socket")).unwrap();
    symlink("socket", at("to_socket")).unwrap();
    symlink("circle", at("circle")).unwrap();
    fs::write(at("file"), "old").unwrap();
    let before = names(folder.path());
    for name in ["folder", "socket", "to_socket"] {
        let expected = Err(Error::io(at(name), "is not a regular file"));
        assert_eq!(write_whole(&at(name), b"new"), expected);
        assert_eq!(write_both((&at("file"), b"new"), (&at(name), b"new")), expected);
    }
    for name in ["circle", "file/below", "nowhere/file"] {
        assert!(write_whole(&at(name), b"new").is_err(), "{name}");
    }
    assert_eq!(fs::read_to_string(at("file")).unwrap(), "old");
    assert_eq!(names(folder.path()), before);
}
