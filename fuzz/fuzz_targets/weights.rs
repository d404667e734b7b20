//! Fuzzes weights files: each is rejected with a one-line error, or its network runs.
#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use pogema_policies::{ForwardError, Inputs, Network, RecurrentState};

/// A folder of this process.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = std::env::temp_dir().join(format!("pogema-fuzz-weights-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    folder
});

/// Networks with more window values or more scalars are not run, so that each input takes milliseconds.
const MAX_VALUES: usize = 10_000;

// The first byte chooses the format. For safetensors, a zero byte ends the JSON.
fuzz_target!(|input: &[u8]| {
    let Some((format, rest)) = input.split_first() else { return };
    let path = if format % 2 == 0 {
        let end = rest.iter().position(|byte| *byte == 0).unwrap_or(rest.len());
        let (json, weights) = rest.split_at(end);
        std::fs::write(FOLDER.join("network.json"), json).expect("a file");
        let path = FOLDER.join("network.safetensors");
        std::fs::write(&path, weights.get(1..).unwrap_or_default()).expect("a file");
        path
    } else {
        let _ = std::fs::remove_file(FOLDER.join("network.json"));
        let path = FOLDER.join("network.onnx");
        std::fs::write(&path, rest).expect("a file");
        path
    };
    match Network::read(&path) {
        Err(error) => assert!(!error.to_string().contains(char::is_control)),
        Ok(network) => run(&network),
    }
});

/// Runs a batch of one agent and a batch of 16; both give the first agent the same logits, bit for bit, or both fail.
fn run(network: &Network) {
    let window: usize = network.input_shape().iter().product();
    if window > MAX_VALUES || network.num_scalars() > MAX_VALUES {
        return;
    }
    let mut workspace = network.workspace();
    let mut logits = |batch: usize| -> Result<Vec<u32>, ForwardError> {
        let (windows, scalars) = (vec![0.5; batch * window], vec![-0.25; batch * network.num_scalars()]);
        let inputs = Inputs { windows: &windows, scalars: &scalars, batch };
        let outputs = network.forward(inputs, &mut RecurrentState::new(network, batch), &mut workspace)?;
        Ok(outputs.logits[..network.num_actions()].iter().map(|logit| logit.to_bits()).collect())
    };
    assert_eq!(logits(1).ok(), logits(16).ok());
}
