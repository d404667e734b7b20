//! The errors of a forward pass.

use pogema_core::Error;

/// An error of [`Network::forward`](super::Network::forward).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ForwardError {
    /// An input has the wrong length.
    #[error("{0}")]
    Length(#[source] Error),
    /// The logits or the value of an agent, given by its index in the batch, are infinite or no number.
    #[error("the network returned a logit or value for agent {row} of the batch that is no finite number")]
    NotFinite {
        /// The index of the agent in the batch.
        row: usize,
    },
}
