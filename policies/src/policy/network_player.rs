//! A network that controls the agents of one episode.

use std::time::Duration;

use pogema_core::{Action, Cell, Config, Error, Instance, Map, State};

use crate::encode::EncoderSettings;
use crate::network::{Network, Sampling};
use crate::policy::learned::Player;
use crate::policy::network_episode::NetworkEpisode;
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
pub(crate) struct NetworkPlayer {
    network: NetworkEpisode,
    sampler: Sampler,
    /// The map, if it restricts the actions.
    mask: Option<Map>,
}

impl NetworkPlayer {
    /// Starts an episode. The same seed gives the same actions.
    ///
    /// # Errors
    /// Those of [`Sampler::new`].
    pub fn begin(
        settings: &NetworkSettings,
        instance: &Instance,
        config: &Config,
        seed: u64,
    ) -> Result<Self, Error> {
        let NetworkSettings { network, encoder, sampling, masks_actions } = settings;
        Ok(Self {
            network: NetworkEpisode::begin(network, encoder, instance, config)?,
            sampler: Sampler::new(*sampling, seed, instance.starts().len())?,
            mask: masks_actions.then(|| instance.map().clone()),
        })
    }
}

impl Player for NetworkPlayer {
    fn network_time(&self) -> Duration {
        self.network.network_time()
    }

    fn act(&mut self, state: State<'_>) -> Result<Vec<Action>, Error> {
        let (rows, _) = self.network.outputs(state)?.as_chunks::<NUM_ACTIONS>();
        self.sampler.begin_step();
        let mut actions = vec![Action::Stay; rows.len()];
        for (agent, (action, &logits)) in actions.iter_mut().zip(rows).enumerate() {
            if state.active[agent] {
                let logits = self.mask.as_ref().map_or(logits, |map| masked(logits, map, state, agent));
                *action = self.sampler.choose(agent, logits);
            }
        }
        Ok(actions)
    }
}

/// Returns the logits without those of moves into obstacles or off the map. Staying is always possible.
fn masked(mut logits: Logits, map: &Map, state: State<'_>, agent: usize) -> Logits {
    for (logit, action) in logits.iter_mut().zip(Action::ALL).skip(1) {
        let target = Cell::checked(state.cells[agent].toward(action));
        if target.is_none_or(|cell| map.is_obstacle(cell)) {
            *logit = f32::NEG_INFINITY;
        }
    }
    logits
}
