//! The JSON beside the weights.

use pogema_core::words;
use serde::{Deserialize, Serialize};

use super::architecture::Architecture;

/// The content of the JSON file beside the weights: what the weights mean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkConfig {
    /// Version of this format: 1.
    pub version: u32,
    /// The layers. An ONNX file has its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub architecture: Option<Architecture>,
    /// What the network sees. If absent, the policy that plays the network determines it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub encoder: Option<EncoderConfig>,
    /// How an action is chosen from the logits.
    #[serde(default)]
    pub sampling: SamplingConfig,
}

impl NetworkConfig {
    /// The only version of the format.
    pub const VERSION: u32 = 1;
}

/// The input of a network: the window and the numbers beside it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EncoderConfig {
    /// Radius of the window. Its side is twice the radius plus 1.
    pub radius: usize,
    /// The channels of the window in order.
    pub channels: Vec<Channel>,
    /// The numbers beside the window in order.
    #[serde(default)]
    pub scalars: Vec<Scalars>,
}

words! {
    /// A channel of the window.
    pub enum Channel {
        /// 1 for an obstacle, else 0.
        Obstacles = "obstacles",
        /// 1 for an obstacle that the agent has seen in this episode, else 0.
        Memory = "memory",
        /// 1 for a cell with an agent, the own cell included, else 0.
        Agents = "agents",
        /// 1 for the goal, clamped to the window, else 0.
        Goal = "goal",
        /// -1 for an obstacle, 1 for a cell of Follower's path, else 0.
        FollowerPath = "follower-path",
        /// Distance to the goal as MATS-LP scales it: 1 for the nearest cell, 0 for obstacles.
        CostToGo = "cost-to-go",
    }
}

words! {
    /// Numbers beside the window.
    pub enum Scalars {
        /// Row and column of the agent, relative to its start.
        Position = "position",
        /// Row and column of the goal, relative to the agent's start.
        Goal = "goal",
    }
}

/// The choice of an action from the logits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SamplingConfig {
    /// The rule.
    #[serde(default)]
    pub rule: Sampling,
}

words! {
    /// A rule that chooses an action from the logits.
    #[derive(Default)]
    pub enum Sampling {
        /// Draws from the softmax, with a stream for each agent.
        #[default]
        Softmax = "softmax",
        /// Draws as Follower's C++ code does: one stream for all agents, and integer weights.
        Follower = "follower",
        /// The action with the largest logit, the first of equals.
        Greedy = "greedy",
    }
}
