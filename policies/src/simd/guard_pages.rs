//! Tests that no kernel reads or writes beyond its slices: an access to a guard page beside them ends the process.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use super::guarded::{Guarded, Side};
use super::*;

/// Memory for each slice of a job.
struct Memory([Guarded; 5]);

impl Memory {
    fn new() -> Self {
        Self(std::array::from_fn(|_| Guarded::new(32)))
    }

    /// Returns slices of these lengths, each next to a guard page and filled with varying values.
    fn slices(&mut self, side: Side, lens: [usize; 5]) -> [&mut [f32]; 5] {
        let mut lens = lens.into_iter();
        self.0.each_mut().map(|memory| {
            let slice = memory.slice(side, lens.next().unwrap(), 0.0_f32);
            for (index, value) in slice.iter_mut().enumerate() {
                *value = (index as f32 * 1.3).sin();
            }
            slice
        })
    }
}

/// Runs a kernel on every path with its slices next to each guard page in turn, and compares the outputs with those of
/// the scalar path. `lens` holds the lengths of the output, the input, the added values, the weights and the bias.
fn check(lens: [usize; 5], memory: &mut Memory, run: &dyn Fn(SimdPath, [&mut [f32]; 5])) {
    for side in [Side::Start, Side::End] {
        let mut expected: Option<Vec<f32>> = None;
        for path in SimdPath::available() {
            let [output, input, added, weights, bias] = memory.slices(side, lens);
            run(path, [&mut *output, input, added, weights, bias]);
            let expected = expected.get_or_insert_with(|| output.to_vec());
            assert_eq!(output, expected, "{path}, {lens:?} at the {side:?}");
        }
    }
}

fn plane(rows: usize, cols: usize, channels: usize, margin: usize) -> Plane {
    Plane { rows, cols, channels, stride: channels.next_multiple_of(LANES), margin }
}

/// Shapes with every remainder that the kernels handle separately.
fn shapes() -> impl Iterator<Item = Shape> {
    let sizes = [(1, 1), (3, 5), (7, 7), (2, 13)];
    let kernels = [([1, 1], 0), ([3, 3], 1), ([2, 3], 1), ([1, 2], 0)];
    let channels = [(1, 1), (2, 8), (3, 9), (8, 16), (9, 25)];
    let all = sizes.into_iter().flat_map(move |size| kernels.map(|kernel| (size, kernel)));
    all.filter(|((rows, cols), (kernel, padding))| {
        rows + 2 * padding >= kernel[0] && cols + 2 * padding >= kernel[1]
    })
    .flat_map(move |case| channels.map(|channels| (case, channels)))
    .map(|(((rows, cols), (kernel, padding)), (inputs, outputs))| {
        let [out_rows, out_cols] = [rows + 2 * padding + 1 - kernel[0], cols + 2 * padding + 1 - kernel[1]];
        let (input, output) = (plane(rows, cols, inputs, 1), plane(out_rows, out_cols, outputs, 1));
        Shape { input, output, kernel, padding }
    })
}

fn num_weights(shape: &Shape) -> usize {
    shape.kernel[0] * shape.kernel[1] * shape.input.channels * shape.output.stride
}

#[test]
fn convolutions_stay_inside_their_slices() {
    let mut memory = Memory::new();
    for shape in shapes() {
        let (input, output) = (shape.input, shape.output);
        let bias = output.stride;
        for is_added in [false, true] {
            let relu = is_added;
            let lens = [output.len(), input.len(), output.len(), num_weights(&shape), bias];
            check(lens, &mut memory, &|path, [output, input, added, weights, bias]| {
                let added = is_added.then_some(&*added);
                convolve(path, Convolve { input, output, added, weights, bias, shape, relu });
            });
            for num_agents in [HALF, AGENTS] {
                let num_outputs = output.num_values() * num_agents;
                let lens =
                    [num_outputs, input.num_values() * num_agents, num_outputs, num_weights(&shape), bias];
                check(lens, &mut memory, &|path, [output, input, added, weights, bias]| {
                    let added = is_added.then_some(&*added);
                    convolve_agents(path, Convolve { input, output, added, weights, bias, shape, relu });
                });
            }
        }
    }
}

#[test]
fn dense_layers_stay_inside_their_slices() {
    let mut memory = Memory::new();
    for num_inputs in [1, 2, 3, 4, 5, 17, 64] {
        for num_outputs in [1, 5, 8, 9, 16, 24_usize] {
            let bias = num_outputs.next_multiple_of(LANES);
            let weights = bias * num_inputs;
            for (num_rows, gap) in [(1, 0), (2, 3), (3, 0), (4, 1), (7, 0)] {
                let input_stride = num_inputs + gap;
                let inputs = (num_rows - 1) * input_stride + num_inputs;
                let lens = [num_rows * bias, inputs, 0, weights, bias];
                check(lens, &mut memory, &|path, [output, input, _, weights, bias]| {
                    let relu = gap > 0;
                    multiply(
                        path,
                        Multiply { input, output, weights, bias, num_inputs, input_stride, num_rows, relu },
                    );
                });
            }
            for num_agents in [HALF, AGENTS] {
                let lens = [num_outputs * num_agents, num_inputs * num_agents, 0, weights, bias];
                check(lens, &mut memory, &|path, [output, input, _, weights, bias]| {
                    multiply_agents(path, MultiplyAgents { input, output, weights, bias, relu: false });
                });
            }
        }
    }
}
