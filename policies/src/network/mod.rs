//! Neural networks that map what agents see to logits of their actions.
//!
//! A [`Network`] is read from a file of weights and the JSON file beside it. The results of its layers have the same
//! bits for any size of a batch, on any machine and with any vector instructions: each output is a sum whose order is
//! fixed. The bits depend on the machine only if a runtime runs the graph of an ONNX file.

mod agents;
mod architecture;
mod build;
mod config;
mod error;
mod file;
mod gru;
mod layers;
mod program;
mod slots;
mod softmax;
mod steps;
mod tensors;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::sync::Arc;

use pogema_core::{Error, SimdPath};

pub use architecture::{Architecture, Layer};
#[cfg(feature = "onnx")]
pub(crate) use build::check_layers;
pub use config::{NetworkConfig, Sampling, SamplingConfig};
pub use error::ForwardError;
pub use program::Workspace;
pub use softmax::softmax;

use crate::simd::AGENTS;
use file::Content;
use program::{Layers, Program};
use steps::Chunk;
pub(crate) use tensors::{Tensors, check_finite, check_num_values};

/// A network with its weights, which any number of threads can share.
#[derive(Clone, Debug)]
pub struct Network(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    config: NetworkConfig,
    window: [usize; 3],
    program: Program,
}

/// The inputs of a batch, agent by agent.
#[derive(Clone, Copy, Debug, Default)]
pub struct Inputs<'a> {
    /// Shape: batch, then [`Network::input_shape`].
    pub windows: &'a [f32],
    /// The scalars. Shape: batch, [`Network::num_scalars`].
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

    /// Returns the mutable state, so that a saved state can be restored. Shape: agents, [`Network::state_size`].
    pub fn values_mut(&mut self) -> &mut [f32] {
        &mut self.values
    }
}

impl Network {
    /// Reads a network from a file of weights and the JSON file beside it, which has the same name but the extension
    /// `json`. Its content is a [`NetworkConfig`].
    ///
    /// A `.safetensors` file holds the tensors of the layers that the JSON names. An `.onnx` file holds its own layers,
    /// and its JSON may be absent. Its logits are the output `action_logits` or `logits`, or the only output; operators
    /// that follow them are ignored. The output `values` or `value` is used if it depends on the same layers.
    ///
    /// # Errors
    /// [`Error::Io`] if a file cannot be read or is wrong, with the name of the tensor, layer or operator;
    /// [`Error::Argument`] for a value of `POGEMA_SIMD` that [`SimdPath::from_environment`] rejects.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let (config, content) = file::read(path)?;
        let simd_path = SimdPath::from_environment()?;
        let network = match content {
            Content::Layers(mut tensors) => Self::new(config, &mut tensors, simd_path),
            #[cfg(feature = "onnx")]
            Content::Runtime(runtime) => {
                let window = runtime.window;
                Ok(Self(Arc::new(Inner { config, window, program: Program::Runtime(runtime) })))
            }
        };
        network.map_err(|reason| file::misfit(path, &reason))
    }

    /// Creates a network from the bytes of its JSON file and of its `.safetensors` file.
    ///
    /// # Errors
    /// [`Error::Corrupt`] for wrong bytes, with the name of the tensor or layer; [`Error::Argument`] as for
    /// [`Network::read`].
    pub fn from_bytes(config: &[u8], tensors: &[u8]) -> Result<Self, Error> {
        let simd_path = SimdPath::from_environment()?;
        let network = file::parse_config(config).and_then(|config| {
            let mut tensors = file::parse_tensors(tensors)?;
            Self::new(config, &mut tensors, simd_path)
        });
        network.map_err(|reason| Error::Corrupt { what: "network".into(), reason })
    }

    /// Writes the network of a file as a `.safetensors` file and the JSON beside it.
    ///
    /// # Errors
    /// [`Error::Io`] if a file cannot be read or is wrong, if an ONNX graph does not consist of layers, if `to` does
    /// not end in `.safetensors`, or if a file cannot be written. After an error, existing files are unchanged.
    pub fn convert(from: impl AsRef<Path>, to: impl AsRef<Path>) -> Result<(), Error> {
        let from = from.as_ref();
        let (config, content) = file::read(from)?;
        #[cfg_attr(
            not(feature = "onnx"),
            allow(
                clippy::infallible_destructuring_match,
                reason = "a graph for the runtime is not a list of layers"
            )
        )]
        let tensors = match content {
            Content::Layers(tensors) => tensors,
            #[cfg(feature = "onnx")]
            Content::Runtime(runtime) => return Err(Error::io(from, runtime.reason)),
        };
        let network = Self::new(config, &mut tensors.clone(), SimdPath::best());
        let network = network.map_err(|reason| file::misfit(from, &reason))?;
        file::write(to.as_ref(), network.config(), &tensors)
    }

    /// Creates a network of layers from its config and its tensors: name, shape and values of each.
    ///
    /// # Errors
    /// [`Error::Corrupt`] with the name of the tensor or layer that is wrong.
    pub fn from_tensors(
        config: NetworkConfig,
        tensors: impl IntoIterator<Item = (String, Vec<usize>, Vec<f32>)>,
    ) -> Result<Self, Error> {
        let network =
            collect(tensors).and_then(|mut tensors| Self::new(config, &mut tensors, SimdPath::best()));
        network.map_err(|reason| Error::Corrupt { what: "network".into(), reason })
    }

    /// Writes a `.safetensors` file and the JSON beside it, after checking them as [`Network::from_tensors`] does.
    ///
    /// # Errors
    /// [`Error::Io`] if the network is wrong, the path does not end in `.safetensors`, or a file cannot be written.
    /// After an error, existing files are unchanged.
    pub fn write(
        path: impl AsRef<Path>,
        config: NetworkConfig,
        tensors: impl IntoIterator<Item = (String, Vec<usize>, Vec<f32>)>,
    ) -> Result<(), Error> {
        let path = path.as_ref();
        let wrong = |reason| Error::io(path, reason);
        let tensors = collect(tensors).map_err(wrong)?;
        let network = Self::new(config, &mut tensors.clone(), SimdPath::best()).map_err(wrong)?;
        file::write(path, network.config(), &tensors)
    }

    fn new(config: NetworkConfig, tensors: &mut Tensors, path: SimdPath) -> Result<Self, String> {
        path.check().map_err(|error| error.to_string())?;
        let Some(architecture) = &config.architecture else {
            return Err("`architecture` is missing".into());
        };
        let window = architecture.window;
        let program = Program::Layers(Box::new(Layers::new(architecture, tensors, path)?));
        Ok(Self(Arc::new(Inner { config, window, program })))
    }

    /// Returns the instruction set that the network's layers use; `None` if a runtime runs the network.
    pub fn simd_path(&self) -> Option<SimdPath> {
        self.0.program.simd_path()
    }

    /// Returns the channels, rows and columns of the window.
    pub fn input_shape(&self) -> [usize; 3] {
        self.0.window
    }

    /// Returns the number of scalars, which the network reads beside the window.
    pub fn num_scalars(&self) -> usize {
        self.0.program.num_scalars()
    }

    /// Returns the number of logits.
    pub fn num_actions(&self) -> usize {
        self.0.program.num_actions()
    }

    /// Returns whether the network also returns a value.
    pub fn has_value(&self) -> bool {
        self.0.program.has_value()
    }

    /// Returns the number of floats of an agent's recurrent state, 0 without a recurrent layer.
    pub fn state_size(&self) -> usize {
        self.0.program.state_size()
    }

    /// Returns the content of the JSON file.
    pub fn config(&self) -> &NetworkConfig {
        &self.0.config
    }

    /// Creates the buffers that a thread needs to run this network.
    pub fn workspace(&self) -> Workspace {
        self.0.program.workspace()
    }

    /// Computes the logits of a batch and updates the state of its agents.
    ///
    /// # Errors
    /// [`ForwardError::Length`] if an input has the wrong length; the state is then unchanged.
    /// [`ForwardError::Runtime`] if an operator of an ONNX graph fails.
    /// [`ForwardError::NotFinite`] if an output is infinite or NaN.
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
            let chunk = Chunk {
                num_agents,
                windows: &inputs.windows[first * window..][..num_agents * window],
                scalars: &inputs.scalars[first * scalars..][..num_agents * scalars],
            };
            let states = &mut state.values[first * size..][..num_agents * size];
            self.0.program.run(chunk, states, workspace).map_err(ForwardError::Runtime)?;
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
}

fn collect(tensors: impl IntoIterator<Item = (String, Vec<usize>, Vec<f32>)>) -> Result<Tensors, String> {
    let mut all = Tensors::default();
    tensors.into_iter().try_for_each(|(name, shape, values)| all.insert_values(&name, shape, values))?;
    Ok(all)
}
