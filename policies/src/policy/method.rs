//! Learned policies with their networks.

use std::path::Path;

use pogema_core::{Error, words};

use crate::mats_lp::{MatsLpParams, NetworkPrior};
use crate::network::{Network, Sampling};
use crate::policy::learned::NetworkPolicy;

words! {
    /// The policies that need the weights of a network.
    pub enum LearnedName {
        /// Paths that avoid traffic, followed by a network: Follower and Follower-lite.
        Follower = "follower",
        /// Tree search over the actions of nearby agents, guided by a network. It knows future goals.
        MatsLp = "mats-lp",
        /// Any network whose JSON file names its encoder.
        Network = "network",
    }
}

/// A learned policy with its network.
#[derive(Clone, Debug)]
pub enum Learned {
    /// A network that chooses the action of each agent.
    Network(NetworkPolicy),
    /// A search, with the network that guides it.
    MatsLp(NetworkPrior, MatsLpParams),
}

impl LearnedName {
    /// Reads the policy from a file with the weights of its network.
    ///
    /// # Errors
    /// [`Error::Io`] with the path if the file cannot be read, or its network does not fit the policy.
    pub fn read(self, weights: &Path) -> Result<Learned, Error> {
        let network = Network::read(weights)?;
        let learned = match self {
            Self::Follower => NetworkPolicy::follower(network).map(Learned::Network),
            Self::MatsLp => {
                NetworkPrior::new(network).map(|prior| Learned::MatsLp(prior, MatsLpParams::default()))
            }
            Self::Network => NetworkPolicy::new(network).map(Learned::Network),
        };
        learned.map_err(|error| Error::io(weights, error))
    }
}

impl Learned {
    /// Replaces the rule that chooses actions from logits.
    ///
    /// # Errors
    /// [`Error::Request`] for MATS-LP, which plays the most visited action.
    pub fn with_sampling(self, sampling: Sampling) -> Result<Self, Error> {
        match self {
            Self::Network(policy) => Ok(Self::Network(policy.with_sampling(sampling))),
            Self::MatsLp(..) => {
                Err(Error::request("`mats-lp` draws no actions, so it has no rule of sampling"))
            }
        }
    }

    /// Forbids actions that lead into an obstacle or off the map, if `masks_actions` is set [default: not].
    ///
    /// # Errors
    /// [`Error::Request`] for MATS-LP, which forbids them in any case.
    pub fn with_masks(self, masks_actions: bool) -> Result<Self, Error> {
        match self {
            Self::Network(policy) => Ok(Self::Network(policy.with_masks(masks_actions))),
            Self::MatsLp(..) if masks_actions => {
                Err(Error::request("`mats-lp` never moves into obstacles, so it has no mask of actions"))
            }
            Self::MatsLp(..) => Ok(self),
        }
    }
}
