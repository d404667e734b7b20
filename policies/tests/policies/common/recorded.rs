//! Recordings of published networks, which the repository does not contain.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::PathBuf;

/// Returns the folder with the recordings: `POGEMA_WEIGHTS`, else `../shared/data/weights` beside the repository.
///
/// Prints one line if there is none.
pub fn folder(test: &str) -> Option<PathBuf> {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/weights");
    // In a worktree, the repository's own folder may lie one level deeper.
    let deeper = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/weights");
    let named = std::env::var_os("POGEMA_WEIGHTS").map(PathBuf::from);
    let folder = named.into_iter().chain([beside(), deeper()]).find(|folder| folder.is_dir());
    if folder.is_none() {
        println!("skipped `{test}`: no recordings, set POGEMA_WEIGHTS to a folder with them");
    }
    folder
}

/// An array of bytes or floats.
pub struct Array {
    pub shape: Vec<usize>,
    pub bytes: Vec<u8>,
}

impl Array {
    pub fn i8(&self) -> Vec<i8> {
        self.bytes.iter().map(|&byte| byte as i8).collect()
    }
}

/// Reads the arrays of a `.npz` file by name.
pub fn arrays(path: &std::path::Path) -> BTreeMap<String, Array> {
    let mut archive = zip::ZipArchive::new(File::open(path).unwrap()).unwrap();
    let mut arrays = BTreeMap::new();
    for index in 0..archive.len() {
        let mut entry = archive.by_index(index).unwrap();
        let name = entry.name().trim_end_matches(".npy").to_owned();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).unwrap();
        // Format 1.0: magic, version, the length of the header in two bytes, the header as a Python dictionary.
        let begin = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let header = String::from_utf8(bytes[10..begin].to_vec()).unwrap();
        let shape = header.split_once("'shape': (").unwrap().1.split_once(')').unwrap().0;
        let shape = shape.split(',').filter_map(|size| size.trim().parse().ok()).collect();
        arrays.insert(name, Array { shape, bytes: bytes.split_off(begin) });
    }
    arrays
}
