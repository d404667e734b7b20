//! Reads and writes weights and the JSON beside them.

use std::path::Path;

use pogema_core::{Error, InputLimit, files};
use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensorError, SafeTensors};

use super::config::NetworkConfig;
use super::tensors::Tensors;
use crate::onnx::{self, Graph};

/// The content of a file of weights.
pub enum Content {
    /// The tensors of the layers that the config names.
    Layers(Tensors),
    /// A graph that cannot be converted to layers.
    #[cfg(feature = "onnx")]
    Runtime(Box<onnx::Runtime>),
}

/// Reads a file of weights and its JSON. For an ONNX file, the JSON may be absent. If the network consists of layers,
/// the returned config has an architecture.
pub fn read(path: &Path) -> Result<(NetworkConfig, Content), Error> {
    let json = path.with_extension("json");
    let bytes = read_bytes(path)?;
    if path.extension().is_some_and(|extension| extension == "onnx") {
        let config = if json.exists() { read_config(&json)? } else { NetworkConfig::default() };
        if config.architecture.is_some() {
            return Err(Error::io(&json, "`architecture` is given, expected none beside an ONNX file"));
        }
        return match onnx::read(&bytes).map_err(|reason| Error::io(path, reason))? {
            Graph::Layers(architecture, tensors) => {
                Ok((NetworkConfig { architecture: Some(architecture), ..config }, Content::Layers(tensors)))
            }
            #[cfg(feature = "onnx")]
            Graph::Runtime(runtime) => Ok((config, Content::Runtime(runtime))),
        };
    }
    let config = read_config(&json)?;
    if config.architecture.is_none() {
        return Err(Error::io(
            &json,
            "`architecture` is missing, expected the layers of the safetensors file",
        ));
    }
    let tensors = parse_tensors(&bytes).map_err(|reason| Error::io(path, reason))?;
    Ok((config, Content::Layers(tensors)))
}

/// Returns the error about a network whose file of weights can be read, but does not fit its layers. The JSON of a
/// safetensors file names the layers, so either file may be wrong.
pub fn misfit(path: &Path, reason: &str) -> Error {
    let json = path.with_extension("json");
    match json.file_name() {
        Some(json) if path.extension().is_some_and(|extension| extension != "onnx") => {
            Error::io(path, format!("does not fit {}: {reason}", json.display()))
        }
        _ => Error::io(path, reason),
    }
}

fn read_config(path: &Path) -> Result<NetworkConfig, Error> {
    parse_config(&read_bytes(path)?).map_err(|reason| Error::io(path, reason))
}

/// Writes a network as a `.safetensors` file and the JSON beside it.
pub fn write(path: &Path, config: &NetworkConfig, tensors: &Tensors) -> Result<(), Error> {
    if path.extension().is_none_or(|extension| extension != "safetensors") {
        return Err(Error::io(
            path,
            "cannot hold the weights, expected a file name that ends in .safetensors",
        ));
    }
    let bytes: Vec<(&String, &[usize], Vec<u8>)> = tensors
        .iter()
        .map(|(name, tensor)| {
            let bytes = tensor.values.iter().flat_map(|value| value.to_le_bytes()).collect();
            (name, &*tensor.shape, bytes)
        })
        .collect();
    let views: Result<Vec<_>, _> = bytes
        .iter()
        .map(|(name, shape, bytes)| {
            TensorView::new(Dtype::F32, shape.to_vec(), bytes).map(|view| (name, view))
        })
        .collect();
    let failed = |error: SafeTensorError| Error::io(path, error.to_string());
    let file = safetensors::serialize(views.map_err(failed)?, None).map_err(failed)?;
    let json = serde_json::to_string_pretty(config).map_err(|error| Error::io(path, error))?;
    files::write_both((path, &file), (&path.with_extension("json"), (json + "\n").as_bytes()))
}

fn read_bytes(path: &Path) -> Result<Vec<u8>, Error> {
    let limit = InputLimit::default();
    let bytes = files::read_at_most(path, limit.largest_file())?;
    bytes.ok_or_else(|| Error::io(path, limit.file_error()))
}

/// Parses the JSON. Errors are messages without the path.
pub fn parse_config(bytes: &[u8]) -> Result<NetworkConfig, String> {
    let config: NetworkConfig = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
    if config.version != NetworkConfig::VERSION {
        return Err(format!("`version` is `{}`, expected {}", config.version, NetworkConfig::VERSION));
    }
    Ok(config)
}

/// Parses the tensors of a `.safetensors` file. Errors are messages without the path.
pub fn parse_tensors(bytes: &[u8]) -> Result<Tensors, String> {
    let file = SafeTensors::deserialize(bytes).map_err(|error| format!("not a safetensors file: {error}"))?;
    let mut tensors = Tensors::default();
    for (name, view) in file.tensors() {
        if view.dtype() != Dtype::F32 {
            return Err(format!("tensor `{name}` has type {:?}, expected F32", view.dtype()));
        }
        tensors.insert(&name, view.shape(), view.data())?;
    }
    Ok(tensors)
}
