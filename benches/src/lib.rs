//! Code shared by the benchmarks: the environments of POGEMA's paper, and the folder of the published networks.

#![forbid(unsafe_code)]

use pogema_core::{Config, Error, Instance};
use pogema_maps::{GridConfig, InstanceSource};
use serde_json::json;

#[path = "../../policies/tests/common/weights.rs"]
mod weights;

pub use weights::weights;

/// Returns the paper's lifelong config for a map of `size` × `size` cells.
///
/// # Errors
/// If the sizes are out of range.
pub fn config(size: usize, num_agents: usize, seed: u64) -> Result<GridConfig, Error> {
    GridConfig::from_value(&json!({
        "size": size, "density": 0.3, "num_agents": num_agents, "obs_radius": 5, "seed": seed,
        "collision_system": "soft", "on_target": "restart", "max_episode_steps": 256,
    }))
}

/// Returns the rules and the instance of the paper's config.
///
/// # Errors
/// If the sizes are out of range, or the map has too few cells for the agents.
pub fn episode(size: usize, num_agents: usize, seed: u64) -> Result<(Config, Instance), Error> {
    let config = config(size, num_agents, seed)?;
    let rules = config.rules();
    Ok((rules, InstanceSource::new(config, None)?.generate()?.instance))
}
