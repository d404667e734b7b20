//! Networks against plain nested loops.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use proptest::prelude::*;
use proptest::sample::select;

use super::tensors::Tensors;
use super::*;

/// Draws floats between -1 and 1, with zeros among them.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let value = (self.0 >> 40) as f32 / (1 << 23) as f32 - 1.0;
        if value.abs() < 0.1 { 0.0 } else { value }
    }

    fn list(&mut self, len: usize) -> Vec<f32> {
        (0..len).map(|_| self.next()).collect()
    }
}

fn insert(tensors: &mut Tensors, name: &str, shape: &[usize], values: &[f32]) {
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    tensors.insert(name, shape, &bytes).unwrap();
}

/// A window of channels of rows.
#[derive(Clone, Debug)]
struct Image {
    shape: [usize; 3],
    values: Vec<f64>,
}

/// A convolution as its definition says it.
fn convolve(input: &Image, weights: &[f32], bias: &[f32], kernel: [usize; 2], padding: usize) -> Image {
    let [channels, rows, cols] = input.shape;
    let shape = [bias.len(), rows + 2 * padding + 1 - kernel[0], cols + 2 * padding + 1 - kernel[1]];
    let mut values = Vec::new();
    for out in 0..shape[0] {
        for (row, col) in (0..shape[1]).flat_map(|row| (0..shape[2]).map(move |col| (row, col))) {
            let mut sum = f64::from(bias[out]);
            for channel in 0..channels {
                for (down, right) in
                    (0..kernel[0]).flat_map(|down| (0..kernel[1]).map(move |right| (down, right)))
                {
                    let (row, col) =
                        ((row + down).wrapping_sub(padding), (col + right).wrapping_sub(padding));
                    if row < rows && col < cols {
                        let weight =
                            weights[((out * channels + channel) * kernel[0] + down) * kernel[1] + right];
                        sum += f64::from(weight) * input.values[(channel * rows + row) * cols + col];
                    }
                }
            }
            values.push(sum);
        }
    }
    Image { shape, values }
}

fn dense(input: &[f64], weights: &[f32], bias: &[f32]) -> Vec<f64> {
    let products =
        weights.chunks_exact(input.len()).map(|row| row.iter().zip(input).map(|(a, b)| f64::from(*a) * b));
    products.zip(bias).map(|(products, bias)| products.sum::<f64>() + f64::from(*bias)).collect()
}

proptest! {
    #[test]
    fn a_convolution_equals_its_definition(
        seed: u64, channels in 1..20usize, outputs in 1..40usize, rows in 1..9usize, cols in 1..16usize,
        kernel in [1..4usize, 1..4usize], padding in 0..3usize, batch in select(vec![1usize, 2, 5, 16, 23]),
    ) {
        prop_assume!(padding < kernel[0].min(kernel[1]));
        prop_assume!(rows + 2 * padding >= kernel[0] && cols + 2 * padding >= kernel[1]);
        let mut draws = Draws(seed);
        let weights = draws.list(outputs * channels * kernel[0] * kernel[1]);
        let bias = draws.list(outputs);
        let windows = draws.list(batch * channels * rows * cols);
        let num_features = outputs * (rows + 2 * padding + 1 - kernel[0]) * (cols + 2 * padding + 1 - kernel[1]);
        let (head, head_bias) = (draws.list(3 * num_features), draws.list(3));
        let mut tensors = Tensors::default();
        insert(&mut tensors, "conv.weight", &[outputs, channels, kernel[0], kernel[1]], &weights);
        insert(&mut tensors, "conv.bias", &[outputs], &bias);
        insert(&mut tensors, "head.weight", &[3, num_features], &head);
        insert(&mut tensors, "head.bias", &[3], &head_bias);
        let layers = vec![Layer::Convolution { name: "conv".into(), padding }, Layer::Relu, Layer::Flatten];
        let architecture = Architecture { window: [channels, rows, cols], scalars: 0, layers, actions: "head".into(), value: None };
        let config = NetworkConfig { version: 1, architecture: Some(architecture), encoder: None, sampling: SamplingConfig::default() };
        let mut all = Vec::new();
        for path in Path::available() {
            let network = Network::new(config.clone(), &mut tensors.clone(), path).unwrap();
            let mut state = RecurrentState::new(&network, batch);
            let mut workspace = network.workspace();
            let inputs = Inputs { windows: &windows, scalars: &[], batch };
            all.push(network.forward(inputs, &mut state, &mut workspace).unwrap().logits.to_vec());
        }
        for window in 0..batch {
            let values = windows[window * channels * rows * cols..][..channels * rows * cols].iter();
            let image = Image { shape: [channels, rows, cols], values: values.map(|value| f64::from(*value)).collect() };
            let mut out = convolve(&image, &weights, &bias, kernel, padding).values;
            out.iter_mut().for_each(|value| *value = value.max(0.0));
            for (got, want) in all[0][3 * window..].iter().zip(dense(&out, &head, &head_bias)) {
                prop_assert!((f64::from(*got) - want).abs() < 1e-5 * num_features as f64, "{got} {want}");
            }
        }
        prop_assert!(all.iter().all(|logits| *logits == all[0]));
    }
}
