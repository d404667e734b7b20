//! The JSON beside the weights.

use pogema_core::words;
use serde::{Deserialize, Serialize};

use super::architecture::Architecture;
use crate::encode::EncoderSettings;

/// The content of the JSON file beside the weights: what the weights mean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkConfig {
    /// Version of this format: 1.
    pub version: u32,
    /// The layers. An ONNX file has its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub architecture: Option<Architecture>,
    /// What the network sees. If absent, Follower and MATS-LP use their own encoder; all other policies require it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub encoder: Option<EncoderSettings>,
    /// How an action is chosen from the logits.
    #[serde(default)]
    pub sampling: SamplingConfig,
}

impl NetworkConfig {
    /// The only version of the format.
    pub const VERSION: u32 = 1;
}

impl Default for NetworkConfig {
    fn default() -> Self {
        let (version, sampling) = (Self::VERSION, SamplingConfig::default());
        Self { version, architecture: None, encoder: None, sampling }
    }
}

/// The choice of an action from the logits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SamplingConfig {
    /// The rule.
    #[serde(default)]
    pub rule: Sampling,
    /// Whether actions that lead into an obstacle or off the map are forbidden.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub mask_actions: bool,
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
        /// Chooses the action with the largest logit; if several are equal, the first of them.
        Greedy = "greedy",
    }
}
