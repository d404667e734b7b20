//! Recordings of POGEMA 1.4.0, kept on disk as compressed JSON lines.

use std::io::BufRead;
use std::path::{Path, PathBuf};

use pogema_core::Error;
use serde::{Deserialize, Serialize};

use crate::request::{Request, Response};

/// A request and POGEMA's answer to it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GoldenRecording {
    /// What was asked.
    pub request: Request,
    /// What POGEMA 1.4.0 answered.
    pub response: Response,
}

/// The recordings that come with this crate.
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/pogema-1.4.0")
}

/// Every mismatch that was ever seen, in the same form, with the right answer.
pub fn found_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("found")
}

/// The files of a folder with an ending, in the order of their names.
///
/// # Errors
/// [`Error::Io`] if the folder cannot be read.
pub fn files(folder: &Path, ending: &str) -> Result<Vec<PathBuf>, Error> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).map_err(|error| Error::io(&folder, error))? {
            let path = entry.map_err(|error| Error::io(&folder, error))?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.to_string_lossy().ends_with(ending) {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

/// The recordings of a folder.
///
/// # Errors
/// [`Error::Io`] if the folder cannot be read.
pub fn recording_files(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut found = files(folder, ".jsonl")?;
    found.extend(files(folder, ".jsonl.zst")?);
    Ok(found)
}

/// Reads the recordings of one file, compressed if its name ends in `.zst`.
///
/// # Errors
/// [`Error::Io`] with the line that cannot be read.
pub fn read(path: &Path) -> Result<Vec<GoldenRecording>, Error> {
    let mut recordings = Vec::new();
    for (index, line) in crate::files::open(path)?.lines().enumerate() {
        let line = line.map_err(|error| Error::io(path, error))?;
        let recording = serde_json::from_str(&line)
            .map_err(|error| Error::io(path, format!("line {}: {error}", index + 1)))?;
        recordings.push(recording);
    }
    Ok(recordings)
}

/// Writes recordings to a file, whole or not at all, compressed if its name ends in `.zst`.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written.
pub fn write(path: &Path, recordings: &[GoldenRecording]) -> Result<(), Error> {
    let mut text = Vec::new();
    for recording in recordings {
        serde_json::to_writer(&mut text, recording).map_err(|error| Error::io(path, error))?;
        text.push(b'\n');
    }
    crate::files::write(path, &text)
}
