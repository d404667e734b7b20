//! Neural networks that map what agents see to logits of their actions.
//!
//! A [`Network`] is read from a file of weights and a JSON that names its layers. Its results have the same bits for any
//! size of a batch, on any machine and with any vector instructions: each output is a sum whose order is fixed.

mod agents;
mod architecture;
mod build;
mod config;
mod error;
mod file;
mod gru;
mod layers;
mod slots;
mod softmax;
mod steps;
mod tensors;
#[cfg(test)]
mod tests;

use std::path::Path as FilePath;
use std::sync::Arc;

use pogema_core::Error;

pub use architecture::{Architecture, Layer};
pub use config::{NetworkConfig, Sampling, SamplingConfig};
pub use error::ForwardError;
pub use softmax::softmax;

use crate::simd::{AGENTS, Path};
use agents::AgentBuffers;
use steps::{Buffers, GROUP, Group, Heads, Steps};
pub(crate) use tensors::Tensors;

/// A network with its weights, which any number of threads can share.
#[derive(Clone, Debug)]
pub struct Network(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    config: NetworkConfig,
    window: [usize; 3],
    steps: Steps,
    heads: Heads,
    path: Path,
}

/// The inputs of a batch, agent by agent.
#[derive(Clone, Copy, Debug, Default)]
pub struct Inputs<'a> {
    /// Shape: batch, then [`Network::input_shape`].
    pub windows: &'a [f32],
    /// The numbers beside the window. Shape: batch, [`Network::num_scalars`].
    pub scalars: &'a [f32],
    /// Number of agents.
    pub batch: usize,
}

/// The outputs of a batch, agent by agent.
#[derive(Clone, Copy, Debug)]
pub struct Outputs<'a> {
    /// Shape: batch, [`Network::num_actions`].
    pub logits: &'a [f32],
    /// Empty if the network has no value head. Shape: batch.
    pub values: &'a [f32],
}

/// The buffers of a thread that runs a network.
///
/// They are allocated here and when a batch is larger than all before.
#[derive(Clone, Debug)]
pub struct Workspace {
    buffers: Buffers,
    agents: AgentBuffers,
    heads: Vec<f32>,
    logits: Vec<f32>,
    values: Vec<f32>,
}

/// The state that a recurrent network keeps for each agent through an episode.
#[derive(Clone, Debug, PartialEq)]
pub struct RecurrentState {
    size: usize,
    values: Vec<f32>,
}

impl RecurrentState {
    /// Creates the state of agents at the beginning of an episode: zeros.
    pub fn new(network: &Network, num_agents: usize) -> Self {
        let size = network.state_size();
        Self { size, values: vec![0.0; num_agents * size] }
    }

    /// Sets the state of one agent to that at the beginning of an episode.
    ///
    /// # Panics
    /// If there is no such agent.
    pub fn reset(&mut self, agent: usize) {
        self.values[agent * self.size..][..self.size].fill(0.0);
    }

    /// Sets the state of every agent to that at the beginning of an episode.
    pub fn reset_all(&mut self) {
        self.values.fill(0.0);
    }

    /// Returns the state. Shape: agents, [`Network::state_size`].
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Returns the state, to restore one that was saved. Shape: agents, [`Network::state_size`].
    pub fn values_mut(&mut self) -> &mut [f32] {
        &mut self.values
    }
}

impl Network {
    /// Reads a network from a file of weights and the JSON file beside it, which has the same name but the extension
    /// `json`. Its content is a [`NetworkConfig`].
    ///
    /// A `.safetensors` file holds the tensors of the layers that the JSON names. An `.onnx` file holds its own layers, and
    /// its JSON may be absent. Its logits are the output `action_logits` or `logits`, or the only output; operators that
    /// follow them are ignored. The output `values` or `value` is used if it stands on the same layers.
    ///
    /// # Errors
    /// [`Error::Io`] if a file cannot be read or is wrong, with the name of the tensor, layer or operator.
    pub fn read(path: impl AsRef<FilePath>) -> Result<Self, Error> {
        let path = path.as_ref();
        let (config, mut tensors) = file::read(path)?;
        Self::new(config, &mut tensors, Path::best()).map_err(|reason| Error::io(path, reason))
    }

    /// Writes the network of a file as a `.safetensors` file and the JSON beside it.
    ///
    /// # Errors
    /// Those of [`Network::read`], and [`Error::Io`] if a file cannot be written.
    pub fn convert(from: impl AsRef<FilePath>, to: impl AsRef<FilePath>) -> Result<(), Error> {
        let (config, tensors) = file::read(from.as_ref())?;
        let network = Self::new(config, &mut tensors.clone(), Path::best());
        let network = network.map_err(|reason| Error::io(from.as_ref(), reason))?;
        file::write(to.as_ref(), network.config(), &tensors)
    }

    fn new(config: NetworkConfig, tensors: &mut Tensors, path: Path) -> Result<Self, String> {
        let Some(architecture) = &config.architecture else {
            return Err("`architecture` is missing".into());
        };
        let window = architecture.window;
        let (steps, heads) = build::build(architecture, tensors)?;
        Ok(Self(Arc::new(Inner { window, steps, heads, path, config })))
    }

    /// Returns the channels, rows and columns of the window.
    pub fn input_shape(&self) -> [usize; 3] {
        self.0.window
    }

    /// Returns the number of numbers beside the window.
    pub fn num_scalars(&self) -> usize {
        self.0.steps.num_scalars
    }

    /// Returns the number of logits.
    pub fn num_actions(&self) -> usize {
        self.0.heads.num_actions
    }

    /// Returns whether the network also returns a value.
    pub fn has_value(&self) -> bool {
        self.0.heads.dense.num_outputs > self.0.heads.num_actions
    }

    /// Returns the number of floats of an agent's recurrent state, 0 without a recurrent layer.
    pub fn state_size(&self) -> usize {
        self.0.steps.state_size
    }

    /// Returns the content of the JSON file.
    pub fn config(&self) -> &NetworkConfig {
        &self.0.config
    }

    /// Creates the buffers that a thread needs to run this network.
    pub fn workspace(&self) -> Workspace {
        let (steps, heads) = (&self.0.steps, &self.0.heads);
        Workspace {
            buffers: Buffers::new(steps),
            agents: AgentBuffers::new(steps, heads),
            heads: vec![0.0; GROUP * heads.dense.stride()],
            logits: Vec::new(),
            values: Vec::new(),
        }
    }

    /// Computes the logits of a batch and updates the state of its agents.
    ///
    /// # Errors
    /// [`ForwardError::Length`] if an input has the wrong length; the state is then unchanged.
    /// [`ForwardError::NotFinite`] if an output is infinite or no number.
    ///
    /// # Panics
    /// If the workspace belongs to another network.
    pub fn forward<'w>(
        &self,
        inputs: Inputs<'_>,
        state: &mut RecurrentState,
        workspace: &'w mut Workspace,
    ) -> Result<Outputs<'w>, ForwardError> {
        let window: usize = self.0.window.iter().product();
        let (scalars, size) = (self.num_scalars(), self.state_size());
        let check = |what, got: usize, each: usize| {
            Error::check_length(what, inputs.batch.saturating_mul(each), got).map_err(ForwardError::Length)
        };
        check("the list of windows", inputs.windows.len(), window)?;
        check("the list of scalars", inputs.scalars.len(), scalars)?;
        check("the recurrent state", state.values.len(), size)?;
        workspace.logits.clear();
        workspace.values.clear();
        for first in (0..inputs.batch).step_by(AGENTS) {
            let num_agents = AGENTS.min(inputs.batch - first);
            let group = Group {
                num_agents,
                windows: &inputs.windows[first * window..][..num_agents * window],
                scalars: &inputs.scalars[first * scalars..][..num_agents * scalars],
            };
            self.run(group, &mut state.values[first * size..][..num_agents * size], workspace);
        }
        let actions = self.num_actions();
        let logits =
            workspace.logits.iter().position(|value| !value.is_finite()).map(|index| index / actions);
        let value = workspace.values.iter().position(|value| !value.is_finite());
        match logits.or(value) {
            Some(row) => Err(ForwardError::NotFinite { row }),
            None => Ok(Outputs { logits: &workspace.logits, values: &workspace.values }),
        }
    }

    /// Computes the outputs of up to 16 agents.
    fn run(&self, group: Group<'_>, states: &mut [f32], workspace: &mut Workspace) {
        let Inner { steps, heads, path, .. } = &*self.0;
        let Workspace { buffers, agents, heads: outputs, logits, values } = workspace;
        let num_outputs = heads.dense.num_outputs;
        if group.num_agents > steps.most_apart() {
            steps.run_agents(*path, group, heads, states, agents);
            for agent in 0..group.num_agents {
                logits.extend((0..heads.num_actions).map(|output| agents.output(agent, output)));
                values.extend((heads.num_actions..num_outputs).map(|output| agents.output(agent, output)));
            }
            return;
        }
        steps.run(*path, group, states, buffers);
        let rows = steps.rows(heads.input, &buffers.flats);
        heads.dense.run(*path, group.num_agents, rows, false, outputs);
        for row in outputs.chunks_exact(heads.dense.stride()).take(group.num_agents) {
            logits.extend(&row[..heads.num_actions]);
            values.extend(&row[heads.num_actions..num_outputs]);
        }
    }
}
