//! Finds the files that the checks read: in this crate, or next to the program.

use std::path::{Path, PathBuf};

/// Returns a folder of this crate. If the crate is not on this machine, returns the folder that a release has next to
/// the program.
pub(crate) fn folder(name: &str) -> PathBuf {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    match std::env::current_exe() {
        Ok(program) => existing_or_beside(own, &program, name),
        Err(_) => own.join(name),
    }
}

fn existing_or_beside(own: &Path, program: &Path, name: &str) -> PathBuf {
    if own.is_dir() { own.join(name) } else { program.with_file_name("conformance").join(name) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_the_crate_the_folder_is_next_to_the_program() {
        let program = Path::new("/release/pogema");
        let own = Path::new(env!("CARGO_MANIFEST_DIR"));
        assert_eq!(existing_or_beside(own, program, "cases"), own.join("cases"));
        let elsewhere = own.join("not a folder");
        assert_eq!(existing_or_beside(&elsewhere, program, "cases"), Path::new("/release/conformance/cases"));
    }
}
