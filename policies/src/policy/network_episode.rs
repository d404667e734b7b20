//! A network that reads the states of one episode.

use std::time::{Duration, Instant};

use pogema_core::{Config, Error, Instance, State};

use crate::encode::{Encoder, EncoderSettings};
use crate::network::{ForwardError, Inputs, Network, RecurrentState, Workspace};

/// A network with the memory of one episode.
#[derive(Debug)]
pub(crate) struct NetworkEpisode {
    network: Network,
    encoder: Encoder,
    state: RecurrentState,
    workspace: Workspace,
    windows: Vec<f32>,
    scalars: Vec<f32>,
    network_time: Duration,
}

impl NetworkEpisode {
    /// Starts an episode.
    ///
    /// # Errors
    /// Currently none; the settings were checked.
    pub fn begin(
        network: &Network,
        settings: &EncoderSettings,
        instance: &Instance,
        config: &Config,
    ) -> Result<Self, Error> {
        let num_agents = instance.starts().len();
        let mut encoder = Encoder::new(settings.clone())?;
        encoder.begin(instance.map(), instance.outside(), config.occupancy, instance.starts());
        Ok(Self {
            windows: vec![0.0; num_agents * settings.window_len()],
            scalars: vec![0.0; num_agents * settings.scalars_len()],
            encoder,
            state: RecurrentState::new(network, num_agents),
            workspace: network.workspace(),
            network: network.clone(),
            network_time: Duration::ZERO,
        })
    }

    /// Returns the time that the network has taken since the episode began.
    pub fn network_time(&self) -> Duration {
        self.network_time
    }

    /// Returns the outputs for all agents in the next state of the episode, one agent after the other.
    ///
    /// # Errors
    /// [`Error::Length`] or [`Error::Agent`] for a state that does not fit the instance; [`Error::Corrupt`] with agent
    /// and step if the network returns a value that is not finite, or with the step if the ONNX runtime fails.
    pub fn outputs(&mut self, state: State<'_>) -> Result<&[f32], Error> {
        self.encoder.encode(state, &mut self.windows, &mut self.scalars)?;
        let step = state.step;
        let inputs = Inputs { windows: &self.windows, scalars: &self.scalars, batch: state.cells.len() };
        let wrong = |reason| Error::Corrupt { what: "network".into(), reason };
        let began = Instant::now();
        let outputs = self.network.forward(inputs, &mut self.state, &mut self.workspace);
        self.network_time += began.elapsed();
        let outputs = outputs.map_err(|error| match error {
            ForwardError::Length(error) => error,
            ForwardError::NotFinite { row } => {
                wrong(format!("the logits or the value of agent {row} in step {step} are not finite"))
            }
            ForwardError::Runtime(reason) => wrong(format!("step {step}: {reason}")),
        })?;
        Ok(outputs.logits)
    }
}
