//! A learned policy that plays an episode.

use std::time::Duration;

use pogema_core::{Action, Error, State};

use crate::mats_lp::MatsLp;

/// A learned policy that chooses the actions of all agents of one episode.
pub struct LearnedPolicy(Box<dyn Player + Send>);

/// The interface of a learned policy in one episode.
pub(crate) trait Player {
    /// Returns the time spent in networks since the episode began; with several threads, the longest time that one of
    /// them spent there.
    fn network_time(&self) -> Duration;

    /// Returns the actions of all agents in the next state of the episode; inactive agents stay.
    ///
    /// # Errors
    /// Those of [`LearnedPolicy::act`].
    fn act(&mut self, state: State<'_>) -> Result<Vec<Action>, Error>;
}

impl Player for MatsLp {
    fn network_time(&self) -> Duration {
        self.stats().network_time
    }

    fn act(&mut self, state: State<'_>) -> Result<Vec<Action>, Error> {
        Self::act(self, state)
    }
}

impl LearnedPolicy {
    pub(crate) fn new(player: impl Player + Send + 'static) -> Self {
        Self(Box::new(player))
    }

    /// Returns the time spent in networks since the episode began; with several threads, the longest time that one of
    /// them spent there.
    pub fn network_time(&self) -> Duration {
        self.0.network_time()
    }

    /// Returns the actions of all agents in the next state of the episode; inactive agents stay.
    ///
    /// # Errors
    /// [`Error::Length`] or [`Error::Agent`] for a state that does not fit the instance; [`Error::Corrupt`] with agent
    /// and step if the network returns a value that is not finite, or with the step if the ONNX runtime fails; for
    /// MATS-LP also those of [`MatsLp::act`].
    pub fn act(&mut self, state: State<'_>) -> Result<Vec<Action>, Error> {
        self.0.act(state)
    }
}
