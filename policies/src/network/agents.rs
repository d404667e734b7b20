//! Runs the steps for 8 or 16 agents whose values lie side by side: a list holds the first value of all agents, then
//! the second, and so on.

use pogema_core::SimdPath;

use super::steps::{Chunk, FlatStep, Heads, LayerSteps, PlaneStep, add, write};

/// The buffers of 8 or 16 agents.
#[derive(Clone, Debug)]
pub struct AgentBuffers {
    num_agents: usize,
    planes: Vec<Vec<f32>>,
    flats: Vec<Vec<f32>>,
    states: Vec<f32>,
    scratch: Vec<f32>,
    heads: Vec<f32>,
}

impl AgentBuffers {
    pub fn new(steps: &LayerSteps, heads: &Heads, num_agents: usize) -> Self {
        let zeros = |num_values: usize| vec![0.0; num_agents * num_values];
        Self {
            num_agents,
            planes: steps.planes.iter().map(|plane| zeros(plane.num_values())).collect(),
            flats: steps.flats.iter().map(|flat| zeros(flat.len())).collect(),
            states: zeros(steps.state_size),
            scratch: zeros(steps.scratch()),
            heads: zeros(heads.dense.num_outputs),
        }
    }

    /// Returns an output of an agent.
    pub fn output(&self, agent: usize, output: usize) -> f32 {
        self.heads[output * self.num_agents + agent]
    }
}

impl LayerSteps {
    /// Computes the outputs of at most as many agents as the buffers hold. The lanes of missing agents hold values of
    /// an earlier call.
    pub fn run_agents(
        &self,
        path: SimdPath,
        chunk: Chunk<'_>,
        heads: &Heads,
        states: &mut [f32],
        buffers: &mut AgentBuffers,
    ) {
        let num_agents = buffers.num_agents;
        let [rows, cols, channels] = [self.planes[0].rows, self.planes[0].cols, self.planes[0].channels];
        for (agent, window) in chunk.windows.chunks_exact(rows * cols * channels).enumerate() {
            for (channel, values) in window.chunks_exact(rows * cols).enumerate() {
                let to = buffers.planes[0].chunks_exact_mut(channels * num_agents);
                to.zip(values).for_each(|(pixel, value)| pixel[channel * num_agents + agent] = *value);
            }
        }
        interleave(states, self.state_size, num_agents, &mut buffers.states);
        for step in &self.of_planes {
            run_planes(path, step, buffers);
        }
        for step in &self.of_flats {
            self.run_flats_of_agents(path, step, chunk, buffers);
        }
        for (agent, state) in states.chunks_exact_mut(self.state_size.max(1)).enumerate() {
            let from = buffers.states.chunks_exact(num_agents);
            state.iter_mut().zip(from).for_each(|(value, agents)| *value = agents[agent]);
        }
        heads.dense.run_agents(path, &buffers.flats[heads.input], false, &mut buffers.heads);
    }

    fn run_flats_of_agents(
        &self,
        path: SimdPath,
        step: &FlatStep,
        chunk: Chunk<'_>,
        buffers: &mut AgentBuffers,
    ) {
        let AgentBuffers { num_agents, flats, states, scratch, .. } = buffers;
        let num_agents = *num_agents;
        match step {
            FlatStep::Dense { dense, input, relu, output } => {
                write(flats, *output, |flats, to| dense.run_agents(path, &flats[*input], *relu, to));
            }
            FlatStep::Activate { activation, input, output } => write(flats, *output, |flats, to| {
                to.copy_from_slice(&flats[*input]);
                activation.apply(to);
            }),
            FlatStep::Add { inputs, output } => write(flats, *output, |flats, to| add(flats, *inputs, to)),
            FlatStep::Gru { gru, input, offset, output } => write(flats, *output, |flats, to| {
                let state = &mut states[offset * num_agents..][..gru.size * num_agents];
                gru.run_agents(path, &flats[*input], state, scratch);
                to.copy_from_slice(state);
            }),
            FlatStep::Scalars { output } => {
                interleave(chunk.scalars, self.num_scalars, num_agents, &mut flats[*output]);
            }
            FlatStep::Join { inputs, output } => write(flats, *output, |flats, to| {
                let (one, other) = to.split_at_mut(flats[inputs[0]].len());
                one.copy_from_slice(&flats[inputs[0]]);
                other.copy_from_slice(&flats[inputs[1]]);
            }),
        }
    }
}

fn run_planes(path: SimdPath, step: &PlaneStep, buffers: &mut AgentBuffers) {
    let AgentBuffers { planes, flats, .. } = buffers;
    match step {
        PlaneStep::Convolve { convolution, input, added, relu, output } => {
            write(planes, *output, |planes, to| {
                let added = added.map(|slot| &*planes[slot]);
                convolution.run_agents(path, &planes[*input], added, *relu, to);
            });
        }
        PlaneStep::Activate { activation, input, output } => write(planes, *output, |planes, to| {
            to.copy_from_slice(&planes[*input]);
            activation.apply(to);
        }),
        PlaneStep::Add { inputs, output } => write(planes, *output, |planes, to| add(planes, *inputs, to)),
        PlaneStep::Flatten { input, output } => flats[*output].copy_from_slice(&planes[*input]),
    }
}

/// Writes the lists of some agents side by side: the first value of all agents, then the second, and so on.
fn interleave(lists: &[f32], len: usize, num_agents: usize, to: &mut [f32]) {
    for (agent, list) in lists.chunks_exact(len.max(1)).enumerate() {
        to.chunks_exact_mut(num_agents).zip(list).for_each(|(agents, value)| agents[agent] = *value);
    }
}
