//! Text files, written atomically, and compressed if their name ends in `.zst`.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;

use pogema_core::{Error, InputLimit};

/// Opens a text file, and decompresses it if its name ends in `.zst`.
///
/// Reading fails where the decompressed text exceeds the default [`InputLimit`].
///
/// # Errors
/// [`Error::Io`] if the file cannot be opened.
pub fn open(path: &Path) -> Result<Box<dyn BufRead>, Error> {
    open_within(path, InputLimit::default())
}

/// Opens a text file as [`open`] does, with the given limit.
///
/// # Errors
/// [`Error::Io`] if the file cannot be opened.
pub fn open_within(path: &Path, limit: InputLimit) -> Result<Box<dyn BufRead>, Error> {
    let failed = |error: std::io::Error| Error::io(path, error);
    let file = File::open(path).map_err(failed)?;
    if is_compressed(path) {
        let text = zstd::Decoder::new(file).map_err(failed)?;
        return Ok(Box::new(limit.file(BufReader::new(text))));
    }
    Ok(Box::new(limit.file(BufReader::new(file))))
}

/// Writes a text file under a temporary name and renames it; compresses it if its name ends in `.zst`.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written; an existing file is then unchanged.
pub fn write(path: &Path, text: &[u8]) -> Result<(), Error> {
    write_with(path, |file| file.write_all(text).map_err(|error| Error::io(path, error)))
}

/// Calls a function that writes a text file; otherwise works like [`write()`].
///
/// # Errors
/// Those of the function, and [`Error::Io`] if the file cannot be written; an existing file is then unchanged.
pub fn write_with(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<(), Error>) -> Result<(), Error> {
    let failed = |error: std::io::Error| Error::io(path, error);
    pogema_core::files::write_with(path, |file| {
        if !is_compressed(path) {
            return write(file);
        }
        let mut packed = zstd::Encoder::new(file, LEVEL).map_err(failed)?;
        write(&mut packed)?;
        packed.finish().map(|_| ()).map_err(failed)
    })
}

/// The highest level that does not need extra memory to decompress.
const LEVEL: i32 = 19;

fn is_compressed(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "zst")
}
