//! Policies of whole episodes, by name: networks, planners, and POGEMA's own policies.

mod aswitcher;
mod learned;
mod lswitcher;
mod method;
mod named;
mod network;
mod network_episode;
mod network_player;
mod sampler;
mod shipped;

pub use learned::LearnedPolicy;
pub use method::{Learned, LearnedName};
pub use named::{NamedPolicy, PolicySettings, SimplePolicy};
pub use shipped::ShippedWeights;
