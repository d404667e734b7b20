//! LSwitcher: planning or learning, whichever has the larger predicted value.

use std::time::Duration;

use pogema_core::{Action, Config, Error, Instance, State, counted};

use crate::encode::EncoderSettings;
use crate::network::Network;
use crate::policy::learned::Player;
use crate::policy::network::encoder_of;
use crate::policy::network_episode::NetworkEpisode;
use crate::policy::network_player::{NetworkPlayer, NetworkSettings};
use crate::replan::ReplanPolicy;

/// Number of outputs of LSwitcher's network for each agent: the value of EPOM, and that of RePlan.
const NUM_VALUES: usize = 2;

/// Number of steps before an agent may change sides again.
const MIN_STEPS: u32 = 50;

/// The network that judges EPOM and RePlan, with the settings of its encoder.
#[derive(Clone, Debug)]
pub(crate) struct Judge {
    network: Network,
    encoder: EncoderSettings,
}

impl Judge {
    /// Creates a judge from a network that has its own encoder.
    ///
    /// # Errors
    /// [`Error::Request`] if the network does not have two outputs, has no encoder, or has an encoder of another shape;
    /// [`Error::Config`] for invalid settings of the encoder.
    pub fn new(network: Network) -> Result<Self, Error> {
        if network.num_actions() != NUM_VALUES {
            let found = network.num_actions();
            return Err(Error::request(format!(
                "the network has {}, expected {NUM_VALUES}: the values of EPOM and of RePlan",
                counted(found, "output")
            )));
        }
        let encoder = encoder_of(&network)?;
        Ok(Self { network, encoder })
    }

    /// Returns the network.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// Returns the settings of the network's encoder.
    pub fn encoder(&self) -> &EncoderSettings {
        &self.encoder
    }
}

/// LSwitcher in one episode: each agent follows EPOM or RePlan, whichever has the larger value.
///
/// Source: when-to-switch, `agents/learnable_switcher.py`
#[derive(Debug)]
pub(crate) struct LSwitcher {
    network: NetworkPlayer,
    planner: ReplanPolicy,
    judge: NetworkEpisode,
    sides: Vec<Side>,
}

/// The side of an agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Side {
    learns: bool,
    /// Number of steps since the agent changed sides; before the first change, since the second step of the episode.
    steps: u32,
}

impl Side {
    /// Returns the side in the next step; `prefers_learning` says whether EPOM has the larger value there.
    fn next(self, prefers_learning: bool) -> Self {
        let changes = prefers_learning != self.learns && self.steps >= MIN_STEPS;
        let steps = if changes { 0 } else { self.steps };
        Self { learns: self.learns != changes, steps: steps + 1 }
    }
}

impl LSwitcher {
    /// Begins an episode. The same seed gives the same actions.
    ///
    /// # Errors
    /// Those of [`NetworkPlayer::begin`].
    pub fn begin(
        settings: &NetworkSettings,
        judge: &Judge,
        instance: &Instance,
        config: &Config,
        seed: u64,
    ) -> Result<Self, Error> {
        Ok(Self {
            network: NetworkPlayer::begin(settings, instance, config, seed)?,
            planner: ReplanPolicy::begin(instance, config, seed),
            judge: NetworkEpisode::begin(&judge.network, &judge.encoder, instance, config)?,
            sides: Vec::new(),
        })
    }

    /// Decides which agents follow EPOM.
    fn choose_sides(&mut self, state: State<'_>) -> Result<(), Error> {
        let (values, _) = self.judge.outputs(state)?.as_chunks::<NUM_VALUES>();
        let preferences = values.iter().map(|[learning, planning]| learning > planning);
        if self.sides.is_empty() {
            self.sides.extend(preferences.map(|learns| Side { learns, steps: 0 }));
        } else {
            for (side, prefers_learning) in self.sides.iter_mut().zip(preferences) {
                *side = side.next(prefers_learning);
            }
        }
        Ok(())
    }
}

impl Player for LSwitcher {
    fn network_time(&self) -> Duration {
        self.network.network_time() + self.judge.network_time()
    }

    /// EPOM and RePlan always act for all agents, so their memories know every state.
    fn act(&mut self, state: State<'_>) -> Result<Vec<Action>, Error> {
        self.choose_sides(state)?;
        let mut actions = self.network.act(state)?;
        let planned = self.planner.act(state);
        for ((action, planned), side) in actions.iter_mut().zip(planned).zip(&self.sides) {
            if !side.learns {
                *action = planned;
            }
        }
        Ok(actions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns whether an agent follows EPOM in each step, given its preferences.
    fn sides(preferences: impl IntoIterator<Item = bool>) -> Vec<bool> {
        let mut side: Option<Side> = None;
        let mut next = |prefers: bool| {
            let now = side.map_or(Side { learns: prefers, steps: 0 }, |side| side.next(prefers));
            side = Some(now);
            now.learns
        };
        preferences.into_iter().map(&mut next).collect()
    }

    #[test]
    fn an_agent_changes_sides_after_50_steps_at_the_earliest() {
        let found = sides((0..200).map(|step| step > 0));
        // The counter is 0 in step 1, so it is 50 in step 51.
        assert_eq!(found.iter().position(|&learns| learns), Some(51));
        let found = sides((0..200).map(|step| step % 2 == 0));
        let changes: Vec<_> = (1..200).filter(|&step| found[step] != found[step - 1]).collect();
        assert_eq!(changes, [51, 102, 153]);
    }

    #[test]
    fn an_agent_that_prefers_its_side_stays_there() {
        assert_eq!(sides([false; 120]), [false; 120]);
        assert_eq!(sides([true; 120]), [true; 120]);
    }
}
