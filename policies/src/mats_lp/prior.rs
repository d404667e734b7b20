//! The interface through which a search uses its network.

use pogema_core::{Action, Error};

/// A network that gives MATS-LP a distribution over the actions of one agent.
pub trait Prior: Send + Sync {
    /// Returns the number of cells that the network sees in each direction, from 1 to 7.
    fn radius(&self) -> usize;

    /// Returns whether the network has a critic. Without one, [`Evaluation::value`] is 0.
    fn has_critic(&self) -> bool;

    /// Returns an evaluator with memory of its own, for one thread.
    fn evaluator(&self) -> Box<dyn Evaluate>;
}

/// An evaluator of a [`Prior`], used by one thread.
pub trait Evaluate: Send {
    /// Evaluates one input per entry of `out`.
    ///
    /// The result for an input must be bit-identical, independent of the other inputs of the call.
    ///
    /// Shape: `inputs` is `[n, 2, side, side]`, with the side `2 * radius + 1`.
    ///
    /// # Errors
    /// If the network cannot be run. Outputs that are not finite are not an error here.
    fn evaluate(&mut self, inputs: &[f32], out: &mut [Evaluation]) -> Result<(), Error>;
}

/// The outputs of a network for one agent in one state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evaluation {
    /// One logit per action.
    pub logits: [f32; Action::ALL.len()],
    /// The critic's value.
    pub value: f32,
}
