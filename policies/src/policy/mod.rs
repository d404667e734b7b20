//! Policies of whole episodes, by name: networks, planners, and POGEMA's own policies.

mod learned;
mod named;
mod sampler;

pub use learned::{Learned, LearnedPolicy};
pub use named::{LearnedName, NamedPolicy, PolicySettings, SimplePolicy};
