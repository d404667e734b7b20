//! Reads files up to a maximum size, so that a device in the place of a file cannot fill the memory.

use std::path::Path;

use pogema_core::Error;
use pogema_core::files::read_within;

/// Returns the bytes of a file of results, or of a file that a suite names.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, or is larger than 512 MiB.
pub(crate) fn read_bounded(path: &Path) -> Result<Vec<u8>, Error> {
    read_within(path, 1 << 29)
}
