//! Learned policies for POGEMA environments, which play on all cores and without Python.
//!
//! An [`Encoder`] turns the states of an environment into what a policy sees. [`MatsLp`] searches with a network.

mod encode;
mod mats_lp;
mod network;
mod simd;

pub use encode::{Channel, Encoder, EncoderSettings, Feature};
pub use mats_lp::{Evaluate, Evaluation, MatsLp, MatsLpParams, MatsLpStats, NetworkPrior, Prior};
pub use network::{
    Architecture, Channel as NetworkChannel, EncoderConfig, ForwardError, Inputs, Layer, Network,
    NetworkConfig, Outputs, RecurrentState, Sampling, SamplingConfig, Scalars, Workspace, softmax,
};

/// The README, whose example the tests compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
