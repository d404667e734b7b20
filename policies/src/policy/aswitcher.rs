//! ASwitcher: planning, and learning where planning has no move.

use std::time::Duration;

use pogema_core::{Action, Config, Error, Instance, State};

use crate::policy::learned::Player;
use crate::policy::network_player::{NetworkPlayer, NetworkSettings};
use crate::replan::{Plan, ReplanVersion, Replanner};

/// ASwitcher in one episode: RePlan moves the agents, and a network moves those for which RePlan has no move.
///
/// RePlan has none without a path, and for a path that leads back to one of the last two cells.
///
/// Source: when-to-switch, `agents/assistant_switcher.py`
#[derive(Debug)]
pub(crate) struct ASwitcher {
    network: NetworkPlayer,
    planner: Replanner,
}

impl ASwitcher {
    /// Begins an episode. The same seed gives the same actions.
    ///
    /// # Errors
    /// Those of [`NetworkPlayer::begin`].
    pub fn begin(
        settings: &NetworkSettings,
        instance: &Instance,
        config: &Config,
        seed: u64,
    ) -> Result<Self, Error> {
        let network = NetworkPlayer::begin(settings, instance, config, seed)?;
        let sight = settings.encoder.sight;
        Ok(Self { network, planner: Replanner::begin(ReplanVersion::Cpp, instance, config.occupancy, sight) })
    }
}

impl Player for ASwitcher {
    fn network_time(&self) -> Duration {
        self.network.network_time()
    }

    /// The network always acts for all agents, so its memory knows every state.
    fn act(&mut self, state: State<'_>) -> Result<Vec<Action>, Error> {
        let mut actions = self.network.act(state)?;
        for (action, plan) in actions.iter_mut().zip(self.planner.plan(state)) {
            if let Plan::Move(planned) = plan {
                *action = planned;
            }
        }
        Ok(actions)
    }
}
