//! Atomic file writes: a file is written completely or not at all.

use std::io::{BufWriter, Write};
use std::path::Path;

use tempfile::NamedTempFile;

use crate::Error;

/// The prefix of the names of unfinished files. A killed process can leave such files behind.
pub const UNFINISHED: &str = ".pogema-unfinished-";

/// Creates a temporary file in the folder of `path`, to be renamed to `path` later. Its name ends with `suffix`.
///
/// # Errors
/// [`Error::Io`] if the file cannot be created.
pub fn temporary_beside(path: &Path, suffix: &str) -> Result<NamedTempFile, Error> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED).suffix(suffix);
    // By default only the owner can read a temporary file. The finished file gets the permissions of the umask.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder).map_err(|error| Error::io(path, error))
}

/// Writes a file under a temporary name and renames it.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written. An older file of the same name is then unchanged.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    write_with(path, |file| file.write_all(bytes).map_err(|error| Error::io(path, error)))
}

/// Calls a function that writes a file under a temporary name, and then renames the file.
///
/// # Errors
/// Those of the function, and [`Error::Io`] if the file cannot be written. An older file of the same name is then
/// unchanged.
pub fn write_with(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<(), Error>) -> Result<(), Error> {
    let failed = |error: std::io::Error| Error::io(path, error);
    let mut file = BufWriter::new(temporary_beside(path, "")?);
    write(&mut file)?;
    let file = file.into_inner().map_err(|error| failed(error.into_error()))?;
    file.persist(path).map(|_| ()).map_err(|error| failed(error.error))
}
