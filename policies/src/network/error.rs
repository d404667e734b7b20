//! The errors of a forward pass.

use pogema_core::Error;

/// An error of [`Network::forward`](super::Network::forward).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ForwardError {
    /// An input has the wrong length.
    #[error("{0}")]
    Length(#[source] Error),
    /// An operator of an ONNX graph failed.
    #[error("{0}")]
    Runtime(String),
    /// The logits or the value of an agent, given by its index in the batch, are infinite or NaN.
    #[error("the logits or the value of agent {row} of the batch are not finite")]
    NotFinite {
        /// The index of the agent in the batch.
        row: usize,
    },
}
