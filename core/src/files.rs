//! Bounded file reads, and atomic file writes: a file is written completely or not at all.

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use tempfile::TempPath;

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

/// Returns the bytes of a file.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, or has more than `most` bytes.
pub fn read_within(path: &Path, most: u64) -> Result<Vec<u8>, Error> {
    let reason = || format!("the file is larger than {} MiB, the maximum", most >> 20);
    read_at_most(path, most)?.ok_or_else(|| Error::io(path, reason()))
}

/// Returns the path of the file that a write to `path` replaces: the target of a symbolic link, otherwise `path`.
///
/// # Errors
/// [`Error::Io`] if `path` exists and is not a regular file, because replacing it would destroy a pipe or a device, or
/// if its metadata cannot be read.
pub fn place_of(path: &Path) -> Result<PathBuf, Error> {
    /// The number of links that Linux follows.
    const MAX_LINKS: usize = 40;
    match std::fs::metadata(path) {
        Ok(there) if !there.is_file() => return Err(Error::io(path, "is not a regular file")),
        Err(error) if !matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            return Err(Error::io(path, error));
        }
        _ => {}
    }
    let mut place = path.to_owned();
    for _ in 0..MAX_LINKS {
        let Ok(target) = place.read_link() else { break };
        place = folder_of(&place).join(target);
    }
    if place.file_name().is_none() { Err(Error::io(path, "is not a regular file")) } else { Ok(place) }
}

/// Returns the folder of a file, `.` for a name without a folder.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A file under a temporary name, which replaces the file at its path when it is complete.
#[derive(Debug)]
pub struct Unfinished {
    /// The path in messages.
    path: PathBuf,
    place: PathBuf,
    temporary: TempPath,
}

impl Unfinished {
    /// Creates the temporary file beside the file that it will replace. Also returns the handle of the temporary file,
    /// whose name ends with `suffix`.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be created, or if `path` exists and is not a regular file.
    pub fn new(path: &Path, suffix: &str) -> Result<(Self, File), Error> {
        let place = place_of(path)?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(UNFINISHED).suffix(suffix);
        // By default, only the owner can read a temporary file; here it gets the permissions of any new file.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let created = builder.tempfile_in(folder_of(&place)).map_err(|error| Error::io(path, error))?;
        let (file, temporary) = created.into_parts();
        Ok((Self { path: path.to_owned(), place, temporary }, file))
    }

    /// Returns the temporary name.
    pub fn temporary(&self) -> &Path {
        &self.temporary
    }

    /// Renames the file to its final path. If it replaces an older file, it takes over the permissions of that file.
    ///
    /// # Errors
    /// [`Error::Io`] if the system refuses it. An older file is then unchanged.
    pub fn finish(self) -> Result<(), Error> {
        let failed = |error: std::io::Error| Error::io(&self.path, error);
        #[cfg(unix)]
        if let Ok(older) = std::fs::metadata(&self.place) {
            std::fs::set_permissions(&self.temporary, older.permissions()).map_err(failed)?;
        }
        self.temporary.persist(&self.place).map_err(|error| failed(error.error))
    }
}

/// Writes a file under a temporary name and renames it. A symbolic link stays, and its target is replaced.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written, or if `path` exists and is not a regular file. An older file is then
/// unchanged.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    write_with(path, |file| file.write_all(bytes).map_err(|error| Error::io(path, error)))
}

/// Writes two files as [`write_whole`] does, and renames both when both are complete.
///
/// # Errors
/// Those of [`write_whole`]. Older files are then unchanged, unless the system refuses only the second renaming.
pub fn write_both(first: (&Path, &[u8]), second: (&Path, &[u8])) -> Result<(), Error> {
    let written = |(path, bytes): (&Path, &[u8])| {
        let (unfinished, mut file) = Unfinished::new(path, "")?;
        file.write_all(bytes).map_err(|error| Error::io(path, error))?;
        Ok(unfinished)
    };
    let (first, second) = (written(first)?, written(second)?);
    first.finish()?;
    second.finish()
}

/// Calls a function that writes a file; otherwise works like [`write_whole`].
///
/// # Errors
/// Those of the function and of [`write_whole`]. An older file is then unchanged.
pub fn write_with(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<(), Error>) -> Result<(), Error> {
    let (unfinished, file) = Unfinished::new(path, "")?;
    let mut file = BufWriter::new(file);
    write(&mut file)?;
    file.into_inner().map_err(|error| Error::io(path, error.into_error()))?;
    unfinished.finish()
}
