//! Files that are written whole or not at all.

use std::io::Write;
use std::path::Path;

use tempfile::NamedTempFile;

use crate::Error;

/// The beginning of the name of a file that is still being written, and of what a killed process leaves behind.
pub const UNFINISHED: &str = ".pogema-unfinished-";

/// Makes a temporary file in the folder of a path, to be renamed to it; its name ends with `suffix`.
///
/// # Errors
/// [`Error::Io`] if the folder takes no file.
pub fn temporary_beside(path: &Path, suffix: &str) -> Result<NamedTempFile, Error> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED).suffix(suffix);
    // By default only the owner may read a temporary file; the finished file has the rights that the umask leaves.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder).map_err(|error| Error::io(path, error))
}

/// Writes a file under a temporary name and renames it.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written; an older file of the name is then still there.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let failed = |error: std::io::Error| Error::io(path, error);
    let mut file = temporary_beside(path, "")?;
    file.write_all(bytes).map_err(failed)?;
    file.persist(path).map(|_| ()).map_err(|error| failed(error.error))
}
