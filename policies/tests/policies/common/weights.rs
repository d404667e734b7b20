//! The weights of a published network as safetensors, for tests that must not depend on how ONNX files are read.

use std::path::{Path, PathBuf};

/// Writes the weights of Follower-lite and the JSON of its layers to a folder, and returns the path of the weights.
pub fn follower_lite(onnx: &Path, folder: &Path) -> PathBuf {
    let bytes = std::fs::read(onnx).unwrap();
    let graph =
        fields(&bytes).into_iter().find_map(|(field, content)| (field == 7).then_some(content)).unwrap();
    let (mut header, mut data) = (serde_json::Map::new(), Vec::new());
    for (_, tensor) in fields(graph).into_iter().filter(|&(field, _)| field == 5) {
        let parts = fields(tensor);
        let part =
            |wanted| parts.iter().filter(move |(field, _)| *field == wanted).map(|(_, content)| *content);
        // A size is a number of one or two bytes here, one entry for each.
        let sizes = part(1).map(|size| number(size).0).collect::<Vec<_>>();
        let name = String::from_utf8(part(8).next().unwrap().to_vec()).unwrap();
        let raw = part(9).next().unwrap();
        if raw.len() as u64 == 4 * sizes.iter().product::<u64>() {
            let range = [data.len(), data.len() + raw.len()];
            data.extend_from_slice(raw);
            header.insert(name, serde_json::json!({"dtype": "F32", "shape": sizes, "data_offsets": range}));
        }
    }
    let header = serde_json::to_vec(&header).unwrap();
    let length = (header.len() as u64).to_le_bytes();
    let path = folder.join("follower-lite.safetensors");
    std::fs::write(&path, [&length[..], &header, &data].concat()).unwrap();
    let convolution = |name: &str| serde_json::json!({"convolution": {"name": name, "padding": 1}});
    let block = "encoder.conv_head.1.res_block_core";
    let residual = [convolution(&format!("{block}.1")), "relu".into(), convolution(&format!("{block}.3"))];
    let json = serde_json::json!({
        "version": 1,
        "architecture": {
            "window": [2, 7, 7],
            "layers": [
                convolution("encoder.conv_head.0"), "relu", {"residual": residual}, "relu", "flatten",
            ],
            "actions": "action_parameterization.distribution_linear",
        },
    });
    std::fs::write(path.with_extension("json"), json.to_string()).unwrap();
    path
}

/// Returns the fields of a Protocol Buffers message: the number of each and its content.
fn fields(mut message: &[u8]) -> Vec<(u64, &[u8])> {
    let mut all = Vec::new();
    while !message.is_empty() {
        let (key, after) = number(message);
        let (after, length) = match key & 7 {
            0 => (after, number(&message[after..]).1),
            1 => (after, 8),
            2 => {
                let (length, size) = number(&message[after..]);
                (after + size, length as usize)
            }
            _ => (after, 4),
        };
        all.push((key >> 3, &message[after..after + length]));
        message = &message[after + length..];
    }
    all
}

/// Returns a number of variable length, and its length.
fn number(bytes: &[u8]) -> (u64, usize) {
    let length = bytes.iter().position(|byte| byte & 128 == 0).unwrap() + 1;
    let value = bytes[..length].iter().rev().fold(0, |value, byte| value << 7 | u64::from(byte & 127));
    (value, length)
}
