//! Reads networks from ONNX files whose operators are layers of ours.

mod graph;
mod operators;
mod proto;

use prost::Message;

use crate::network::{Architecture, Tensors};
use graph::Reader;
use proto::Model;

/// Names of the output that holds the logits. If there is none of them, it is the only output.
const LOGITS: [&str; 2] = ["action_logits", "logits"];

/// Names of the output that holds the value.
const VALUES: [&str; 2] = ["values", "value"];

/// Reads the layers and the tensors of an ONNX file. Whatever follows the logits is cut off. An error is a text.
pub fn read(bytes: &[u8]) -> Result<(Architecture, Tensors), String> {
    let model = Model::decode(bytes).map_err(|error| format!("no ONNX file: {error}"))?;
    let graph = model.graph.ok_or("no ONNX file: the model has no graph")?;
    let mut reader = Reader::new(&graph)?;
    for node in &graph.node {
        reader.add(node);
    }
    let named = |names: &[&str]| graph.output.iter().find(|output| names.contains(&&*output.name));
    let logits = match (named(&LOGITS), &*graph.output) {
        (Some(output), _) | (None, [output]) => output,
        _ => {
            return Err(format!(
                "{} outputs, expected one of them to be called `logits`",
                graph.output.len()
            ));
        }
    };
    reader.finish(&logits.name, named(&VALUES).map(|output| &*output.name))
}

#[cfg(test)]
mod tests;
