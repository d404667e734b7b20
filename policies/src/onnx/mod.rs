//! Reads networks from ONNX files. If all operators are supported layers, they become a network of layers. Otherwise,
//! if the feature `onnx` is enabled, a runtime runs the graph.

mod axes;
#[cfg(feature = "onnx")]
mod cut;
mod graph;
mod operators;
mod proto;
mod reshape;
#[cfg(feature = "onnx")]
mod runtime;

use pogema_core::counted;
use prost::Message;

#[cfg(feature = "onnx")]
use crate::network::check_layers;
use crate::network::{Architecture, Tensors};
use graph::Reader;
use proto::Model;
#[cfg(feature = "onnx")]
pub use runtime::Runtime;

/// Names of the output that holds the logits. Without such an output, the only output holds them.
const LOGITS: [&str; 2] = ["action_logits", "logits"];

/// Names of the output that holds the value.
const VALUES: [&str; 2] = ["values", "value"];

/// A graph that was read.
pub enum Graph {
    /// All operators are layers.
    Layers(Architecture, Tensors),
    /// At least one operator has no layer, or the layers cannot be built.
    #[cfg(feature = "onnx")]
    Runtime(Box<Runtime>),
}

/// Reads an ONNX file. Operators after the logits are cut off. Errors are messages without the path.
pub fn read(bytes: &[u8]) -> Result<Graph, String> {
    let model = Model::decode(bytes).map_err(|error| format!("not an ONNX file: {error}"))?;
    let graph = model.graph.ok_or("not an ONNX file: the model has no graph")?;
    let mut reader = Reader::new(&graph)?;
    for node in &graph.node {
        reader.add(node);
    }
    let named = |names: &[&str]| graph.output.iter().find(|output| names.contains(&&*output.name));
    let ((Some(logits), _) | (None, [logits])) = (named(&LOGITS), &*graph.output) else {
        return Err(format!(
            "the graph has {}, expected a single output, or one called `action_logits` or `logits`",
            counted(graph.output.len(), "output")
        ));
    };
    let layers = reader.finish(&logits.name, named(&VALUES).map(|output| &*output.name));
    // The runtime also runs graphs whose layers cannot be built.
    #[cfg(feature = "onnx")]
    let layers = layers.and_then(|(architecture, tensors)| {
        check_layers(&architecture, &mut tensors.clone()).map(|()| (architecture, tensors))
    });
    match layers {
        Ok((architecture, tensors)) => Ok(Graph::Layers(architecture, tensors)),
        #[cfg(feature = "onnx")]
        Err(reason) => {
            let runtime = Runtime::read(cut::cut(bytes, &logits.name)?, reader.window(), reason)?;
            Ok(Graph::Runtime(Box::new(runtime)))
        }
        #[cfg(not(feature = "onnx"))]
        Err(reason) => Err(reason),
    }
}

#[cfg(test)]
mod tests;
