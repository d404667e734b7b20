//! Recorded inputs and logits of networks that others trained.

#![allow(dead_code, reason = "each test uses a part")]

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use zip::ZipArchive;

/// Returns the folder with the published networks: the variable `POGEMA_WEIGHTS`, else `shared/data/weights` beside the
/// repository. Without it, prints what was skipped.
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
    println!("skipped {what}: no folder {}", folder.display());
    None
}

/// Reads an array of an `.npz` file as floats.
pub fn read_array(path: &Path, name: &str) -> Vec<f32> {
    let mut archive = ZipArchive::new(File::open(path).unwrap()).unwrap();
    let mut bytes = Vec::new();
    archive.by_name(&format!("{name}.npy")).unwrap().read_to_end(&mut bytes).unwrap();
    let header_len = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let (header, data) = bytes[10..].split_at(header_len);
    let header = String::from_utf8_lossy(header);
    if header.contains("'|i1'") {
        return data.iter().map(|byte| f32::from(byte.cast_signed())).collect();
    }
    assert!(header.contains("'<f4'"), "{header}");
    data.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}
