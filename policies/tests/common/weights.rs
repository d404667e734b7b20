//! Finds the published networks, for tests and benches.

use std::path::{Path, PathBuf};

/// Returns the folder with the published networks: that of the variable `POGEMA_WEIGHTS`, else `shared/data/weights`
/// beside the repository. If the latter does not exist, prints that `what` is skipped and returns `None`.
///
/// # Panics
/// If the variable is not the path of a folder.
pub fn weights(what: &str) -> Option<PathBuf> {
    let named = std::env::var_os("POGEMA_WEIGHTS").filter(|folder| !folder.is_empty()).map(PathBuf::from);
    if let Some(folder) = &named {
        assert!(folder.is_dir(), "POGEMA_WEIGHTS is {}, expected a folder", folder.display());
    }
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/weights");
    let folder = named.unwrap_or_else(beside);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("SKIPPED: {what}: there is no folder {}; set POGEMA_WEIGHTS", folder.display());
    None
}
