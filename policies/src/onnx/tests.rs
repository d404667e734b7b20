//! Graphs that are layers, and graphs that are none.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

use prost::Message;
use serde_json::json;

use super::proto::{
    Attribute, Dimension, Graph, Model, Node, Shape, TensorProto, TensorType, Type, ValueInfo,
};

fn node(op_type: &str, inputs: &[&str], output: &str, attribute: Vec<Attribute>) -> Node {
    let input = inputs.iter().map(|name| (*name).into()).collect();
    Node { input, output: vec![output.into()], op_type: op_type.into(), attribute, ..Node::default() }
}

fn int(name: &str, i: i64) -> Attribute {
    Attribute { name: name.into(), i, ..Attribute::default() }
}

fn ints(name: &str, ints: &[i64]) -> Attribute {
    Attribute { name: name.into(), ints: ints.into(), ..Attribute::default() }
}

fn tensor(name: &str, dims: &[i64]) -> TensorProto {
    let float_data = (0..dims.iter().product()).map(|index| index as f32).collect();
    TensorProto { name: name.into(), dims: dims.into(), data_type: 1, float_data, ..TensorProto::default() }
}

fn value(name: &str, sizes: &[i64]) -> ValueInfo {
    let dim = sizes.iter().map(|size| Dimension { dim_value: *size }).collect();
    let tensor_type = Some(TensorType { shape: Some(Shape { dim }) });
    ValueInfo { name: name.into(), r#type: Some(Type { tensor_type }) }
}

fn read(nodes: Vec<Node>, initializer: Vec<TensorProto>) -> Result<serde_json::Value, String> {
    let graph = Graph {
        node: nodes,
        initializer,
        input: vec![value("obs", &[0, 2, 3, 3]), value("numbers", &[0, 4])],
        output: vec![value("logits", &[])],
    };
    let (architecture, _) = super::read(&Model { graph: Some(graph) }.encode_to_vec())?;
    Ok(serde_json::to_value(architecture).unwrap())
}

fn convolution(input: &str, output: &str, name: &str) -> Node {
    node("Conv", &[input, name], output, vec![ints("pads", &[1; 4])])
}

/// The head, on a list of 18 values.
fn head(input: &str) -> Node {
    node("Gemm", &[input, "head.weight"], "logits", vec![int("transB", 1)])
}

#[test]
fn both_kinds_of_residual_blocks_are_read() {
    let nodes = |added: &str| {
        vec![
            node("Relu", &["obs"], "x", vec![]),
            convolution("x", "y", "conv.weight"),
            node("Add", &["y", added], "sum", vec![]),
            node("Flatten", &["sum"], "flat", vec![]),
            head("flat"),
        ]
    };
    let tensors = || vec![tensor("conv.weight", &[2, 2, 3, 3]), tensor("head.weight", &[5, 18])];
    let convolution = json!({"convolution": {"name": "conv", "padding": 1}});
    let in_place = read(nodes("x"), tensors()).unwrap();
    assert_eq!(in_place["layers"], json!(["relu", {"residual": [convolution]}, "flatten"]));
    let outside = read(nodes("obs"), tensors()).unwrap();
    assert_eq!(outside["layers"], json!([{"residual": ["relu", convolution]}, "flatten"]));
}

#[test]
fn scalars_and_products_are_read() {
    let nodes = vec![
        node("Flatten", &["obs"], "flat", vec![]),
        node("MatMul", &["numbers", "m"], "product", vec![]),
        node("Add", &["bias", "product"], "sum", vec![]),
        node("Relu", &["sum"], "relu", vec![]),
        node("Concat", &["flat", "relu"], "all", vec![int("axis", 1)]),
        head("all"),
    ];
    let tensors = vec![tensor("m", &[4, 3]), tensor("bias", &[3]), tensor("head.weight", &[5, 21])];
    let got = read(nodes, tensors).unwrap();
    assert_eq!(got["layers"], json!(["flatten", {"scalars": [{"dense": "layer-0"}, "relu"]}]));
    assert_eq!((&got["scalars"], &got["actions"]), (&json!(4), &json!("head")));
}

#[test]
fn operators_after_the_logits_do_not_matter_but_those_before_do() {
    let mut nodes = vec![node("Flatten", &["obs"], "flat", vec![]), head("flat")];
    nodes.push(node("Multinomial", &["logits"], "actions", vec![]));
    let tensors = || vec![tensor("head.weight", &[5, 18])];
    assert!(read(nodes.clone(), tensors()).is_ok());
    nodes[0].op_type = "Celu".into();
    let error = read(nodes.clone(), tensors()).unwrap_err();
    assert_eq!(error, "output `logits` depends on operator `Celu`, which is no layer of this program");
    nodes[0] = node("Flatten", &["logits"], "flat", vec![]);
    assert!(
        read(nodes, tensors()).unwrap_err().contains("value `logits`, which no earlier operator returns")
    );
}

#[test]
fn hostile_files_are_refused() {
    let huge = TensorProto {
        dims: vec![1 << 60, 18],
        data_type: 1,
        name: "head.weight".into(),
        ..TensorProto::default()
    };
    let nodes = vec![node("Flatten", &["obs"], "flat", vec![]), head("flat")];
    assert!(read(nodes.clone(), vec![huge]).unwrap_err().contains("tensor `head.weight` has 0 values"));
    let empty = TensorProto {
        dims: vec![1 << 60, 0],
        data_type: 1,
        name: "head.weight".into(),
        ..TensorProto::default()
    };
    assert!(read(nodes, vec![empty]).unwrap_err().contains("expected sizes above 0"));
    assert!(super::read(b"").unwrap_err().contains("no graph"));
    assert!(super::read(b"\x89PNG").unwrap_err().starts_with("no ONNX file: "));
    // A length of an exabyte.
    assert!(super::read(&[0x3a, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f]).is_err());
}
