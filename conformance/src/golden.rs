//! Recordings of POGEMA 1.4.0, kept on disk as compressed JSON lines.

use std::io::BufRead;
use std::path::{Path, PathBuf};

use pogema_core::Error;
use serde::{Deserialize, Serialize};

use crate::data;
use crate::request::{Request, Response};

/// A request and POGEMA's answer to it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GoldenRecording {
    /// The request.
    pub request: Request,
    /// The answer of POGEMA 1.4.0.
    pub response: Response,
}

/// Returns the folder of the recordings: in this crate or, in a release, next to the program.
pub fn folder() -> PathBuf {
    data::folder("golden/pogema-1.4.0")
}

/// Returns the folder of all mismatches found so far, in the format of the recordings, with the right answers.
pub fn found_folder() -> PathBuf {
    data::folder("found")
}

/// Returns the files under a folder whose names end in `ending`, sorted by path.
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

/// Returns the files of recordings under a folder.
///
/// # Errors
/// [`Error::Io`] if the folder cannot be read.
pub fn recording_files(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut found = files(folder, ".jsonl")?;
    found.extend(files(folder, ".jsonl.zst")?);
    Ok(found)
}

/// Reads the recordings of one file; decompresses it if its name ends in `.zst`.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, or with the number of the line if a line is not a recording.
pub fn read(path: &Path) -> Result<Vec<GoldenRecording>, Error> {
    lines(path)?.iter().enumerate().map(|(index, line)| parse(path, index, line)).collect()
}

/// Reads the lines of one file, each of which [`parse`] turns into a recording.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read.
pub fn lines(path: &Path) -> Result<Vec<String>, Error> {
    crate::files::open(path)?.lines().map(|line| line.map_err(|error| Error::io(path, error))).collect()
}

/// Reads the recording of one line of a file. Lines are counted from 0.
///
/// # Errors
/// [`Error::Io`] with the number of the line, counted from 1.
pub fn parse(path: &Path, index: usize, line: &str) -> Result<GoldenRecording, Error> {
    serde_json::from_str(line).map_err(|error| Error::io(path, format!("line {}: {error}", index + 1)))
}

/// Writes recordings to a file atomically; compresses it if its name ends in `.zst`.
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
