//! Kinds of files by their names.

use std::path::Path;

/// Returns the extension of a file in lower case, empty if it has none.
pub(crate) fn extension(path: &Path) -> String {
    path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase()
}

/// Returns whether a file holds only metadata of another file, which macOS stores in archives and on foreign disks.
pub(crate) fn is_metadata(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("._"))
}
