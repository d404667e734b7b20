//! A network that controls the agents of an environment.

use pogema_core::{Action, Config, Error, Instance, Map, State};

use crate::encode::{Encoder, EncoderSettings};
use crate::follower::FollowerVersion;
use crate::network::{ForwardError, Inputs, Network, RecurrentState, Sampling, Workspace};
use crate::policy::sampler::{Logits, NUM_ACTIONS, Sampler};

/// A network with everything that it needs to act.
#[derive(Clone, Debug)]
pub struct NetworkPolicy {
    network: Network,
    encoder: EncoderSettings,
    sampling: Sampling,
    masks_actions: bool,
}

impl NetworkPolicy {
    /// Creates a policy of a network with its own encoder and sampling.
    ///
    /// # Errors
    /// [`Error::Request`] if the network has no encoder, or one of another shape; [`Error::Config`] for invalid
    /// settings.
    pub fn new(network: Network) -> Result<Self, Error> {
        let Some(encoder) = network.config().encoder.clone() else {
            return Err(Error::request("the network names no encoder, expected `encoder` in its JSON file"));
        };
        Self::with_encoder(network, encoder)
    }

    /// Creates a policy of a network with an encoder in place of its own.
    ///
    /// # Errors
    /// Those of [`NetworkPolicy::new`].
    pub fn with_encoder(network: Network, encoder: EncoderSettings) -> Result<Self, Error> {
        encoder.check()?;
        let (input, output) = (network.input_shape(), encoder.shape());
        if input != output || network.num_scalars() != encoder.scalars_len() {
            return Err(Error::request(format!(
                "the network reads windows of shape {input:?} and {} scalars, the encoder writes {output:?} and {}",
                network.num_scalars(),
                encoder.scalars_len()
            )));
        }
        if network.num_actions() != NUM_ACTIONS {
            let found = network.num_actions();
            return Err(Error::request(format!("the network has {found} logits, expected {NUM_ACTIONS}")));
        }
        let sampling = network.config().sampling.rule;
        Ok(Self { network, encoder, sampling, masks_actions: false })
    }

    /// Creates the policy Follower, for a network whose window has Follower's two channels.
    ///
    /// # Errors
    /// Those of [`NetworkPolicy::new`].
    pub fn follower(network: Network) -> Result<Self, Error> {
        let [_, side, _] = network.input_shape();
        let usual = || EncoderSettings::follower(side / 2, FollowerVersion::default());
        let encoder = network.config().encoder.clone().unwrap_or_else(usual);
        Self::with_encoder(network, encoder)
    }

    /// Returns the network.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// Returns what the network sees.
    pub fn encoder(&self) -> &EncoderSettings {
        &self.encoder
    }

    /// Returns the rule that chooses actions.
    pub fn sampling(&self) -> Sampling {
        self.sampling
    }

    /// Replaces the rule that chooses actions.
    #[must_use]
    pub fn with_sampling(mut self, sampling: Sampling) -> Self {
        self.sampling = sampling;
        self
    }

    /// Forbids actions that lead into an obstacle or off the map, if `masks_actions` is set [default: not].
    #[must_use]
    pub fn with_masks(mut self, masks_actions: bool) -> Self {
        self.masks_actions = masks_actions;
        self
    }

    /// Starts an episode. The same seed gives the same actions.
    ///
    /// # Errors
    /// None at present; the settings were checked.
    pub fn begin(&self, instance: &Instance, config: &Config, seed: u64) -> Result<LearnedPolicy, Error> {
        let num_agents = instance.starts().len();
        let mut encoder = Encoder::new(self.encoder.clone())?;
        encoder.begin(instance.map(), instance.outside(), config.occupancy, instance.starts());
        Ok(LearnedPolicy {
            windows: vec![0.0; num_agents * self.encoder.window_len()],
            scalars: vec![0.0; num_agents * self.encoder.scalars_len()],
            encoder,
            state: RecurrentState::new(&self.network, num_agents),
            workspace: self.network.workspace(),
            network: self.network.clone(),
            sampler: Sampler::new(self.sampling, seed, num_agents),
            mask: self.masks_actions.then(|| instance.map().clone()),
        })
    }
}

/// A network that acts in one episode.
#[derive(Debug)]
pub struct LearnedPolicy {
    network: Network,
    encoder: Encoder,
    state: RecurrentState,
    workspace: Workspace,
    sampler: Sampler,
    /// The map, if it restricts the actions.
    mask: Option<Map>,
    windows: Vec<f32>,
    scalars: Vec<f32>,
}

impl LearnedPolicy {
    /// Returns the actions of all agents in the next state of the episode; inactive agents stay.
    ///
    /// # Errors
    /// [`Error::Length`] or [`Error::Agent`] for a state that does not fit the instance; [`Error::Corrupt`] with agent
    /// and step if the network returns no number.
    pub fn act(&mut self, state: State<'_>) -> Result<Vec<Action>, Error> {
        self.encoder.encode(state, &mut self.windows, &mut self.scalars)?;
        let (num_agents, step) = (state.cells.len(), state.step);
        let inputs = Inputs { windows: &self.windows, scalars: &self.scalars, batch: num_agents };
        let wrong = |reason| Error::Corrupt { what: "network".into(), reason };
        let outputs = self.network.forward(inputs, &mut self.state, &mut self.workspace);
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
