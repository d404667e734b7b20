//! A learned policy that plays an episode.

use std::time::Duration;

use pogema_core::{Action, Error, State};

use crate::mats_lp::MatsLp;
use crate::policy::network_episode::NetworkEpisode;
use crate::policy::switcher::Switcher;

/// A learned policy that chooses the actions of all agents of one episode.
pub struct LearnedPolicy(Player);

enum Player {
    Network(Box<NetworkEpisode>),
    Switcher(Box<Switcher>),
    MatsLp(Box<MatsLp>),
}

impl LearnedPolicy {
    pub(crate) fn of_network(network: NetworkEpisode) -> Self {
        Self(Player::Network(Box::new(network)))
    }

    pub(crate) fn of_switcher(switcher: Switcher) -> Self {
        Self(Player::Switcher(Box::new(switcher)))
    }

    pub(crate) fn of_search(search: MatsLp) -> Self {
        Self(Player::MatsLp(Box::new(search)))
    }

    /// Returns the time that the network has taken since the episode began, summed over threads.
    pub fn network_time(&self) -> Duration {
        match &self.0 {
            Player::Network(network) => network.network_time(),
            Player::Switcher(switcher) => switcher.network_time(),
            Player::MatsLp(search) => search.stats().network_time,
        }
    }

    /// Returns the actions of all agents in the next state of the episode; inactive agents stay.
    ///
    /// # Errors
    /// [`Error::Length`] or [`Error::Agent`] for a state that does not fit the instance; [`Error::Corrupt`] with agent
    /// and step if the network returns a value that is not finite; for MATS-LP also those of [`MatsLp::act`].
    pub fn act(&mut self, state: State<'_>) -> Result<Vec<Action>, Error> {
        match &mut self.0 {
            Player::Network(network) => network.act(state),
            Player::Switcher(switcher) => switcher.act(state),
            Player::MatsLp(search) => search.act(state),
        }
    }
}
