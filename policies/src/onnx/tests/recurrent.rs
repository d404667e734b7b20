//! Recurrent layers, and the operators around them.

use serde_json::json;

use super::{Attribute, Graph, Node, Reader, TensorProto, int, integers, ints, node, tensor, value};

/// Number of values in the input of a recurrent layer.
pub const INPUTS: usize = 18;
/// Number of values in its state.
const STATE: usize = 3;

/// Returns values between -1 and 1 that do not repeat.
fn drawn(name: &str, dims: &[i64], first: usize) -> TensorProto {
    let len = dims.iter().product::<i64>() as usize;
    let float_data = (first..first + len).map(|index| (index as f32 * 1.7).sin()).collect();
    TensorProto { float_data, ..tensor(name, dims) }
}

/// A recurrent layer as PyTorch exports it, between a window and a head.
pub fn recurrent(linear_before_reset: i64) -> Graph {
    let size = STATE as i64;
    let attributes = vec![int("hidden_size", size), int("linear_before_reset", linear_before_reset)];
    Graph {
        node: vec![
            node("Flatten", &["obs"], "flat", vec![]),
            node("Unsqueeze", &["flat", "0"], "sequence", vec![]),
            node("GRU", &["sequence", "w", "r", "b", "", "h0"], "states", attributes),
            node("Squeeze", &["states", "1"], "steps", vec![]),
            node("Squeeze", &["steps", "0"], "state", vec![]),
            node("Gemm", &["state", "head.weight", "bias"], "logits", vec![int("transB", 1)]),
        ],
        initializer: vec![
            drawn("w", &[1, 3 * size, INPUTS as i64], 0),
            drawn("r", &[1, 3 * size, size], 1000),
            drawn("b", &[1, 6 * size], 2000),
            drawn("head.weight", &[5, size], 3000),
            drawn("bias", &[5], 4000),
            integers("0", &[1], &[0]),
            integers("1", &[1], &[1]),
        ],
        input: vec![value("obs", &[0, 2, 3, 3]), value("h0", &[1, 0, size])],
        output: vec![value("logits", &[])],
    }
}

/// The formula of ONNX for one step, with `linear_before_reset`. The gates are update, reset and new.
///
/// Source: <https://onnx.ai/onnx/operators/onnx__GRU.html>
fn onnx_step(graph: &Graph, input: &[f64], state: &[f64]) -> Vec<f64> {
    let list = |name: &str| -> Vec<f64> {
        let tensor = graph.initializer.iter().find(|tensor| tensor.name == name).unwrap();
        tensor.float_data.iter().map(|value| f64::from(*value)).collect()
    };
    let (w, r, b) = (list("w"), list("r"), list("b"));
    let of = |weights: &[f64], values: &[f64], row: usize| -> f64 {
        weights[row * values.len()..].iter().zip(values).map(|(weight, value)| weight * value).sum()
    };
    let sigmoid = |value: f64| 1.0 / (1.0 + (-value).exp());
    let next = |index: usize| {
        let row = |gate: usize| gate * STATE + index;
        let of_input = |gate: usize| of(&w, input, row(gate)) + b[row(gate)];
        let of_state = |gate: usize| of(&r, state, row(gate)) + b[3 * STATE + row(gate)];
        let [update, reset] = [0, 1].map(|gate| sigmoid(of_input(gate) + of_state(gate)));
        let new = (of_input(2) + reset * of_state(2)).tanh();
        (1.0 - update) * new + update * state[index]
    };
    (0..STATE).map(next).collect()
}

#[test]
fn a_recurrent_layer_follows_the_formula_of_onnx() {
    use prost::Message;

    use crate::network::{Inputs, Network, RecurrentState};
    use crate::onnx::proto::Model;

    let graph = recurrent(1);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recurrent.onnx");
    std::fs::write(&path, Model { graph: Some(graph.clone()) }.encode_to_vec()).unwrap();
    let network = Network::read(&path).unwrap();
    assert_eq!((network.state_size(), network.num_actions()), (STATE, 5));
    let (mut state, mut workspace) = (RecurrentState::new(&network, 1), network.workspace());
    let mut expected = vec![0.0; STATE];
    for step in 0..6 {
        let window: Vec<f32> = (0..INPUTS).map(|index| ((step * INPUTS + index) as f32).cos()).collect();
        let inputs = Inputs { windows: &window, scalars: &[], batch: 1 };
        network.forward(inputs, &mut state, &mut workspace).unwrap();
        let window: Vec<f64> = window.into_iter().map(f64::from).collect();
        expected = onnx_step(&graph, &window, &expected);
        for (got, expected) in state.values().iter().zip(&expected) {
            assert!((f64::from(*got) - expected).abs() < 1e-5, "step {step}: {got}, expected {expected}");
        }
    }
    // If `linear_before_reset` is 0, ONNX applies the reset gate before the matrix product.
    let graph = recurrent(0);
    let mut reader = Reader::new(&graph).unwrap();
    graph.node.iter().for_each(|node| reader.add(node));
    let error = reader.finish("logits", None).err().unwrap();
    assert!(error.contains("operator `GRU` that differs from PyTorch's"), "{error}");
}

#[test]
fn recurrent_layers_that_differ_from_pytorch_or_have_a_learned_initial_state_are_rejected() {
    let texts = |name: &str, texts: &[&str]| Attribute {
        name: name.into(),
        strings: texts.iter().map(|text| text.as_bytes().to_vec()).collect(),
        ..Attribute::default()
    };
    let read = |attribute: Option<Attribute>, state: &[f32]| {
        let mut graph = recurrent(1);
        graph.node[2].attribute.extend(attribute);
        if !state.is_empty() {
            graph.input.pop();
            let mut state_tensor = tensor("h0", &[1, 1, STATE as i64]);
            state_tensor.float_data = state.into();
            graph.initializer.push(state_tensor);
        }
        let mut reader = Reader::new(&graph)?;
        graph.node.iter().for_each(|node| reader.add(node));
        reader.finish("logits", None).map(|_| ())
    };
    assert_eq!(read(Some(texts("activations", &["Sigmoid", "Tanh"])), &[0.0; STATE]), Ok(()));
    let wrong = [
        (Some(texts("activations", &["Sigmoid", "Relu"])), 0.0),
        (Some(int("clip", 1)), 0.0),
        (Some(int("activation_alpha", 1)), 0.0),
        (Some(int("activation_beta", 1)), 0.0),
    ];
    for (attribute, state) in wrong {
        let error = read(attribute, &[state; STATE]).unwrap_err();
        assert!(error.contains("operator `GRU` that differs from PyTorch's"), "{error}");
    }
    let error = read(None, &[0.5; STATE]).unwrap_err();
    assert!(error.contains("operator `GRU` whose initial state is neither zeros nor an input"), "{error}");
}

/// Reads a recurrent network whose operators before and after the recurrent layer are replaced.
///
/// The value `x` is the input of the recurrent layer, and `y` the input of the head. If `before` computes a value `h`,
/// it is the initial state.
fn read_around(before: Vec<Node>, after: Vec<Node>) -> Result<serde_json::Value, String> {
    let mut graph = recurrent(1);
    let mut gru = graph.node[2].clone();
    gru.input[0] = "x".into();
    gru.input[5] = if before.iter().any(|node| node.output[0] == "h") { "h" } else { "h0" }.into();
    gru.output.push("last".into());
    let flatten = graph.node[0].clone();
    let head = node("Gemm", &["y", "head.weight", "bias"], "logits", vec![int("transB", 1)]);
    graph.node = [vec![flatten], before, vec![gru], after, vec![head]].concat();
    let size = STATE as i64;
    graph.initializer.extend([
        integers("2", &[1], &[2]),
        integers("3", &[1], &[3]),
        integers("4", &[1], &[4]),
        integers("-1", &[1], &[-1]),
        integers("first", &[], &[0]),
        integers("last entry", &[], &[-1]),
        integers("1, -1, values", &[3], &[1, -1, size]),
        integers("-1, values", &[2], &[-1, size]),
        drawn("learned", &[1, 1, size], 9),
    ]);
    graph.input.push(value("flat state", &[0, size]));
    let mut reader = Reader::new(&graph)?;
    graph.node.iter().for_each(|node| reader.add(node));
    let (architecture, _) = reader.finish("logits", None)?;
    Ok(serde_json::to_value(architecture).unwrap())
}

/// The operators of PyTorch's exporters around a recurrent layer.
#[test]
fn operators_around_a_recurrent_layer_add_no_layer() {
    let time_first = || vec![node("Unsqueeze", &["flat", "0"], "x", vec![])];
    let batch_first = || {
        vec![
            node("Unsqueeze", &["flat", "1"], "batch first", vec![]),
            node("Transpose", &["batch first"], "x", vec![ints("perm", &[1, 0, 2])]),
        ]
    };
    let without_direction = || {
        vec![
            node("Transpose", &["states"], "moved", vec![ints("perm", &[0, 2, 1, 3])]),
            node("Reshape", &["moved", "1, -1, values"], "steps", vec![]),
        ]
    };
    let then = |nodes: Vec<Node>, more: Vec<Node>| [nodes, more].concat();
    // The graph computes the shape of `steps`: time, batch, and the number of directions times the size of the state.
    let computed = || {
        vec![
            node("Transpose", &["states"], "moved", vec![ints("perm", &[0, 2, 1, 3])]),
            node("Shape", &["moved"], "sizes", vec![int("start", 0)]),
            node("Slice", &["sizes", "0", "1"], "time", vec![]),
            node("Slice", &["sizes", "1", "2"], "batch", vec![]),
            node("Slice", &["sizes", "2", "3"], "directions", vec![]),
            node("Slice", &["sizes", "3", "4"], "size", vec![]),
            node("Mul", &["directions", "size"], "product", vec![]),
            node("Reshape", &["product", "-1"], "values", vec![]),
            node("Concat", &["time", "batch", "values"], "shape", vec![int("axis", 0)]),
            node("Reshape", &["moved", "shape"], "steps", vec![]),
        ]
    };
    let entry = |from: &str, entry: &str, axis| node("Gather", &[from, entry], "y", vec![int("axis", axis)]);
    let read = [
        (time_first(), then(without_direction(), vec![node("Squeeze", &["steps", "0"], "y", vec![])])),
        (time_first(), then(without_direction(), vec![entry("steps", "last entry", 0)])),
        (
            time_first(),
            then(without_direction(), vec![node("Flatten", &["steps"], "y", vec![int("axis", 2)])]),
        ),
        (
            time_first(),
            then(without_direction(), vec![node("Reshape", &["steps", "-1, values"], "y", vec![])]),
        ),
        (time_first(), vec![entry("last", "first", 0)]),
        (time_first(), vec![node("Squeeze", &["last", "0"], "y", vec![])]),
        (time_first(), vec![node("Squeeze", &["last"], "y", vec![])]),
        (
            batch_first(),
            then(
                computed(),
                vec![
                    node("Transpose", &["steps"], "back", vec![ints("perm", &[1, 0, 2])]),
                    node("Slice", &["back", "-1", "4", "1"], "last step", vec![]),
                    node("Squeeze", &["last step", "1"], "y", vec![]),
                ],
            ),
        ),
        (
            then(time_first(), vec![node("ConstantOfShape", &["-1"], "h", vec![])]),
            vec![entry("last", "first", 0)],
        ),
        (
            then(time_first(), vec![node("Slice", &["h0", "0", "1", "0"], "h", vec![])]),
            vec![entry("last", "first", 0)],
        ),
        (
            then(time_first(), vec![node("Unsqueeze", &["flat state", "0"], "h", vec![])]),
            vec![entry("last", "first", 0)],
        ),
    ];
    for (before, after) in read {
        let operators: Vec<_> = after.iter().map(|node| node.op_type.clone()).collect();
        let network = read_around(before, after).unwrap_or_else(|error| panic!("{operators:?}: {error}"));
        assert_eq!(network["layers"], json!(["flatten", {"gru": "layer-0"}]), "{operators:?}");
    }
}

#[test]
fn operators_that_mix_agents_or_change_the_initial_state_are_rejected() {
    let time_first = || vec![node("Unsqueeze", &["flat", "0"], "x", vec![])];
    let last = || vec![node("Squeeze", &["last", "0"], "y", vec![])];
    let of_agents = "operator `GRU` whose input does not have the shape (1, batch, features)";
    let of_state = "operator `GRU` whose initial state is neither zeros nor an input of the graph";
    let wrong = [
        // One sequence of all agents.
        (vec![node("Unsqueeze", &["flat", "1"], "x", vec![])], last(), of_agents),
        ([time_first(), vec![node("Expand", &["learned", "1"], "h", vec![])]].concat(), last(), of_state),
        ([time_first(), vec![node("Mul", &["h0", "h0"], "h", vec![])]].concat(), last(), of_state),
        // The state of the first agent for all agents.
        (
            time_first(),
            vec![
                node("Squeeze", &["last", "0"], "all", vec![]),
                node("Gather", &["all", "first"], "y", vec![int("axis", 0)]),
            ],
            "operator `Gather`",
        ),
        (time_first(), vec![node("Transpose", &["last"], "y", vec![])], "operator `Gemm`"),
        (time_first(), vec![node("Reshape", &["last", "1, -1, values"], "y", vec![])], "operator `Gemm`"),
    ];
    for (before, after, reason) in wrong {
        let error = read_around(before, after).unwrap_err();
        assert!(error.ends_with(&format!("a supported layer: {reason}")), "{error}");
    }
}
