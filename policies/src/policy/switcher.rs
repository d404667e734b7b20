//! Policies that switch between planning and learning.

use std::time::Duration;

use pogema_core::{Action, Config, Error, Instance, State};

use crate::policy::network_episode::{NetworkEpisode, NetworkSettings};
use crate::replan::{Plan, ReplanVersion, Replanner};

/// ASwitcher in one episode: RePlan moves the agents, and a network moves those for which RePlan has no move.
///
/// RePlan has none without a path, and for a path that leads back to one of the last two cells.
///
/// Source: when-to-switch, `agents/assistant_switcher.py`
#[derive(Debug)]
pub(crate) struct Switcher {
    network: NetworkEpisode,
    planner: Replanner,
}

impl Switcher {
    /// Begins an episode. The same seed gives the same actions.
    ///
    /// # Errors
    /// Those of [`NetworkEpisode::begin`].
    pub fn begin(
        settings: &NetworkSettings,
        instance: &Instance,
        config: &Config,
        seed: u64,
    ) -> Result<Self, Error> {
        let network = NetworkEpisode::begin(settings, instance, config, seed)?;
        let sight = settings.encoder.sight;
        Ok(Self { network, planner: Replanner::begin(ReplanVersion::Cpp, instance, config.occupancy, sight) })
    }

    /// Returns the time that the network has taken since the episode began.
    pub fn network_time(&self) -> Duration {
        self.network.network_time()
    }

    /// Returns the actions of all agents in the next state of the episode; inactive agents stay.
    ///
    /// The network always acts for all agents, so its memory knows every state.
    ///
    /// # Errors
    /// Those of [`NetworkEpisode::act`].
    pub fn act(&mut self, state: State<'_>) -> Result<Vec<Action>, Error> {
        let mut actions = self.network.act(state)?;
        for (action, plan) in actions.iter_mut().zip(self.planner.plan(state)) {
            if let Plan::Move(planned) = plan {
                *action = planned;
            }
        }
        Ok(actions)
    }
}
