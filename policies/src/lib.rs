//! Learned policies for POGEMA environments, which play on all cores and without Python.

mod network;
mod onnx;
mod simd;

pub use network::{
    Architecture, Channel, EncoderConfig, ForwardError, Inputs, Layer, Network, NetworkConfig, Outputs,
    RecurrentState, Sampling, SamplingConfig, Scalars, Workspace, softmax,
};

/// The README, whose example the tests compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
