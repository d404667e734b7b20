//! A network that controls the agents of one episode.

use std::time::{Duration, Instant};

use pogema_core::{Action, Config, Error, Instance, Map, State};

use crate::encode::{Encoder, EncoderSettings};
use crate::network::{ForwardError, Inputs, Network, RecurrentState, Sampling, Workspace};
use crate::policy::sampler::{Logits, NUM_ACTIONS, Sampler};

/// A network with everything that it needs to act.
#[derive(Clone, Debug)]
pub struct NetworkSettings {
    pub network: Network,
    pub encoder: EncoderSettings,
    pub sampling: Sampling,
    /// Whether actions that lead into an obstacle or off the map are forbidden.
    pub masks_actions: bool,
}

/// A network that acts in one episode.
#[derive(Debug)]
pub struct NetworkEpisode {
    network: Network,
    encoder: Encoder,
    state: RecurrentState,
    workspace: Workspace,
    sampler: Sampler,
    /// The map, if it restricts the actions.
    mask: Option<Map>,
    windows: Vec<f32>,
    scalars: Vec<f32>,
    network_time: Duration,
}

impl NetworkEpisode {
    /// Starts an episode. The same seed gives the same actions.
    ///
    /// # Errors
    /// Currently none; the settings were checked.
    pub fn begin(
        settings: &NetworkSettings,
        instance: &Instance,
        config: &Config,
        seed: u64,
    ) -> Result<Self, Error> {
        let NetworkSettings { network, encoder: shape, sampling, masks_actions } = settings;
        let num_agents = instance.starts().len();
        let mut encoder = Encoder::new(shape.clone())?;
        encoder.begin(instance.map(), instance.outside(), config.occupancy, instance.starts());
        Ok(Self {
            windows: vec![0.0; num_agents * shape.window_len()],
            scalars: vec![0.0; num_agents * shape.scalars_len()],
            encoder,
            state: RecurrentState::new(network, num_agents),
            workspace: network.workspace(),
            network: network.clone(),
            sampler: Sampler::new(*sampling, seed, num_agents),
            mask: masks_actions.then(|| instance.map().clone()),
            network_time: Duration::ZERO,
        })
    }

    /// Returns the time that the network has taken since the episode began.
    pub fn network_time(&self) -> Duration {
        self.network_time
    }

    /// Returns the actions of all agents in the next state of the episode; inactive agents stay.
    ///
    /// # Errors
    /// [`Error::Length`] or [`Error::Agent`] for a state that does not fit the instance; [`Error::Corrupt`] with agent
    /// and step if the network returns a value that is not finite.
    pub fn act(&mut self, state: State<'_>) -> Result<Vec<Action>, Error> {
        self.encoder.encode(state, &mut self.windows, &mut self.scalars)?;
        let (num_agents, step) = (state.cells.len(), state.step);
        let inputs = Inputs { windows: &self.windows, scalars: &self.scalars, batch: num_agents };
        let wrong = |reason| Error::Corrupt { what: "network".into(), reason };
        let began = Instant::now();
        let outputs = self.network.forward(inputs, &mut self.state, &mut self.workspace);
        self.network_time += began.elapsed();
        let outputs = outputs.map_err(|error| match error {
            ForwardError::Length(error) => error,
            ForwardError::NotFinite { row } => {
                wrong(format!("the logits of agent {row} in step {step} are not finite"))
            }
            ForwardError::Runtime(reason) => wrong(format!("step {step}: {reason}")),
        })?;
        self.sampler.begin_step();
        let (rows, _) = outputs.logits.as_chunks::<NUM_ACTIONS>();
        let mut actions = vec![Action::Stay; num_agents];
        for (agent, (action, &logits)) in actions.iter_mut().zip(rows).enumerate() {
            if state.active[agent] {
                let logits = self.mask.as_ref().map_or(logits, |map| masked(logits, map, state, agent));
                *action = self.sampler.choose(agent, logits);
            }
        }
        Ok(actions)
    }
}

/// Returns the logits without those of moves into obstacles or off the map. To stay is always possible.
fn masked(mut logits: Logits, map: &Map, state: State<'_>, agent: usize) -> Logits {
    for (logit, action) in logits.iter_mut().zip(Action::ALL).skip(1) {
        let (row, col) = state.cells[agent].toward(action);
        let cell = u16::try_from(row).and_then(|row| Ok(pogema_core::Cell::new(row, u16::try_from(col)?)));
        if cell.map_or(true, |cell| map.is_obstacle(cell)) {
            *logit = f32::NEG_INFINITY;
        }
    }
    logits
}
