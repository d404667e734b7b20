//! Text files, compressed if their name ends in `.zst` and written atomically.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use pogema_core::Error;
use pogema_core::files::write_whole;

/// Opens a text file, and decompresses it if its name ends in `.zst`.
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

/// Writes a text file under a temporary name and renames it; compresses it if its name ends in `.zst`.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written; an existing file is then unchanged.
pub fn write(path: &Path, text: &[u8]) -> Result<(), Error> {
    if is_compressed(path) {
        let packed = zstd::encode_all(text, LEVEL).map_err(|error| Error::io(path, error))?;
        write_whole(path, &packed)
    } else {
        write_whole(path, text)
    }
}

/// The highest level that does not need extra memory to decompress.
const LEVEL: i32 = 19;

fn is_compressed(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "zst")
}
