//! Learned policies with their networks.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use pogema_core::{Config, Error, Instance, Words, words};

use crate::encode::EncoderSettings;
use crate::mats_lp::{MatsLp, MatsLpParams, NetworkPrior};
use crate::network::{Network, Sampling};
use crate::policy::aswitcher::ASwitcher;
use crate::policy::learned::LearnedPolicy;
use crate::policy::lswitcher::{Judge, LSwitcher};
use crate::policy::network::NetworkPolicy;
use crate::policy::network_player::NetworkPlayer;
use crate::policy::shipped::{self, ShippedWeights};

words! {
    /// The policies that play with a network.
    pub enum LearnedName {
        /// ASwitcher: RePlan's search, and EPOM's network where the search has no move.
        ASwitcher = "aswitcher",
        /// EPOM, whose network sees the obstacles that its agent remembers.
        Epom = "epom",
        /// Paths that avoid traffic, followed by a network: Follower and Follower-lite.
        Follower = "follower",
        /// Follower with a larger, recurrent network of this project.
        FollowerLarge = "follower-large",
        /// Follower with a small network of this project, which has the size of Follower-lite's.
        FollowerSmall = "follower-small",
        /// IPPO, whose windows show costs to go.
        Ippo = "ippo",
        /// IQL, whose windows show costs to go.
        Iql = "iql",
        /// LSwitcher: RePlan or EPOM, whichever a network judges better.
        LSwitcher = "lswitcher",
        /// MAPPO, whose windows show costs to go.
        Mappo = "mappo",
        /// Tree search over the actions of nearby agents, guided by a network. It knows future goals.
        MatsLp = "mats-lp",
        /// Any network whose JSON file names its encoder.
        Network = "network",
        /// QMIX, whose windows show costs to go.
        Qmix = "qmix",
        /// QPLEX, whose windows show costs to go.
        Qplex = "qplex",
        /// VDN, whose windows show costs to go.
        Vdn = "vdn",
    }
}

/// A learned policy with its network and its settings.
#[derive(Clone, Debug)]
pub struct Learned(Method);

#[derive(Clone, Debug)]
enum Method {
    Network(NetworkPolicy),
    ASwitcher(NetworkPolicy),
    // In a box, so that this enum is small enough for an `Err`.
    LSwitcher(NetworkPolicy, Box<Judge>),
    MatsLp(NetworkPrior, MatsLpParams),
}

impl LearnedName {
    /// Reads the policy from a file with the weights of its network.
    ///
    /// # Errors
    /// [`Error::Io`] with the path if the file cannot be read, or its network does not fit the policy;
    /// [`Error::Argument`] as for [`Network::read`].
    pub fn read(self, weights: &Path) -> Result<Learned, Error> {
        self.of_network(Network::read(weights)?).map_err(|error| Error::io(weights, error))
    }

    /// Returns the policy with the weights that this crate contains for it.
    ///
    /// # Errors
    /// [`Error::Request`] if this crate contains no weights for the policy; [`Error::Argument`] as for
    /// [`Network::read`].
    pub fn with_shipped_weights(self) -> Result<Learned, Error> {
        let missing = || Error::request(format!("`{}` needs the weights of a network", self.word()));
        let ShippedWeights { config, tensors } = self.shipped_weights().ok_or_else(missing)?;
        self.of_network(Network::from_bytes(config, tensors)?)
    }

    /// Returns the weights that this crate contains for the policy.
    pub fn shipped_weights(self) -> Option<ShippedWeights> {
        match self {
            Self::ASwitcher | Self::Epom => Some(shipped::EPOM),
            Self::Follower => Some(shipped::FOLLOWER),
            Self::FollowerLarge => Some(shipped::FOLLOWER_LARGE),
            Self::FollowerSmall => Some(shipped::FOLLOWER_SMALL),
            Self::Ippo => Some(shipped::IPPO),
            Self::Iql => Some(shipped::IQL),
            Self::LSwitcher => Some(shipped::LSWITCHER),
            Self::Mappo => Some(shipped::MAPPO),
            Self::Qmix => Some(shipped::QMIX),
            Self::Qplex => Some(shipped::QPLEX),
            Self::Vdn => Some(shipped::VDN),
            Self::MatsLp | Self::Network => None,
        }
    }

    /// Returns the policy with a network.
    ///
    /// # Errors
    /// [`Error::Request`] if the network does not fit the policy; [`Error::Config`] for invalid settings of its
    /// encoder.
    pub fn of_network(self, network: Network) -> Result<Learned, Error> {
        let method = match self {
            Self::ASwitcher => NetworkPolicy::new(network).map(Method::ASwitcher),
            Self::Follower | Self::FollowerLarge | Self::FollowerSmall => {
                NetworkPolicy::follower(network).map(Method::Network)
            }
            Self::LSwitcher => {
                let judge = Box::new(Judge::new(network)?);
                let ShippedWeights { config, tensors } = shipped::EPOM;
                let epom = NetworkPolicy::new(Network::from_bytes(config, tensors)?);
                epom.map(|epom| Method::LSwitcher(epom, judge))
            }
            Self::MatsLp => {
                NetworkPrior::new(network).map(|prior| Method::MatsLp(prior, MatsLpParams::default()))
            }
            Self::Epom
            | Self::Ippo
            | Self::Iql
            | Self::Mappo
            | Self::Network
            | Self::Qmix
            | Self::Qplex
            | Self::Vdn => NetworkPolicy::new(network).map(Method::Network),
        };
        method.map(Learned)
    }
}

impl Learned {
    /// Begins an episode. The same seed gives the same actions on any number of threads.
    ///
    /// Only MATS-LP uses `threads` and `cancelled`: it stops if another thread sets `cancelled`. It does not sample
    /// actions, so it ignores the seed.
    ///
    /// # Errors
    /// [`Error::Argument`] for a number of threads out of range, for a seed of more than 32 bits with
    /// [`Sampling::Follower`], or if MATS-LP needs a critic that its network lacks.
    pub fn begin(
        &self,
        instance: &Instance,
        config: &Config,
        seed: u64,
        threads: usize,
        cancelled: Option<Arc<AtomicBool>>,
    ) -> Result<LearnedPolicy, Error> {
        match &self.0 {
            Method::Network(policy) => {
                NetworkPlayer::begin(policy.settings(), instance, config, seed).map(LearnedPolicy::new)
            }
            Method::ASwitcher(policy) => {
                ASwitcher::begin(policy.settings(), instance, config, seed).map(LearnedPolicy::new)
            }
            Method::LSwitcher(policy, judge) => {
                LSwitcher::begin(policy.settings(), judge, instance, config, seed).map(LearnedPolicy::new)
            }
            Method::MatsLp(prior, params) => {
                let mut search = MatsLp::new(prior, *params, threads)?.with_cancellation(cancelled);
                search.begin(instance, config.on_goal);
                Ok(LearnedPolicy::new(search))
            }
        }
    }

    /// Returns the network of the policy's weights; `None` for MATS-LP, whose network only guides a search.
    ///
    /// The network of ASwitcher moves some agents. The network of LSwitcher chooses between RePlan and EPOM.
    pub fn network(&self) -> Option<&Network> {
        match &self.0 {
            Method::Network(policy) | Method::ASwitcher(policy) => Some(policy.network()),
            Method::LSwitcher(_, judge) => Some(judge.network()),
            Method::MatsLp(..) => None,
        }
    }

    /// Returns the settings of the encoder for the network of [`Learned::network`].
    pub fn encoder(&self) -> Option<&EncoderSettings> {
        match &self.0 {
            Method::Network(policy) | Method::ASwitcher(policy) => Some(policy.encoder()),
            Method::LSwitcher(_, judge) => Some(judge.encoder()),
            Method::MatsLp(..) => None,
        }
    }

    /// Returns the rule that chooses actions from logits; `None` for MATS-LP.
    pub fn sampling(&self) -> Option<Sampling> {
        match &self.0 {
            Method::Network(policy) | Method::ASwitcher(policy) | Method::LSwitcher(policy, _) => {
                Some(policy.sampling())
            }
            Method::MatsLp(..) => None,
        }
    }

    /// Checks that the policy can play on a number of threads.
    ///
    /// # Errors
    /// [`Error::Argument`] for MATS-LP, if the number is out of range.
    pub fn check_threads(&self, threads: usize) -> Result<(), Error> {
        match &self.0 {
            Method::Network(_) | Method::ASwitcher(_) | Method::LSwitcher(..) => Ok(()),
            Method::MatsLp(prior, params) => MatsLp::new(prior, *params, threads).map(|_| ()),
        }
    }

    /// Replaces the rule that chooses actions from logits.
    ///
    /// # Errors
    /// [`Error::Request`] for MATS-LP, which plays the most visited action.
    pub fn with_sampling(self, sampling: Sampling) -> Result<Self, Error> {
        self.with_network_policy(|policy| policy.with_sampling(sampling))
            .map_err(|_| Error::request("`mats-lp` does not sample actions, so `sampling` is not allowed"))
    }

    /// Sets whether actions that lead into an obstacle or off the map are forbidden [default: as the network's JSON
    /// says].
    ///
    /// # Errors
    /// [`Error::Request`] for MATS-LP, which always forbids them.
    pub fn with_masks(self, masks_actions: bool) -> Result<Self, Error> {
        self.with_network_policy(|policy| policy.with_masks(masks_actions)).map_err(|_| {
            Error::request("`mats-lp` never moves into obstacles, so `mask_actions` is not allowed")
        })
    }

    /// Changes the settings of the network policy that chooses actions; returns MATS-LP unchanged as an error.
    fn with_network_policy(self, change: impl FnOnce(NetworkPolicy) -> NetworkPolicy) -> Result<Self, Self> {
        match self.0 {
            Method::Network(policy) => Ok(Self(Method::Network(change(policy)))),
            Method::ASwitcher(policy) => Ok(Self(Method::ASwitcher(change(policy)))),
            Method::LSwitcher(policy, judge) => Ok(Self(Method::LSwitcher(change(policy), judge))),
            method @ Method::MatsLp(..) => Err(Self(method)),
        }
    }

    /// Sets the number of expansions of each search.
    ///
    /// # Errors
    /// [`Error::Argument`] if it is out of range; [`Error::Request`] for a policy without tree search.
    pub fn with_expansions(self, expansions: u32) -> Result<Self, Error> {
        self.with_params(|params| params.expansions = expansions)
    }

    /// Sets whether a search equals the published program where the program deviates from the paper.
    ///
    /// # Errors
    /// [`Error::Argument`] for `false` if the network has no critic; [`Error::Request`] for a policy that does not
    /// search.
    pub fn with_faithful(self, faithful: bool) -> Result<Self, Error> {
        self.with_params(|params| params.faithful = faithful)
    }

    fn with_params(mut self, change: impl FnOnce(&mut MatsLpParams)) -> Result<Self, Error> {
        let Method::MatsLp(prior, params) = &mut self.0 else {
            return Err(Error::request("the policy has no tree search; only `mats-lp` has"));
        };
        change(params);
        MatsLp::new(prior, *params, 1)?;
        Ok(self)
    }
}
