//! Learned policies for POGEMA environments. They run without Python.
//!
//! An [`Encoder`] encodes the states of an environment as the inputs of a network, and a [`Network`] maps these inputs
//! to the logits of the actions. [`MatsLp`] searches with a network.

mod encode;
mod follower;
mod grid;
mod mats_lp;
mod network;
mod onnx;
mod policy;
mod replan;
mod simd;

pub use encode::{Channel, Encoder, EncoderSettings, Scalars};
pub use follower::FollowerVersion;
pub use mats_lp::{Evaluate, Evaluation, MatsLp, MatsLpParams, MatsLpStats, NetworkPrior, Prior, RootChild};
pub use network::{
    Architecture, ForwardError, Inputs, Layer, Network, NetworkConfig, Outputs, RecurrentState, Sampling,
    SamplingConfig, Workspace, softmax,
};
pub use policy::{
    Learned, LearnedName, LearnedPolicy, NamedPolicy, PolicySettings, ShippedWeights, SimplePolicy,
};

/// The README, whose example the tests compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
