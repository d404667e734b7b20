//! Files of text, compressed where their name says so, written whole or not at all.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;

use pogema_core::Error;

/// Opens a text, decompressing it if its name ends in `.zst`.
///
/// # Errors
/// [`Error::Io`] if the file cannot be opened.
pub fn open(path: &Path) -> Result<Box<dyn BufRead>, Error> {
    let file = std::fs::File::open(path).map_err(|error| Error::io(path, error))?;
    let input: Box<dyn Read> = if is_compressed(path) {
        Box::new(zstd::Decoder::new(file).map_err(|error| Error::io(path, error))?)
    } else {
        Box::new(file)
    };
    Ok(Box::new(BufReader::new(input)))
}

/// Writes a text under a temporary name and renames it, compressing it if its name ends in `.zst`.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written; a file that was there before is then still there.
pub fn write(path: &Path, text: &[u8]) -> Result<(), Error> {
    let failed = |error: std::io::Error| Error::io(path, error);
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    // A temporary file is its owner's alone by default; what it becomes is for everybody the umask lets.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder).map_err(failed)?;
    if is_compressed(path) {
        let packed = zstd::encode_all(text, LEVEL).map_err(failed)?;
        file.write_all(&packed).map_err(failed)?;
    } else {
        file.write_all(text).map_err(failed)?;
    }
    file.persist(path).map_err(|error| failed(error.error))?;
    Ok(())
}

/// The strongest level that needs no more memory to read than usual.
const LEVEL: i32 = 19;

fn is_compressed(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "zst")
}
