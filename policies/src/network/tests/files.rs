//! Files that are truncated, unrelated or hostile.

use std::path::Path;

use serde_json::{Value, json};

use super::{Error, Inputs, Network, RecurrentState, SimdPath};
use crate::network::file;

const SHAPES: [(&str, &[usize]); 6] = [
    ("conv.weight", &[2, 1, 3, 3]),
    ("conv.bias", &[2]),
    ("core.weight", &[4, 18]),
    ("core.bias", &[4]),
    ("actions.weight", &[5, 4]),
    ("actions.bias", &[5]),
];

fn config() -> Value {
    json!({
        "version": 1,
        "architecture": {
            "window": [1, 3, 3],
            "layers": [{"convolution": {"name": "conv", "padding": 1}}, "relu", "flatten", {"dense": "core"}, "relu"],
            "actions": "actions",
        },
    })
}

/// Returns the bytes of a safetensors file whose header `change` has modified.
fn weights(change: impl FnOnce(&mut Value), value: f32) -> Vec<u8> {
    let (mut header, mut data) = (json!({}), Vec::new());
    for (name, shape) in SHAPES {
        let start = data.len();
        data.extend(value.to_le_bytes().repeat(shape.iter().product()));
        header[name] = json!({"dtype": "F32", "shape": shape, "data_offsets": [start, data.len()]});
    }
    change(&mut header);
    let header = header.to_string();
    [&(header.len() as u64).to_le_bytes(), header.as_bytes(), &data].concat()
}

fn read(config: &Value, weights: &[u8]) -> Result<Network, String> {
    let config = file::parse_config(config.to_string().as_bytes())?;
    let mut tensors = file::parse_tensors(weights)?;
    Network::new(config, &mut tensors, SimdPath::best())
}

#[track_caller]
fn rejects(config: &Value, weights: &[u8], expected: &str) {
    let error = read(config, weights).unwrap_err();
    assert!(error.contains(expected) && !error.contains('\n'), "{error}");
}

#[test]
fn a_valid_file_is_read() {
    let network = read(&config(), &weights(|_| {}, 0.5)).unwrap();
    assert_eq!((network.input_shape(), network.num_actions(), network.has_value()), ([1, 3, 3], 5, false));
}

#[test]
fn wrong_tensors_are_rejected_by_name() {
    let rename = |header: &mut Value, name: &str| {
        let tensor = header.as_object_mut().unwrap().remove("core.bias").unwrap();
        header[name] = tensor;
    };
    rejects(&config(), &weights(|header| rename(header, "other"), 0.5), "tensor `core.bias` is missing");
    rejects(&config(), &weights(|_| {}, f32::NAN), "value 0 is `NaN`, expected a finite number");
    rejects(&config(), &weights(|_| {}, f32::INFINITY), "value 0 is `inf`, expected a finite number");
    let reshape = |header: &mut Value| header["core.weight"]["shape"] = json!([18, 4]);
    let expected = "tensor `core.weight` has shape [18, 4], expected [any size, 18]";
    rejects(&config(), &weights(reshape, 0.5), expected);
    let retype = |header: &mut Value| header["core.weight"]["dtype"] = json!("I32");
    rejects(&config(), &weights(retype, 0.5), "tensor `core.weight` has type I32, expected F32");
    let mut shorter = config();
    shorter["architecture"]["layers"].as_array_mut().unwrap().truncate(3);
    rejects(
        &shorter,
        &weights(|_| {}, 0.5),
        "tensor `actions.weight` has shape [5, 4], expected [any size, 18]",
    );
    let mut twice = config();
    twice["architecture"]["layers"].as_array_mut().unwrap().push(json!({"dense": "core"}));
    rejects(&twice, &weights(|_| {}, 0.5), "tensor `core.weight` is missing or used by two layers");
    let mut without = config();
    without["architecture"]["layers"] = json!(["flatten"]);
    without["architecture"]["window"] = json!([1, 2, 2]);
    rejects(&without, &weights(|_| {}, 0.5), "belongs to no layer");
}

#[test]
fn an_error_about_weights_that_do_not_fit_their_config_names_both_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("w.safetensors");
    std::fs::write(&path, weights(|_| {}, 0.5)).unwrap();
    let mut config = config();
    config["architecture"]["layers"] = json!([]);
    std::fs::write(path.with_extension("json"), config.to_string()).unwrap();
    let expected = format!("{}: does not fit w.json: the layers end with a window", path.display());
    for error in
        [Network::read(&path).err(), Network::convert(&path, folder.path().join("to.safetensors")).err()]
    {
        let error = error.unwrap().to_string();
        assert!(error.starts_with(&expected), "{error}");
    }
}

#[test]
fn truncated_and_unrelated_files_are_rejected() {
    let whole = weights(|_| {}, 0.5);
    for len in 0..whole.len() {
        rejects(&config(), &whole[..len], "not a safetensors file: ");
    }
    rejects(&config(), b"PK\x03\x04 an archive of another program", "not a safetensors file: ");
    // A header that claims to have 16 exbibytes.
    rejects(&config(), &[&u64::MAX.to_le_bytes()[..], b"{}"].concat(), "not a safetensors file: ");
    let claim = |header: &mut Value| header["core.weight"]["shape"] = json!([u64::MAX, 18]);
    rejects(&config(), &weights(claim, 0.5), "not a safetensors file: ");
}

#[test]
fn wrong_configs_are_rejected() {
    let cases = [
        (json!({"version": 2}), "`version` is `2`, expected 1"),
        (json!({"architecture": {"window": [1, 3]}}), "invalid length 2"),
        (json!({"architecture": null}), "`architecture` is missing"),
        (json!({"encode": {}}), "unknown field `encode`"),
        (json!({"sampling": {"rule": "best"}}), "unknown variant `best`"),
    ];
    for (change, expected) in cases {
        let mut config = config();
        config.as_object_mut().unwrap().extend(change.as_object().unwrap().clone());
        rejects(&config, &weights(|_| {}, 0.5), expected);
    }
    let window = |window: Value, expected: &str| {
        let mut config = config();
        config["architecture"]["window"] = window;
        rejects(&config, &weights(|_| {}, 0.5), expected);
    };
    window(
        json!([1, 1_000_000, 1_000_000]),
        "the window has 1 channel, 1000000 rows and 1000000 columns, expected",
    );
    window(json!([u64::MAX, u64::MAX, u64::MAX]), "the window has");
    window(json!([0, 3, 3]), "the window has 0 channels");
    window(json!([1, 500, 500]), "tensor `core.weight` has shape [4, 18], expected [any size, 500000]");
    let layers = |layers: Value, expected: &str| {
        let mut config = config();
        config["architecture"]["layers"] = layers;
        rejects(&config, &weights(|_| {}, 0.5), expected);
    };
    layers(
        json!([{"convolution": {"name": "conv", "padding": 3}}]),
        "layer `conv`: padding 3 and a kernel of 3 × 3",
    );
    for padding in [4_000_000, u64::MAX] {
        let expected = format!("padding {padding} around the window of 3 rows and 3 columns is too wide");
        layers(json!([{"convolution": {"name": "conv", "padding": padding}}]), &expected);
    }
    layers(json!([{"dense": "core"}]), "layer `core` has a window as input, expected `flatten` before it");
    layers(json!(["flatten", {"scalars": []}]), "layer `scalars` has no input");
    layers(json!([]), "the layers end with a window");
    let deep = (0..40).fold(json!(["relu"]), |layers, _| json!([{"residual": layers}]));
    layers(deep, "nested more than 16 deep");
}

/// Creates a network; each tensor has the given value in all its entries.
fn filled(architecture: &Value, tensors: &[(&str, &[usize], f32)]) -> Result<Network, Error> {
    let config = json!({"version": 1, "architecture": architecture});
    let tensors = tensors
        .iter()
        .map(|(name, shape, value)| ((*name).into(), shape.to_vec(), vec![*value; shape.iter().product()]));
    Network::from_tensors(serde_json::from_value(config).unwrap(), tensors)
}

#[test]
fn too_many_scalars_are_rejected() {
    let layers = json!(["flatten", {"scalars": []}]);
    let architecture =
        json!({"window": [1, 3, 3], "scalars": u64::MAX - 4, "layers": layers, "actions": "a"});
    let tensors: [(&str, &[usize], f32); 2] = [("a.weight", &[5, 4], 0.0), ("a.bias", &[5], 0.0)];
    let error = filled(&architecture, &tensors).unwrap_err().to_string();
    assert_eq!(error, "network: `scalars` is 18446744073709551611, expected at most 4194304");
}

/// The tensors take a few kilobytes, but the values of the layers would take gigabytes.
#[test]
fn layers_that_hold_too_many_values_at_once_are_rejected() {
    let (mut layers, mut tensors) = (Vec::new(), Vec::new());
    let mut add = |name: String, shape: [usize; 4]| {
        layers.push(json!({"convolution": {"name": name, "padding": 0}}));
        tensors.push((format!("{name}.weight"), shape.to_vec(), vec![0.0; shape.iter().product()]));
        tensors.push((format!("{name}.bias"), vec![shape[0]], vec![0.0; shape[0]]));
    };
    // Planes with different numbers of channels share no buffer.
    for channels in 1..=20 {
        add(format!("more{channels}"), [channels, 1, 1, 1]);
        add(format!("fewer{channels}"), [1, channels, 1, 1]);
    }
    add("row".into(), [1, 1, 257, 1]);
    add("column".into(), [1, 1, 1, 257]);
    layers.push(json!("flatten"));
    tensors.push(("a.weight".into(), vec![5, 1], vec![0.0; 5]));
    tensors.push(("a.bias".into(), vec![5], vec![0.0; 5]));
    let architecture = json!({"window": [1, 257, 257], "layers": layers, "actions": "a"});
    let config = serde_json::from_value(json!({"version": 1, "architecture": architecture})).unwrap();
    let error = Network::from_tensors(config, tensors).unwrap_err().to_string();
    assert!(error.ends_with("values at once, expected at most 4194304"), "{error}");
}

#[test]
fn a_residual_adds_a_dense_output_to_a_joined_list_of_the_same_order() {
    let layers = json!(["flatten", {"scalars": []}, {"residual": [{"dense": "core"}]}]);
    let architecture = json!({"window": [1, 3, 3], "scalars": 2, "layers": layers, "actions": "a"});
    let tensors: [(&str, &[usize], f32); 4] = [
        ("core.weight", &[11, 11], 0.0),
        ("core.bias", &[11], 1.0),
        ("a.weight", &[5, 11], 1.0),
        ("a.bias", &[5], 0.0),
    ];
    let network = filled(&architecture, &tensors).unwrap();
    let (mut state, mut workspace) = (RecurrentState::new(&network, 1), network.workspace());
    let inputs = Inputs { windows: &[1.0; 9], scalars: &[2.0; 2], batch: 1 };
    let outputs = network.forward(inputs, &mut state, &mut workspace).unwrap();
    assert_eq!(outputs.logits, [9.0 * 2.0 + 2.0 * 3.0; 5]);
}

#[test]
fn a_residual_of_a_flattened_window_and_a_dense_output_is_rejected() {
    let layers = json!([
        {"convolution": {"name": "conv", "padding": 1}}, "flatten", {"residual": [{"dense": "core"}]},
    ]);
    let architecture = json!({"window": [1, 3, 3], "layers": layers, "actions": "a"});
    let tensors: [(&str, &[usize], f32); 4] = [
        ("conv.weight", &[2, 1, 3, 3], 1.0),
        ("conv.bias", &[2], 1.0),
        ("core.weight", &[18, 18], 1.0),
        ("core.bias", &[18], 1.0),
    ];
    let error = filled(&architecture, &tensors).unwrap_err().to_string();
    assert!(error.ends_with("expected `dense` between `flatten` and the sum"), "{error}");
}

#[test]
fn only_safetensors_files_are_written_and_an_error_changes_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, value: f32| {
        let tensors = SHAPES
            .map(|(name, shape)| (name.to_owned(), shape.to_vec(), vec![value; shape.iter().product()]));
        Network::write(folder.path().join(name), serde_json::from_value(config()).unwrap(), tensors)
    };
    for name in ["net.json", "net.onnx", "net"] {
        let error = write(name, 0.5).unwrap_err().to_string();
        assert!(error.ends_with("expected a file name that ends in .safetensors"), "{error}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    write("net.safetensors", 0.5).unwrap();
    let before = std::fs::read(folder.path().join("net.safetensors")).unwrap();
    std::fs::remove_file(folder.path().join("net.json")).unwrap();
    std::fs::create_dir(folder.path().join("net.json")).unwrap();
    let error = write("net.safetensors", 0.25).unwrap_err().to_string();
    assert!(error.ends_with("net.json: is not a regular file"), "{error}");
    assert!(std::fs::read(folder.path().join("net.safetensors")).unwrap() == before);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn a_missing_file_is_named() {
    let error = Network::read(Path::new("none/weights.safetensors")).unwrap_err().to_string();
    assert!(error.starts_with("none/weights.safetensors: "), "{error}");
}

#[test]
fn the_example_of_the_reference_page_parses_and_has_7_layers() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/reference/network.md");
    let page = std::fs::read_to_string(page).unwrap();
    let example = page.split("```json\n").nth(1).unwrap().split("```").next().unwrap();
    let config = file::parse_config(example.as_bytes()).unwrap();
    assert_eq!(config.architecture.unwrap().layers.len(), 7);
}
