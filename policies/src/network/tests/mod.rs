//! Compares networks of random layers with plain nested loops, and tests batches, SIMD paths and files.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

mod files;
mod plain;

use std::collections::BTreeMap;

use pogema_numpy::Generator;
use proptest::prelude::*;
use proptest::sample::select;

use super::tensors::Tensors;
use super::*;
use plain::{Plain, Values};

/// Draws floats between -1 and 1, with zeros among them.
struct Draws(Generator);

impl Draws {
    fn next(&mut self) -> f32 {
        let value = self.0.uniform(-1.0, 1.0).unwrap() as f32;
        if value.abs() < 0.1 { 0.0 } else { value }
    }

    fn list(&mut self, len: usize) -> Vec<f32> {
        (0..len).map(|_| self.next()).collect()
    }
}

/// A drawn network and its tensors.
struct Drawn {
    config: NetworkConfig,
    tensors: BTreeMap<String, (Vec<usize>, Vec<f32>)>,
}

/// Sizes of a drawn network.
#[derive(Clone, Debug)]
struct Sizes {
    window: [usize; 3],
    filters: usize,
    kernel: [usize; 2],
    padding: usize,
    /// For each residual block, whether its first activation is in place.
    blocks: Vec<bool>,
    activation: Layer,
    scalars: usize,
    hidden: usize,
    state: usize,
    has_value: bool,
}

fn sizes() -> impl Strategy<Value = Sizes> {
    let window = [1..5usize, 1..9usize, 1..16usize];
    let kernel = [1..4usize, 1..4usize].prop_flat_map(|kernel| (Just(kernel), 0..kernel[0].min(kernel[1])));
    let layers =
        (1..40usize, prop::collection::vec(any::<bool>(), 0..3), select(vec![Layer::Relu, Layer::Elu]));
    let lists = (0..4usize, 1..20usize, 0..20usize, any::<bool>());
    (window, kernel, layers, lists)
        .prop_filter("the kernel fits", |(window, (kernel, padding), ..)| {
            window[1] + 2 * padding >= kernel[0] && window[2] + 2 * padding >= kernel[1]
        })
        .prop_map(|(window, (kernel, padding), (filters, blocks, activation), lists)| {
            let (scalars, hidden, state, has_value) = lists;
            Sizes { window, filters, kernel, padding, blocks, activation, scalars, hidden, state, has_value }
        })
}

impl Sizes {
    fn draw(&self, seed: u64) -> Drawn {
        let mut draws = Draws(Generator::seeded(seed));
        let mut tensors = BTreeMap::new();
        let mut add = |name: String, shape: &[usize]| {
            // Sums of many terms stay in the range in which single precision is accurate to five digits.
            let scale = 1.0 / (shape[1..].iter().product::<usize>() as f32).sqrt();
            let values = draws.list(shape.iter().product()).into_iter().map(|value| value * scale).collect();
            tensors.insert(name, (shape.to_vec(), values));
        };
        let mut convolution = |name: String, channels: usize, kernel: [usize; 2], padding: usize| {
            add(format!("{name}.weight"), &[self.filters, channels, kernel[0], kernel[1]]);
            add(format!("{name}.bias"), &[self.filters]);
            Layer::Convolution { name, padding }
        };
        let mut layers = vec![convolution("first".into(), self.window[0], self.kernel, self.padding)];
        for (index, in_place) in self.blocks.iter().enumerate() {
            let mut inner: Vec<Layer> = ["a", "b"]
                .iter()
                .flat_map(|part| {
                    [self.activation.clone(), convolution(format!("{index}{part}"), self.filters, [3, 3], 1)]
                })
                .collect();
            if *in_place {
                layers.push(inner.remove(0));
            }
            layers.push(Layer::Residual(inner));
        }
        layers.extend([self.activation.clone(), Layer::Flatten]);
        let size = |axis: usize| self.window[axis + 1] + 2 * self.padding + 1 - self.kernel[axis];
        let mut len = self.filters * size(0) * size(1);
        let mut dense = |name: &str, [weight, bias]: [&str; 2], outputs: usize, inputs: usize| {
            add(format!("{name}.{weight}"), &[outputs, inputs]);
            add(format!("{name}.{bias}"), &[outputs]);
            Layer::Dense(name.into())
        };
        if self.scalars > 0 {
            let inner = dense("scalars", ["weight", "bias"], self.hidden, self.scalars);
            layers.push(Layer::Scalars(vec![inner, Layer::Relu]));
            len += self.hidden;
        }
        layers.extend([dense("hidden", ["weight", "bias"], self.hidden, len), self.activation.clone()]);
        len = self.hidden;
        if self.state > 0 {
            dense("core", ["weight_ih_l0", "bias_ih_l0"], 3 * self.state, len);
            dense("core", ["weight_hh_l0", "bias_hh_l0"], 3 * self.state, self.state);
            layers.push(Layer::Gru("core".into()));
            len = self.state;
        }
        dense("actions", ["weight", "bias"], 5, len);
        let value = self.has_value.then(|| "value".to_owned());
        if self.has_value {
            dense("value", ["weight", "bias"], 1, len);
        }
        let (window, scalars) = (self.window, self.scalars);
        let architecture = Architecture { window, scalars, layers, actions: "actions".into(), value };
        Drawn {
            config: NetworkConfig { architecture: Some(architecture), ..NetworkConfig::default() },
            tensors,
        }
    }
}

impl Drawn {
    fn tensors(&self) -> Tensors {
        let mut tensors = Tensors::default();
        for (name, (shape, values)) in &self.tensors {
            tensors.insert_values(name, shape.clone(), values.clone()).unwrap();
        }
        tensors
    }

    fn network(&self, path: SimdPath) -> Network {
        Network::new(self.config.clone(), &mut self.tensors(), path).unwrap()
    }
}

/// Plays two steps of a batch, one part after the other. Returns all outputs and the last state.
fn play(network: &Network, steps: [(&[f32], &[f32]); 2], batch: usize, part: usize) -> Vec<f32> {
    let window: usize = network.input_shape().iter().product();
    let scalars = network.num_scalars();
    let (mut outputs, mut workspace) = (vec![Vec::new(); 5], network.workspace());
    for first in (0..batch).step_by(part) {
        let agents = first..batch.min(first + part);
        let mut state = RecurrentState::new(network, agents.len());
        for (step, (windows, numbers)) in steps.into_iter().enumerate() {
            let inputs = Inputs {
                windows: &windows[agents.start * window..agents.end * window],
                scalars: &numbers[agents.start * scalars..agents.end * scalars],
                batch: agents.len(),
            };
            let got = network.forward(inputs, &mut state, &mut workspace).unwrap();
            outputs[2 * step].extend(got.logits);
            outputs[2 * step + 1].extend(got.values);
        }
        outputs[4].extend(state.values());
    }
    outputs.concat()
}

proptest! {
    #[test]
    fn networks_return_what_plain_loops_return(sizes in sizes(), seed: u64) {
        let drawn = sizes.draw(seed);
        let network = drawn.network(SimdPath::best());
        let mut draws = Draws(Generator::seeded(!seed));
        let windows = draws.list(2 * sizes.window.iter().product::<usize>());
        let scalars = draws.list(2 * sizes.scalars);
        let architecture = drawn.config.architecture.as_ref().unwrap();
        let mut plain = Plain { tensors: &drawn.tensors, scalars: Vec::new(), states: BTreeMap::new() };
        let mut state = RecurrentState::new(&network, 1);
        let mut workspace = network.workspace();
        // Two steps of one agent.
        for (step, window) in windows.chunks_exact(windows.len() / 2).enumerate() {
            let numbers = &scalars[step * sizes.scalars..][..sizes.scalars];
            let inputs = Inputs { windows: window, scalars: numbers, batch: 1 };
            let got = network.forward(inputs, &mut state, &mut workspace).unwrap();
            plain.scalars = numbers.iter().map(|value| f64::from(*value)).collect();
            let list = window.iter().map(|value| f64::from(*value)).collect();
            let last = plain.run(&architecture.layers, Values { window: Some(sizes.window), list }).list;
            let mut expected = plain.dense("actions", "weight", "bias", &last);
            if sizes.has_value {
                expected.extend(plain.dense("value", "weight", "bias", &last));
            }
            prop_assert_eq!(got.logits.len() + got.values.len(), expected.len());
            for (got, expected) in got.logits.iter().chain(got.values).zip(expected) {
                prop_assert!((f64::from(*got) - expected).abs() < 2e-5 * (1.0 + expected.abs()), "{} {}", got, expected);
            }
        }
    }

}

proptest! {
    // The scalar path is slow without an instruction for fused multiply-add.
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn batches_and_simd_do_not_change_a_bit(sizes in sizes(), seed: u64, batch in 1..40usize, part in 1..20usize) {
        let drawn = sizes.draw(seed);
        let mut draws = Draws(Generator::seeded(!seed));
        let mut step = || (draws.list(batch * sizes.window.iter().product::<usize>()), draws.list(batch * sizes.scalars));
        let steps = [step(), step()];
        let steps = [0, 1].map(|index| (&*steps[index].0, &*steps[index].1));
        let bits = |path: SimdPath, part: usize| -> Vec<u32> {
            play(&drawn.network(path), steps, batch, part).iter().map(|value| value.to_bits()).collect()
        };
        let expected = bits(SimdPath::Scalar, 1);
        for path in SimdPath::available() {
            prop_assert!(bits(path, part) == expected && bits(path, batch) == expected, "{:?}", path);
        }
    }
}

#[test]
fn a_forward_pass_allocates_nothing_after_the_first() {
    let sizes = Sizes {
        window: [3, 7, 7],
        filters: 12,
        kernel: [3, 3],
        padding: 1,
        blocks: vec![true, false],
        activation: Layer::Elu,
        scalars: 4,
        hidden: 9,
        state: 6,
        has_value: true,
    };
    let network = sizes.draw(1).network(SimdPath::best());
    for batch in [1, 5, 16, 50] {
        let (windows, scalars) = (vec![0.5; batch * 147], vec![0.25; batch * 4]);
        let inputs = Inputs { windows: &windows, scalars: &scalars, batch };
        let (mut state, mut workspace) = (RecurrentState::new(&network, batch), network.workspace());
        network.forward(inputs, &mut state, &mut workspace).unwrap();
        let run = || assert!(network.forward(inputs, &mut state, &mut workspace).is_ok());
        assert_eq!(allocation_counter::measure(run).count_total, 0, "batch {batch}");
    }
}

#[test]
fn wrong_inputs_are_rejected_and_wrong_lengths_do_not_change_the_state() {
    let sizes = Sizes {
        window: [1, 2, 2],
        filters: 1,
        kernel: [1, 1],
        padding: 0,
        blocks: vec![],
        activation: Layer::Relu,
        scalars: 0,
        hidden: 2,
        state: 2,
        has_value: false,
    };
    let network = sizes.draw(1).network(SimdPath::best());
    let (mut state, mut workspace) = (RecurrentState::new(&network, 2), network.workspace());
    let mut run = |state: &mut RecurrentState, windows: &[f32], scalars: &[f32], batch: usize| {
        let inputs = Inputs { windows, scalars, batch };
        network.forward(inputs, state, &mut workspace).map(|_| ()).unwrap_err().to_string()
    };
    assert_eq!(run(&mut state, &[0.0; 7], &[], 2), "the list of windows has length 7, expected 8");
    assert_eq!(run(&mut state, &[0.0; 8], &[0.0], 2), "the list of scalars has length 1, expected 0");
    assert_eq!(run(&mut state, &[0.0; 4], &[], 1), "the recurrent state has length 4, expected 2");
    assert_eq!(state, RecurrentState::new(&network, 2));
    let error = run(&mut state, &[0.0, 0.0, 0.0, 0.0, 0.0, f32::NAN, 0.0, 0.0], &[], 2);
    assert_eq!(error, "the logits or the value of agent 1 of the batch are not finite");
}
