//! Policies of whole episodes, by name: networks, planners, and POGEMA's own policies.

mod learned;
mod method;
mod named;
mod sampler;

pub use learned::{LearnedPolicy, NetworkPolicy};
pub use method::{Learned, LearnedName};
pub use named::{NamedPolicy, PolicySettings, SimplePolicy};
