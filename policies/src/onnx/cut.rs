//! Cuts a graph at its logits; the parts that stay are copied as bytes.

use std::collections::HashSet;

use prost::Message;

use super::proto::{Node, ValueInfo};

/// A model whose parts are kept as bytes.
#[derive(Clone, PartialEq, Message)]
struct RawModel {
    #[prost(int64, tag = "1")]
    ir_version: i64,
    #[prost(message, optional, tag = "7")]
    graph: Option<RawGraph>,
    #[prost(bytes = "vec", repeated, tag = "8")]
    opset_import: Vec<Vec<u8>>,
}

#[derive(Clone, PartialEq, Message)]
struct RawGraph {
    #[prost(bytes = "vec", repeated, tag = "1")]
    node: Vec<Vec<u8>>,
    #[prost(string, tag = "2")]
    name: String,
    #[prost(bytes = "vec", repeated, tag = "5")]
    initializer: Vec<Vec<u8>>,
    #[prost(bytes = "vec", repeated, tag = "11")]
    input: Vec<Vec<u8>>,
    #[prost(bytes = "vec", repeated, tag = "12")]
    output: Vec<Vec<u8>>,
}

/// A tensor of which only the name is read.
#[derive(Clone, PartialEq, Message)]
struct RawTensor {
    #[prost(string, tag = "8")]
    name: String,
}

/// Returns the file with only the operators that the logits need. Errors are messages without the path.
pub fn cut(bytes: &[u8], logits: &str) -> Result<Vec<u8>, String> {
    let failed = |error: prost::DecodeError| format!("not an ONNX file: {error}");
    let mut model = RawModel::decode(bytes).map_err(failed)?;
    let graph = model.graph.as_mut().ok_or("not an ONNX file: the model has no graph")?;
    let mut needed = HashSet::from([logits.to_owned()]);
    let mut nodes = Vec::new();
    for raw in std::mem::take(&mut graph.node).into_iter().rev() {
        let node = Node::decode(&*raw).map_err(failed)?;
        if !node.output.iter().any(|output| needed.contains(output)) {
            continue;
        }
        if node.attribute.iter().any(|attribute| attribute.g.is_some() || !attribute.graphs.is_empty()) {
            return Err(format!("operator `{}` contains a subgraph, which is not supported", node.op_type));
        }
        // If an optional input is absent, its name is empty.
        needed.extend(node.input.into_iter().filter(|name| !name.is_empty()));
        nodes.push(raw);
    }
    nodes.reverse();
    graph.node = nodes;
    let named = |raw: &Vec<u8>| ValueInfo::decode(&**raw).ok().map(|value| value.name);
    graph.output.retain(|output| named(output).is_some_and(|name| name == logits));
    // Old files list their tensors among the inputs. The runtime would expect values for them.
    for raw in &graph.initializer {
        needed.remove(&RawTensor::decode(&**raw).map_err(failed)?.name);
    }
    graph.input.retain(|input| named(input).is_some_and(|name| needed.contains(&name)));
    Ok(model.encode_to_vec())
}
