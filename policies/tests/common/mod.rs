//! Recorded inputs and logits of networks that others trained.

#![allow(dead_code, reason = "each test uses a part")]

use std::fs::File;
use std::io::Read;
use std::path::Path;

use zip::ZipArchive;

mod weights;

pub use weights::weights;

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
