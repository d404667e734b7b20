//! Layers with their weights, packed for the kernels.

use pogema_core::SimdPath;

use super::tensors::{Tensor, Tensors};
use crate::simd::{self, BLOCK, Convolve, LANES, Multiply, MultiplyAgents, Plane, Shape};

/// An activation function, applied to each value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activation {
    Relu,
    Elu,
}

impl Activation {
    pub fn apply(self, values: &mut [f32]) {
        match self {
            Self::Relu => values.iter_mut().for_each(|value| *value = simd::relu(*value)),
            Self::Elu => {
                for value in values.iter_mut().filter(|value| **value <= 0.0) {
                    *value = libm::expm1f(*value);
                }
            }
        }
    }
}

/// A convolution with stride 1.
#[derive(Debug)]
pub struct Convolution {
    pub shape: Shape,
    weights: Vec<f32>,
    bias: Vec<f32>,
}

impl Convolution {
    /// Takes the tensors of a layer and packs them for an input.
    pub fn take(tensors: &mut Tensors, name: &str, padding: usize, input: Plane) -> Result<Self, String> {
        let weight = tensors.take(&format!("{name}.weight"), &[None, Some(input.channels), None, None])?;
        let [outputs, _, rows, cols] = weight.shape[..] else { unreachable!("the shape was checked") };
        let bias = tensors.take(&format!("{name}.bias"), &[Some(outputs)])?;
        let size = |input: usize, kernel: usize| {
            let padded = padding.checked_mul(2)?.checked_add(input)?;
            (padding < kernel).then_some(())?;
            (padded + 1).checked_sub(kernel).filter(|size| *size > 0)
        };
        let (Some(out_rows), Some(out_cols)) = (size(input.rows, rows), size(input.cols, cols)) else {
            return Err(format!(
                "layer `{name}`: padding {padding} and a kernel of {rows} × {cols} do not fit an input of {} × {}",
                input.rows, input.cols
            ));
        };
        let stride = outputs.next_multiple_of(LANES);
        let output =
            Plane { rows: out_rows, cols: out_cols, channels: outputs, stride, margin: input.margin };
        let shape = Shape { input, output, kernel: [rows, cols], padding };
        Ok(Self { weights: pack_kernel(&weight, &shape), bias: pad(bias.values, stride), shape })
    }

    pub fn run(&self, path: SimdPath, input: &[f32], added: Option<&[f32]>, relu: bool, output: &mut [f32]) {
        let Self { shape, weights, bias } = self;
        simd::convolve(path, Convolve { input, output, added, weights, bias, shape: *shape, relu });
    }

    /// Runs the layer for 8 or 16 agents whose values lie side by side.
    pub fn run_agents(
        &self,
        path: SimdPath,
        input: &[f32],
        added: Option<&[f32]>,
        relu: bool,
        output: &mut [f32],
    ) {
        let Self { shape, weights, bias } = self;
        simd::convolve_agents(path, Convolve { input, output, added, weights, bias, shape: *shape, relu });
    }
}

/// Arranges the weights in the order in which the kernels read them; the channels that pad a block have weights of 0.
fn pack_kernel(weight: &Tensor, shape: &Shape) -> Vec<f32> {
    let Shape { input, output, kernel: [rows, cols], .. } = *shape;
    let mut packed = Vec::with_capacity(rows * cols * input.channels * output.stride);
    for first in (0..output.stride).step_by(BLOCK) {
        for (tap, channel) in
            (0..rows * cols).flat_map(|tap| (0..input.channels).map(move |channel| (tap, channel)))
        {
            let outputs = first..output.stride.min(first + BLOCK);
            packed.extend(outputs.map(|out| {
                let index = (out * input.channels + channel) * rows * cols + tap;
                if out < output.channels { weight.values[index] } else { 0.0 }
            }));
        }
    }
    packed
}

fn pad(mut values: Vec<f32>, length: usize) -> Vec<f32> {
    values.resize(length, 0.0);
    values
}

/// A part of a list of values, in the channels-last order of the kernels. PyTorch's order is channels-first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece {
    pub pixels: usize,
    pub channels: usize,
}

impl Piece {
    pub fn len(&self) -> usize {
        self.pixels * self.channels
    }
}

/// A list of values of an agent.
#[derive(Clone, Debug, PartialEq)]
pub struct Flat {
    pub pieces: Vec<Piece>,
}

impl Flat {
    /// Creates a list of pieces. Adjacent pieces that are already in PyTorch's order become one.
    pub fn new(pieces: Vec<Piece>) -> Self {
        let mut merged: Vec<Piece> = Vec::with_capacity(pieces.len());
        for piece in pieces {
            let is_list = piece.pixels == 1 || piece.channels == 1;
            let piece = if is_list { Piece { pixels: 1, channels: piece.len() } } else { piece };
            match merged.last_mut() {
                Some(last) if is_list && last.pixels == 1 => last.channels += piece.channels,
                _ => merged.push(piece),
            }
        }
        Self { pieces: merged }
    }

    pub fn len(&self) -> usize {
        self.pieces.iter().map(Piece::len).sum()
    }

    /// Returns the number of floats between two agents.
    pub fn stride(&self) -> usize {
        self.len().next_multiple_of(LANES)
    }
}

/// A dense layer.
#[derive(Debug)]
pub struct Dense {
    pub num_inputs: usize,
    pub num_outputs: usize,
    weights: Vec<f32>,
    bias: Vec<f32>,
}

impl Dense {
    /// Takes the tensors of a layer and packs them for an input that consists of these pieces.
    pub fn take(tensors: &mut Tensors, names: [&str; 2], input: &[Piece]) -> Result<Self, String> {
        let num_inputs = input.iter().map(Piece::len).sum();
        let weight = tensors.take(names[0], &[None, Some(num_inputs)])?;
        let bias = tensors.take(names[1], &[Some(weight.shape[0])])?;
        Ok(Self::new(&weight.values, bias.values, input))
    }

    fn new(weights: &[f32], bias: Vec<f32>, input: &[Piece]) -> Self {
        let num_inputs: usize = input.iter().map(Piece::len).sum();
        let num_outputs = bias.len();
        let stride = num_outputs.next_multiple_of(LANES);
        let mut packed = Vec::with_capacity(stride * num_inputs);
        for first in (0..stride).step_by(LANES) {
            let mut start = 0;
            for piece in input {
                for index in 0..piece.len() {
                    let (pixel, channel) = (index / piece.channels, index % piece.channels);
                    let column = start + channel * piece.pixels + pixel;
                    packed.extend(
                        (first..first + LANES).map(|out| {
                            if out < num_outputs { weights[out * num_inputs + column] } else { 0.0 }
                        }),
                    );
                }
                start += piece.len();
            }
        }
        Self { num_inputs, num_outputs, weights: packed, bias: pad(bias, stride) }
    }

    /// Takes the heads as one layer: the logits, then the value. Returns the layer and the number of logits.
    pub fn take_heads(
        tensors: &mut Tensors,
        actions: &str,
        value: Option<&str>,
        input: &[Piece],
    ) -> Result<(Self, usize), String> {
        let num_inputs = input.iter().map(Piece::len).sum();
        let mut weight = tensors.take(&format!("{actions}.weight"), &[None, Some(num_inputs)])?;
        let num_actions = weight.shape[0];
        let mut bias = tensors.take(&format!("{actions}.bias"), &[Some(num_actions)])?;
        if let Some(value) = value {
            weight
                .values
                .extend(tensors.take(&format!("{value}.weight"), &[Some(1), Some(num_inputs)])?.values);
            bias.values.extend(tensors.take(&format!("{value}.bias"), &[Some(1)])?.values);
        }
        Ok((Self::new(&weight.values, bias.values, input), num_actions))
    }

    /// Returns the number of floats between the outputs of two rows.
    pub fn stride(&self) -> usize {
        self.bias.len()
    }

    pub fn run(&self, path: SimdPath, num_rows: usize, input: Rows<'_>, relu: bool, output: &mut [f32]) {
        let Self { num_inputs, weights, bias, .. } = self;
        let Rows { values: input, stride: input_stride } = input;
        let num_inputs = *num_inputs;
        simd::multiply(
            path,
            Multiply { input, output, weights, bias, num_inputs, input_stride, num_rows, relu },
        );
    }

    /// Runs the layer for 8 or 16 agents whose values lie side by side.
    pub fn run_agents(&self, path: SimdPath, input: &[f32], relu: bool, output: &mut [f32]) {
        let Self { weights, bias, .. } = self;
        simd::multiply_agents(path, MultiplyAgents { input, output, weights, bias, relu });
    }
}

/// Rows of values. Each begins `stride` values after the previous one.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a> {
    pub values: &'a [f32],
    pub stride: usize,
}
