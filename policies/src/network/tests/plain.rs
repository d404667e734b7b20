//! The layers as plain nested loops, in double precision.

use std::collections::BTreeMap;

use crate::network::Layer;

/// The values of an agent: channels of rows, or a list.
#[derive(Clone, Debug)]
pub struct Values {
    /// Shape: `(channels, rows, columns)`; `None` for a list, such as scalars or the values after `flatten`.
    pub window: Option<[usize; 3]>,
    pub list: Vec<f64>,
}

/// Plain layers with their tensors, for one agent.
pub struct Plain<'a> {
    pub tensors: &'a BTreeMap<String, (Vec<usize>, Vec<f32>)>,
    pub scalars: Vec<f64>,
    /// The states of the recurrent layers by name.
    pub states: BTreeMap<String, Vec<f64>>,
}

impl Plain<'_> {
    fn tensor(&self, name: &str) -> Vec<f64> {
        self.tensors[name].1.iter().map(|value| f64::from(*value)).collect()
    }

    pub fn run(&mut self, layers: &[Layer], mut values: Values) -> Values {
        for layer in layers {
            values = self.layer(layer, values);
        }
        values
    }

    fn layer(&mut self, layer: &Layer, mut values: Values) -> Values {
        match layer {
            Layer::Relu => values.list.iter_mut().for_each(|value| *value = value.max(0.0)),
            Layer::Elu => {
                values
                    .list
                    .iter_mut()
                    .filter(|value| **value < 0.0)
                    .for_each(|value| *value = value.exp() - 1.0);
            }
            Layer::Flatten => values.window = None,
            Layer::Residual(layers) => {
                let inner = self.run(layers, values.clone());
                values.list.iter_mut().zip(inner.list).for_each(|(value, inner)| *value += inner);
            }
            Layer::Scalars(layers) => {
                let scalars = Values { window: None, list: self.scalars.clone() };
                values.list.extend(self.run(layers, scalars).list);
            }
            Layer::Convolution { name, padding } => values = self.convolution(name, *padding, &values),
            Layer::Dense(name) => values.list = self.dense(name, "weight", "bias", &values.list),
            Layer::Gru(name) => values.list = self.gru(name, &values.list),
        }
        values
    }

    fn convolution(&self, name: &str, padding: usize, input: &Values) -> Values {
        let (weights, bias) = (self.tensor(&format!("{name}.weight")), self.tensor(&format!("{name}.bias")));
        let [outputs, _, height, width] = self.tensors[&format!("{name}.weight")].0[..] else { panic!() };
        let [channels, rows, cols] = input.window.unwrap();
        let window = [outputs, rows + 2 * padding + 1 - height, cols + 2 * padding + 1 - width];
        let mut list = Vec::new();
        for (out, bias) in bias.iter().enumerate() {
            for (row, col) in (0..window[1]).flat_map(|row| (0..window[2]).map(move |col| (row, col))) {
                let mut sum = *bias;
                for (tap, weight) in
                    weights[out * channels * height * width..][..channels * height * width].iter().enumerate()
                {
                    let (channel, down, right) = (tap / (height * width), tap / width % height, tap % width);
                    let (row, col) =
                        ((row + down).wrapping_sub(padding), (col + right).wrapping_sub(padding));
                    if row < rows && col < cols {
                        sum += weight * input.list[(channel * rows + row) * cols + col];
                    }
                }
                list.push(sum);
            }
        }
        Values { window: Some(window), list }
    }

    pub fn dense(&self, name: &str, weight: &str, bias: &str, input: &[f64]) -> Vec<f64> {
        let (weights, bias) =
            (self.tensor(&format!("{name}.{weight}")), self.tensor(&format!("{name}.{bias}")));
        let sums = weights
            .chunks_exact(input.len())
            .map(|row| row.iter().zip(input).map(|(a, b)| a * b).sum::<f64>());
        sums.zip(bias).map(|(sum, bias)| sum + bias).collect()
    }

    /// PyTorch's formula: `r = σ(x_r + h_r)`, `z = σ(x_z + h_z)`, `n = tanh(x_n + r h_n)`, `h' = (1 - z) n + z h`.
    fn gru(&mut self, name: &str, input: &[f64]) -> Vec<f64> {
        let size = self.tensors[&format!("{name}.weight_hh_l0")].0[1];
        let state = self.states.get(name).cloned().unwrap_or_else(|| vec![0.0; size]);
        let of_input = self.dense(name, "weight_ih_l0", "bias_ih_l0", input);
        let of_state = self.dense(name, "weight_hh_l0", "bias_hh_l0", &state);
        let sigmoid = |value: f64| 1.0 / (1.0 + (-value).exp());
        let next: Vec<f64> = (0..size)
            .map(|index| {
                let reset = sigmoid(of_input[index] + of_state[index]);
                let update = sigmoid(of_input[size + index] + of_state[size + index]);
                let new = (of_input[2 * size + index] + reset * of_state[2 * size + index]).tanh();
                (1.0 - update) * new + update * state[index]
            })
            .collect();
        self.states.insert(name.into(), next.clone());
        next
    }
}
