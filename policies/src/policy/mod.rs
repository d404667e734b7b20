//! Policies of whole episodes, by name: networks, planners, and POGEMA's own policies.

mod learned;
mod method;
mod named;
mod network;
mod network_episode;
mod sampler;
mod shipped;
mod switcher;

pub use learned::LearnedPolicy;
pub use method::{Learned, LearnedName};
pub use named::{NamedPolicy, PolicySettings, SimplePolicy};
pub use network::NetworkPolicy;
pub use shipped::ShippedWeights;
