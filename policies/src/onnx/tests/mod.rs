//! Graphs that consist of layers, and graphs that do not.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

mod recurrent;

use serde_json::json;

use super::graph::Reader;
use super::proto::{Attribute, Dimension, Graph, Node, Shape, TensorProto, TensorType, Type, ValueInfo};

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

fn integers(name: &str, dims: &[i64], values: &[i64]) -> TensorProto {
    TensorProto {
        name: name.into(),
        dims: dims.into(),
        data_type: 7,
        int64_data: values.into(),
        ..TensorProto::default()
    }
}

fn value(name: &str, sizes: &[i64]) -> ValueInfo {
    let dim = sizes.iter().map(|size| Dimension { dim_value: *size }).collect();
    let tensor_type = Some(TensorType { shape: Some(Shape { dim }) });
    ValueInfo { name: name.into(), r#type: Some(Type { tensor_type }) }
}

fn read(nodes: Vec<Node>, initializer: Vec<TensorProto>) -> Result<serde_json::Value, String> {
    read_with_window(&[0, 2, 3, 3], nodes, initializer)
}

fn read_with_window(
    window: &[i64],
    nodes: Vec<Node>,
    initializer: Vec<TensorProto>,
) -> Result<serde_json::Value, String> {
    let graph = Graph {
        node: nodes,
        initializer,
        input: vec![value("obs", window), value("numbers", &[0, 4])],
        output: vec![value("logits", &[])],
    };
    let mut reader = Reader::new(&graph)?;
    graph.node.iter().for_each(|node| reader.add(node));
    let (architecture, _) = reader.finish("logits", None)?;
    Ok(serde_json::to_value(architecture).unwrap())
}

fn convolution(input: &str, output: &str, name: &str) -> Node {
    node("Conv", &[input, name], output, vec![ints("pads", &[1; 4])])
}

/// The head, which returns the logits of a list.
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
fn heads_without_a_bias_are_read() {
    let nodes =
        vec![node("Flatten", &["obs"], "flat", vec![]), node("MatMul", &["flat", "head"], "logits", vec![])];
    let product = read(nodes.clone(), vec![tensor("head", &[18, 5])]).unwrap();
    let gemm = vec![node("Flatten", &["obs"], "flat", vec![]), head("flat")];
    let dense = read(gemm, vec![tensor("head.weight", &[5, 18])]).unwrap();
    assert_eq!(product["layers"], dense["layers"]);
    let graph = Graph {
        node: [nodes, vec![node("MatMul", &["flat", "critic"], "value", vec![])]].concat(),
        initializer: vec![tensor("head", &[18, 5]), tensor("critic", &[18, 1])],
        input: vec![value("obs", &[0, 2, 3, 3])],
        output: vec![value("logits", &[]), value("value", &[])],
    };
    let mut reader = Reader::new(&graph).unwrap();
    graph.node.iter().for_each(|node| reader.add(node));
    let (architecture, mut tensors) = reader.finish("logits", Some("value")).unwrap();
    let critic = architecture.value.unwrap();
    tensors.take(&format!("{critic}.weight"), &[Some(1), Some(18)]).unwrap();
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
    assert_eq!(error, "output `logits` depends on something other than a supported layer: operator `Celu`");
    nodes[0] = node("Flatten", &["logits"], "flat", vec![]);
    assert!(
        read(nodes, tensors()).unwrap_err().contains("value `logits`, which no earlier operator returns")
    );
}

#[test]
fn dynamic_dimensions_of_the_window_are_rejected() {
    let error = read_with_window(&[0, 2, 0, 0], vec![head("obs")], Vec::new()).unwrap_err();
    assert_eq!(
        error,
        "input `obs` has dynamic channels, rows or columns, expected fixed sizes; only the first dimension may be dynamic"
    );
}

#[test]
fn hostile_files_are_rejected() {
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
    assert!(read(nodes.clone(), vec![empty]).unwrap_err().contains("expected sizes above 0"));
    let mut infinite = tensor("head.weight", &[5, 18]);
    infinite.float_data[7] = f32::INFINITY;
    let error = read(nodes, vec![infinite]).unwrap_err();
    assert!(error.ends_with("tensor `head.weight`: value 7 is `inf`, expected a finite number"), "{error}");
    let error = |bytes: &[u8]| super::read(bytes).err().unwrap();
    assert!(error(b"").contains("no graph"));
    assert!(error(b"\x89PNG").starts_with("not an ONNX file: "));
    // A length of 2^56 - 1 bytes, or 64 PiB.
    let long = error(&[0x3a, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f]);
    assert!(long.starts_with("not an ONNX file: "), "{long}");
}

#[test]
fn generated_layer_names_differ_from_the_names_in_the_file() {
    let nodes = vec![
        node("Conv", &["obs", "layer-1.weight"], "x", vec![ints("pads", &[1; 4])]),
        node("Flatten", &["x"], "flat", vec![]),
        node("Gemm", &["flat", "unnamed"], "logits", vec![int("transB", 1)]),
    ];
    let got =
        read(nodes, vec![tensor("layer-1.weight", &[2, 2, 3, 3]), tensor("unnamed", &[5, 18])]).unwrap();
    assert_eq!(got["layers"][0]["convolution"]["name"], "layer-1");
    assert_eq!(got["actions"], "layer-2");
}

#[test]
fn a_product_without_bias_can_be_added_to_its_input() {
    let nodes = vec![
        node("Flatten", &["obs"], "flat", vec![]),
        node("MatMul", &["flat", "w"], "x", vec![]),
        node("Relu", &["x"], "y", vec![]),
        node("MatMul", &["y", "m"], "product", vec![]),
        node("Add", &["y", "product"], "sum", vec![]),
        node("Gemm", &["sum", "head.weight"], "logits", vec![int("transB", 1)]),
    ];
    let tensors = vec![tensor("w", &[18, 4]), tensor("m", &[4, 4]), tensor("head.weight", &[5, 4])];
    let got = read(nodes, tensors).unwrap();
    let residual = json!({"residual": [{"dense": "layer-1"}]});
    assert_eq!(got["layers"], json!(["flatten", {"dense": "layer-0"}, "relu", residual]));
}

#[test]
fn the_type_of_a_tensor_is_named() {
    let mut half = tensor("head.weight", &[5, 18]);
    half.data_type = 10;
    let error = read(vec![node("Flatten", &["obs"], "flat", vec![]), head("flat")], vec![half]).unwrap_err();
    let reason = "tensor `head.weight` has type 10, expected 1 (float)";
    assert_eq!(error, format!("output `logits` depends on something other than a supported layer: {reason}"));
}

/// The runtime of a graph from `obs`, a window of 2 × 3 × 3, to `x`, a list of 18 values.
#[cfg(feature = "onnx")]
fn runtime_of(nodes: Vec<Node>, tensors: Vec<TensorProto>) -> Box<super::Runtime> {
    use prost::Message;

    use super::proto::Model;

    let mut nodes = nodes;
    nodes.push(node("Gemm", &["x", "head.weight", "bias"], "logits", vec![int("transB", 1)]));
    let mut initializer = vec![tensor("head.weight", &[5, 18]), tensor("bias", &[5])];
    initializer.extend(tensors);
    // As in old files, the inputs list the tensors.
    let listed = initializer.iter().map(|tensor| value(&tensor.name, &tensor.dims));
    let input = std::iter::once(value("obs", &[1, 2, 3, 3])).chain(listed).collect();
    let graph = Graph { node: nodes, initializer, input, output: vec![value("logits", &[1, 5])] };
    let file = [vec![0x08, 0x08], Model { graph: Some(graph) }.encode_to_vec()].concat();
    match super::read(&file).unwrap() {
        super::Graph::Runtime(runtime) => runtime,
        super::Graph::Layers(..) => panic!("all operators are layers"),
    }
}

#[cfg(feature = "onnx")]
#[test]
fn graphs_whose_layers_cannot_be_built_fall_back_to_the_runtime() {
    let attributes = vec![ints("pads", &[1; 4]), ints("strides", &[1, 1]), ints("dilations", &[1, 1])];
    let sum_of_windows = vec![
        node("Conv", &["obs", "conv.weight"], "y", attributes),
        node("Add", &["y", "obs"], "sum", vec![]),
        node("Flatten", &["sum"], "x", vec![]),
    ];
    let runtime = runtime_of(sum_of_windows, vec![tensor("conv.weight", &[2, 2, 3, 3])]);
    assert!(runtime.reason.contains("layer `residual` begins with the window"), "{}", runtime.reason);
    assert_eq!((runtime.num_actions, runtime.window), (5, [2, 3, 3]));
    let sum_of_lists = vec![
        node("Flatten", &["obs"], "flat", vec![]),
        node("MatMul", &["flat", "m"], "product", vec![]),
        node("Add", &["flat", "product"], "x", vec![]),
    ];
    let runtime = runtime_of(sum_of_lists, vec![tensor("m", &[18, 18])]);
    assert!(runtime.reason.contains("a flattened window"), "{}", runtime.reason);
}

#[cfg(feature = "onnx")]
#[test]
fn the_cut_keeps_no_operator_for_the_empty_name_of_an_absent_input() {
    use prost::Message;

    use super::proto::Model;

    let clip = node("Clip", &["obs", "", "most"], "clipped", vec![]);
    let other = node("Frobnicate", &["obs"], "", vec![]);
    let graph = Graph {
        node: vec![other, clip, node("Flatten", &["clipped"], "logits", vec![])],
        initializer: vec![tensor("most", &[])],
        input: vec![value("obs", &[1, 2, 3, 3])],
        output: vec![value("logits", &[1, 18])],
    };
    let cut = super::cut::cut(&Model { graph: Some(graph) }.encode_to_vec(), "logits").unwrap();
    let nodes = Model::decode(&*cut).unwrap().graph.unwrap().node;
    assert_eq!(nodes.iter().map(|node| &*node.op_type).collect::<Vec<_>>(), ["Clip", "Flatten"]);
}

#[cfg(feature = "onnx")]
#[test]
#[should_panic(expected = "the workspace belongs to another network")]
fn the_workspace_of_a_runtime_does_not_serve_layers() {
    use prost::Message;

    use super::proto::Model;
    use crate::network::{Inputs, Network, RecurrentState};

    let folder = tempfile::tempdir().unwrap();
    let open = |name: &str, bytes: Vec<u8>| {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        Network::read(folder.path().join(name)).unwrap()
    };
    let layers = open("layers.onnx", Model { graph: Some(recurrent::recurrent(1)) }.encode_to_vec());
    let mut workspace = open("other.onnx", other_operator("Mul")).workspace();
    let inputs = Inputs { windows: &[0.0; recurrent::INPUTS], scalars: &[], batch: 1 };
    let _ = layers.forward(inputs, &mut RecurrentState::new(&layers, 1), &mut workspace);
}

/// A head on a window whose values go through an operator that is not a layer.
#[cfg(feature = "onnx")]
fn other_operator(op_type: &str) -> Vec<u8> {
    use prost::Message;

    use super::proto::Model;

    let graph = Graph {
        node: vec![
            node(op_type, &["obs", "obs"], "double", vec![]),
            node("Flatten", &["double"], "flat", vec![int("axis", 1)]),
            node("Gemm", &["flat", "head.weight", "bias"], "logits", vec![int("transB", 1)]),
            node("Multinomial", &["logits"], "actions", vec![]),
        ],
        initializer: vec![tensor("head.weight", &[5, 18]), tensor("bias", &[5])],
        input: vec![value("obs", &[1, 2, 3, 3]), value("numbers", &[1, 4])],
        output: vec![value("actions", &[1, 1]), value("logits", &[1, 5])],
    };
    // Field 1, the version of the format, is 8.
    [vec![0x08, 0x08], Model { graph: Some(graph) }.encode_to_vec()].concat()
}

#[cfg(feature = "onnx")]
#[test]
fn the_runtime_runs_other_operators() {
    let super::Graph::Runtime(runtime) = super::read(&other_operator("Mul")).unwrap() else {
        panic!("no runtime")
    };
    assert_eq!((runtime.num_actions, runtime.window), (5, [2, 3, 3]));
    let mut logits = Vec::new();
    let window: Vec<f32> = (0..18u8).map(f32::from).collect();
    runtime.run(&window, &mut logits).unwrap();
    let expected = (0..5u32).map(|row| (0..18u32).map(|col| (18 * row + col) * col * col).sum::<u32>());
    let expected: Vec<f32> = expected.zip(0..5u8).map(|(sum, bias)| sum as f32 + f32::from(bias)).collect();
    assert_eq!(logits, expected);
}

#[cfg(feature = "onnx")]
#[test]
fn the_runtime_names_an_operator_that_it_does_not_know() {
    let error = super::read(&other_operator("Frobnicate")).err().unwrap();
    assert!(error.contains("Frobnicate") && !error.contains('\n'), "{error}");
}
