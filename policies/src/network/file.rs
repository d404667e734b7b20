//! Reads weights and the JSON beside them.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use pogema_core::{Error, InputLimit};
use safetensors::{Dtype, SafeTensors};

use super::config::NetworkConfig;
use super::tensors::Tensors;

/// Reads a file of weights and its JSON.
pub fn read(path: &Path) -> Result<(NetworkConfig, Tensors), Error> {
    let json = path.with_extension("json");
    let config = parse_config(&read_bytes(&json)?).map_err(|reason| Error::io(&json, reason))?;
    let tensors = parse_tensors(&read_bytes(path)?).map_err(|reason| Error::io(path, reason))?;
    Ok((config, tensors))
}

fn read_bytes(path: &Path) -> Result<Vec<u8>, Error> {
    let failed = |error: std::io::Error| Error::io(path, error);
    let limit = InputLimit::default();
    let mut bytes = Vec::new();
    let most = limit.largest_file();
    File::open(path).map_err(failed)?.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > most { Err(failed(limit.file_error())) } else { Ok(bytes) }
}

/// Parses the JSON. An error is a text.
pub fn parse_config(bytes: &[u8]) -> Result<NetworkConfig, String> {
    let config: NetworkConfig = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
    if config.version != NetworkConfig::VERSION {
        return Err(format!("`version` is `{}`, expected {}", config.version, NetworkConfig::VERSION));
    }
    Ok(config)
}

/// Parses the tensors of a `.safetensors` file. An error is a text.
pub fn parse_tensors(bytes: &[u8]) -> Result<Tensors, String> {
    let file = SafeTensors::deserialize(bytes).map_err(|error| format!("no safetensors file: {error}"))?;
    let mut tensors = Tensors::default();
    for (name, view) in file.tensors() {
        if view.dtype() != Dtype::F32 {
            return Err(format!("tensor `{name}` has type {:?}, expected F32", view.dtype()));
        }
        tensors.insert(&name, view.shape(), view.data())?;
    }
    Ok(tensors)
}
