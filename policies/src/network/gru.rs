//! The gated recurrent unit, with PyTorch's formula.

use pogema_core::{SimdPath, counted};

use super::layers::{Dense, Piece, Rows};
use super::tensors::Tensors;

/// A recurrent layer.
///
/// Source: <https://docs.pytorch.org/docs/stable/generated/torch.nn.GRU.html>
#[derive(Debug)]
pub struct Gru {
    pub size: usize,
    of_input: Dense,
    of_state: Dense,
}

impl Gru {
    pub fn take(tensors: &mut Tensors, name: &str, input: &[Piece]) -> Result<Self, String> {
        let names = |kind: &str| [format!("{name}.weight_{kind}_l0"), format!("{name}.bias_{kind}_l0")];
        let [weight, bias] = names("ih");
        let of_input = Dense::take(tensors, [&weight, &bias], input)?;
        let size = of_input.num_outputs / 3;
        let [state_weight, bias] = names("hh");
        let of_state = Dense::take(tensors, [&state_weight, &bias], &[Piece { pixels: 1, channels: size }])?;
        if size == 0 || of_input.num_outputs % 3 != 0 || of_state.num_outputs != 3 * size {
            return Err(format!(
                "tensors `{weight}` and `{state_weight}` have {} and {}, expected three rows for each value of the state",
                counted(of_input.num_outputs, "row"),
                counted(of_state.num_outputs, "row")
            ));
        }
        Ok(Self { size, of_input, of_state })
    }

    /// Returns the number of floats of scratch space for a row.
    pub fn scratch(&self) -> usize {
        self.of_input.stride() + self.of_state.stride()
    }

    /// Runs a step for several rows. Their states have `size` values each, starting at `states.values[offset]`. The new
    /// state is also the output.
    pub fn run(
        &self,
        path: SimdPath,
        num_rows: usize,
        input: Rows<'_>,
        states: &mut States<'_>,
        output: Output<'_>,
    ) {
        let (of_input, of_state) = output.scratch.split_at_mut(num_rows * self.of_input.stride());
        let state = Rows { values: &states.values[states.offset..], stride: states.stride };
        self.of_input.run(path, num_rows, input, false, of_input);
        self.of_state.run(path, num_rows, state, false, of_state);
        for row in 0..num_rows {
            let of_input = &of_input[row * self.of_input.stride()..];
            let of_state = &of_state[row * self.of_state.stride()..];
            let state = &mut states.values[row * states.stride + states.offset..][..self.size];
            for (index, value) in state.iter_mut().enumerate() {
                let gate =
                    |gate: usize| (of_input[gate * self.size + index], of_state[gate * self.size + index]);
                *value = next([0, 1, 2].map(gate), *value);
            }
            output.values[row * output.stride..][..self.size].copy_from_slice(state);
        }
    }

    /// Runs a step of 8 or 16 agents whose values lie side by side. `state` is also the output.
    pub fn run_agents(&self, path: SimdPath, input: &[f32], state: &mut [f32], scratch: &mut [f32]) {
        let num_values = state.len();
        let (of_input, rest) = scratch.split_at_mut(3 * num_values);
        let of_state = &mut rest[..3 * num_values];
        self.of_input.run_agents(path, input, false, of_input);
        self.of_state.run_agents(path, state, false, of_state);
        for (index, value) in state.iter_mut().enumerate() {
            let gate =
                |gate: usize| (of_input[gate * num_values + index], of_state[gate * num_values + index]);
            *value = next([0, 1, 2].map(gate), *value);
        }
    }
}

/// Returns the next value of a state from what the input and the state add to each gate.
fn next(
    [(reset, reset_state), (update, update_state), (new, new_state)]: [(f32, f32); 3],
    value: f32,
) -> f32 {
    let reset = sigmoid(reset + reset_state);
    let update = sigmoid(update + update_state);
    let new = libm::tanhf(new + reset * new_state);
    (1.0 - update) * new + update * value
}

/// The states of several rows. Each begins `stride` values after the previous one.
pub struct States<'a> {
    pub values: &'a mut [f32],
    pub stride: usize,
    /// The offset of this layer's state in the state of a row.
    pub offset: usize,
}

/// The buffer for the outputs of several rows, and scratch space. Each row begins `stride` values after the previous
/// one.
pub struct Output<'a> {
    pub values: &'a mut [f32],
    pub stride: usize,
    pub scratch: &'a mut [f32],
}

fn sigmoid(value: f32) -> f32 {
    1.0 / (1.0 + libm::expf(-value))
}
