//! The steps of a network and their execution.

use pogema_core::SimdPath;

use super::gru::{Gru, Output, States};
use super::layers::{Activation, Convolution, Dense, Flat, Rows};
use crate::simd::{BLOCK, Plane};

/// The largest number of agents that are computed one after the other.
pub const MAX_AGENTS_ONE_BY_ONE: usize = 12;

/// A step on the windows of one agent, or of 8 or 16 agents side by side. Numbers are slots of the buffers.
#[derive(Debug)]
pub enum PlaneStep {
    Convolve {
        convolution: Convolution,
        input: usize,
        added: Option<usize>,
        relu: bool,
        output: usize,
    },
    Activate {
        activation: Activation,
        input: usize,
        output: usize,
    },
    Add {
        inputs: [usize; 2],
        output: usize,
    },
    /// Writes a window to a list, pixel by pixel.
    Flatten {
        input: usize,
        output: usize,
    },
}

/// A step on the lists of a chunk of agents.
#[derive(Debug)]
pub enum FlatStep {
    Dense { dense: Dense, input: usize, relu: bool, output: usize },
    Activate { activation: Activation, input: usize, output: usize },
    Add { inputs: [usize; 2], output: usize },
    Gru { gru: Gru, input: usize, offset: usize, output: usize },
    Scalars { output: usize },
    Join { inputs: [usize; 2], output: usize },
}

/// The layers of a network as a list of steps. Slot 0 of the planes is the window.
#[derive(Debug, Default)]
pub struct LayerSteps {
    pub planes: Vec<Plane>,
    pub flats: Vec<Flat>,
    pub of_planes: Vec<PlaneStep>,
    pub of_flats: Vec<FlatStep>,
    pub num_scalars: usize,
    pub state_size: usize,
}

/// The heads of a network: the logits, then the value if there is one, as one layer.
#[derive(Debug)]
pub struct Heads {
    pub dense: Dense,
    /// The list that is their input.
    pub input: usize,
    pub num_actions: usize,
}

/// The inputs of a chunk of agents, laid out as in [`super::Inputs`].
#[derive(Clone, Copy, Debug)]
pub struct Chunk<'a> {
    pub num_agents: usize,
    pub windows: &'a [f32],
    pub scalars: &'a [f32],
}

impl LayerSteps {
    /// Returns the number of values of an agent in all buffers.
    pub fn num_values(&self) -> usize {
        let planes = self.planes.iter().map(Plane::len);
        let flats = self.flats.iter().map(Flat::stride);
        planes.chain(flats).sum::<usize>() + self.state_size + self.scratch()
    }

    /// Computes all lists of a chunk of agents.
    pub fn run(&self, path: SimdPath, chunk: Chunk<'_>, states: &mut [f32], buffers: &mut Buffers) {
        let num_values = chunk.windows.len() / chunk.num_agents;
        for (agent, window) in chunk.windows.chunks_exact(num_values).enumerate() {
            load(&self.planes[0], window, &mut buffers.planes[0]);
            for step in &self.of_planes {
                self.run_planes(path, step, agent, buffers);
            }
        }
        for step in &self.of_flats {
            self.run_flats(path, step, chunk, states, buffers);
        }
    }

    fn run_planes(&self, path: SimdPath, step: &PlaneStep, agent: usize, buffers: &mut Buffers) {
        let Buffers { planes, flats, .. } = buffers;
        match step {
            PlaneStep::Convolve { convolution, input, added, relu, output } => {
                write(planes, *output, |planes, to| {
                    let added = added.map(|slot| &*planes[slot]);
                    convolution.run(path, &planes[*input], added, *relu, to);
                });
            }
            PlaneStep::Activate { activation, input, output } => write(planes, *output, |planes, to| {
                to.copy_from_slice(&planes[*input]);
                activation.apply(to);
            }),
            PlaneStep::Add { inputs, output } => {
                write(planes, *output, |planes, to| add(planes, *inputs, to));
            }
            PlaneStep::Flatten { input, output } => {
                let flat = &self.flats[*output];
                let to = &mut flats[*output][agent * flat.stride()..][..flat.len()];
                store(&self.planes[*input], &planes[*input], to);
            }
        }
    }

    fn run_flats(
        &self,
        path: SimdPath,
        step: &FlatStep,
        chunk: Chunk<'_>,
        states: &mut [f32],
        buffers: &mut Buffers,
    ) {
        let Buffers { flats, scratch, .. } = buffers;
        let num_agents = chunk.num_agents;
        match step {
            FlatStep::Dense { dense, input, relu, output } => write(flats, *output, |flats, to| {
                dense.run(path, num_agents, self.rows(*input, flats), *relu, to);
            }),
            FlatStep::Activate { activation, input, output } => write(flats, *output, |flats, to| {
                to.copy_from_slice(&flats[*input]);
                activation.apply(to);
            }),
            FlatStep::Add { inputs, output } => write(flats, *output, |flats, to| add(flats, *inputs, to)),
            FlatStep::Gru { gru, input, offset, output } => write(flats, *output, |flats, to| {
                let mut states = States { values: states, stride: self.state_size, offset: *offset };
                let to = Output { values: to, stride: self.flats[*output].stride(), scratch };
                gru.run(path, num_agents, self.rows(*input, flats), &mut states, to);
            }),
            FlatStep::Scalars { output } => {
                let stride = self.flats[*output].stride();
                let rows = chunk.scalars.chunks_exact(self.num_scalars);
                for (row, scalars) in flats[*output].chunks_exact_mut(stride).zip(rows) {
                    row[..scalars.len()].copy_from_slice(scalars);
                }
            }
            FlatStep::Join { inputs, output } => write(flats, *output, |flats, to| {
                let mut start = 0;
                for input in *inputs {
                    let from = &self.flats[input];
                    for (agent, row) in flats[input].chunks_exact(from.stride()).take(num_agents).enumerate()
                    {
                        let to = &mut to[agent * self.flats[*output].stride() + start..];
                        to[..from.len()].copy_from_slice(&row[..from.len()]);
                    }
                    start += from.len();
                }
            }),
        }
    }

    /// Returns the largest number of agents for which it is faster to compute one agent after the other than 8 or 16
    /// side by side. The results have the same bits either way.
    pub fn max_agents_one_by_one(&self) -> usize {
        let fills_blocks = |step: &PlaneStep| match step {
            PlaneStep::Convolve { convolution, .. } => {
                convolution.shape.output.channels.is_multiple_of(BLOCK)
            }
            _ => true,
        };
        // Interpolated between measurements with 4 and 8 agents: if a block is not full, about 5 agents one by one take
        // as long as 8 side by side.
        if self.of_planes.iter().all(fills_blocks) { MAX_AGENTS_ONE_BY_ONE } else { 5 }
    }

    /// Returns the largest number of floats of scratch space that a step needs for an agent.
    pub fn scratch(&self) -> usize {
        let of_steps = self.of_flats.iter().map(|step| match step {
            FlatStep::Gru { gru, .. } => gru.scratch(),
            _ => 0,
        });
        of_steps.max().unwrap_or(0)
    }

    /// Returns the lists of a slot.
    pub fn rows<'a>(&self, slot: usize, flats: &'a [Vec<f32>]) -> Rows<'a> {
        Rows { values: &flats[slot], stride: self.flats[slot].stride() }
    }
}

/// The buffers of one chunk: a window for each plane, and a list for each agent and flat.
#[derive(Clone, Debug)]
pub struct Buffers {
    planes: Vec<Vec<f32>>,
    pub flats: Vec<Vec<f32>>,
    scratch: Vec<f32>,
}

impl Buffers {
    pub fn new(steps: &LayerSteps) -> Self {
        Self {
            planes: steps.planes.iter().map(|plane| vec![0.0; plane.len()]).collect(),
            flats: steps.flats.iter().map(|flat| vec![0.0; MAX_AGENTS_ONE_BY_ONE * flat.stride()]).collect(),
            scratch: vec![0.0; MAX_AGENTS_ONE_BY_ONE * steps.scratch()],
        }
    }
}

/// Lets a closure write one slot while it reads the others.
pub fn write(slots: &mut [Vec<f32>], output: usize, run: impl FnOnce(&[Vec<f32>], &mut [f32])) {
    let mut to = std::mem::take(&mut slots[output]);
    run(slots, &mut to);
    slots[output] = to;
}

pub fn add(slots: &[Vec<f32>], [one, other]: [usize; 2], to: &mut [f32]) {
    for ((to, one), other) in to.iter_mut().zip(&slots[one]).zip(&slots[other]) {
        *to = one + other;
    }
}

/// Copies a window from channels-first to channels-last order.
fn load(plane: &Plane, window: &[f32], to: &mut [f32]) {
    for (index, value) in window.iter().enumerate() {
        let (pixel, channel) = (index % (plane.rows * plane.cols), index / (plane.rows * plane.cols));
        to[plane.index(pixel / plane.cols, pixel % plane.cols) + channel] = *value;
    }
}

/// Copies a window without its margins and padding, in channels-last order.
fn store(plane: &Plane, from: &[f32], to: &mut [f32]) {
    let pixels = (0..plane.rows).flat_map(|row| (0..plane.cols).map(move |col| (row, col)));
    for ((row, col), to) in pixels.zip(to.chunks_exact_mut(plane.channels)) {
        to.copy_from_slice(&from[plane.index(row, col)..][..plane.channels]);
    }
}
