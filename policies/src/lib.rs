//! Learned policies for POGEMA environments, which play on all cores and without Python.
//!
//! An [`Encoder`] turns the states of an environment into what a policy sees.

#![forbid(unsafe_code)]

mod encode;
mod follower;

pub use encode::{Channel, Encoder, EncoderSettings, Feature};
pub use follower::FollowerVersion;

/// The README, whose example the tests compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
