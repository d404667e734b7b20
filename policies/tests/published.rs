//! The published networks return the recorded logits, in both formats.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::path::Path;

use pogema_policies::{Inputs, Network, RecurrentState};

/// Returns the logits of a batch, computed in parts of a given size.
fn logits(network: &Network, windows: &[f32], part: usize) -> Vec<f32> {
    let window: usize = network.input_shape().iter().product();
    let mut workspace = network.workspace();
    let parts = windows.chunks(part * window).map(|windows| {
        let batch = windows.len() / window;
        let inputs = Inputs { windows, scalars: &[], batch };
        let mut state = RecurrentState::new(network, batch);
        network.forward(inputs, &mut state, &mut workspace).unwrap().logits.to_vec()
    });
    parts.collect::<Vec<_>>().concat()
}

fn check(folder: &Path, name: &str, num_records: usize) {
    let network = Network::read(folder.join(format!("{name}.onnx"))).unwrap();
    let recorded = folder.join(format!("logits-{name}.npz"));
    let [windows, expected] = ["inputs", "logits"].map(|array| common::read_array(&recorded, array));
    let got = logits(&network, &windows, num_records);
    assert_eq!((got.len(), expected.len()), (5 * num_records, 5 * num_records));
    let worst = got.iter().zip(&expected).map(|(got, expected)| (got - expected).abs()).fold(0.0, f32::max);
    assert!(worst < 1e-4, "{name}: the largest difference is {worst}");
    for part in [1, 7, 16, 33] {
        assert!(logits(&network, &windows, part) == got, "{name}: a batch of {part} returns other bits");
    }
    let scratch = tempfile::tempdir().unwrap();
    let copy = scratch.path().join("copy.safetensors");
    Network::convert(folder.join(format!("{name}.onnx")), &copy).unwrap();
    assert!(logits(&Network::read(copy).unwrap(), &windows, num_records) == got, "{name}: the copy differs");
    assert!(network.has_value());
}

#[test]
fn follower_lite_returns_the_recorded_logits() {
    if let Some(folder) = common::weights("follower_lite_returns_the_recorded_logits") {
        check(&folder, "follower-lite", 2000);
    }
}

#[test]
fn cost_tracer_returns_the_recorded_logits() {
    if let Some(folder) = common::weights("cost_tracer_returns_the_recorded_logits") {
        check(&folder, "cost-tracer", 500);
    }
}
