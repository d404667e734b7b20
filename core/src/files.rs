//! Bounded file reads, and atomic file writes: a file is written completely or not at all.

use std::fs::File;
use std::io::{BufWriter, Read, Write};
use std::path::Path;

use tempfile::NamedTempFile;

use crate::Error;

/// The prefix of the names of unfinished files. A killed process can leave such files behind.
pub const UNFINISHED: &str = ".pogema-unfinished-";

/// Returns the bytes of a file, or `None` if there are more than `most`.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read.
pub fn read_at_most(path: &Path, most: u64) -> Result<Option<Vec<u8>>, Error> {
    let failed = |error: std::io::Error| Error::io(path, error);
    let mut bytes = Vec::new();
    File::open(path).map_err(failed)?.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(failed)?;
    Ok(Some(bytes).filter(|bytes| bytes.len() as u64 <= most))
}

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

/// Writes two files under temporary names, and then renames both.
///
/// # Errors
/// [`Error::Io`] if a file cannot be written, or if a folder has the name of one. Older files of the same names are
/// then unchanged, unless the system refuses only the second renaming.
pub fn write_both(first: (&Path, &[u8]), second: (&Path, &[u8])) -> Result<(), Error> {
    let unfinished = |(path, bytes): (&Path, &[u8])| {
        if path.is_dir() {
            return Err(Error::io(path, std::io::Error::from(std::io::ErrorKind::IsADirectory)));
        }
        let mut file = temporary_beside(path, "")?;
        file.write_all(bytes).map_err(|error| Error::io(path, error))?;
        Ok(file)
    };
    let files = [(first.0, unfinished(first)?), (second.0, unfinished(second)?)];
    for (path, file) in files {
        file.persist(path).map_err(|error| Error::io(path, error.error))?;
    }
    Ok(())
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
