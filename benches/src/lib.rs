//! What the benches have in common: the environments of POGEMA's paper.

#![forbid(unsafe_code)]

use pogema_core::{Config, Error, Instance};
use pogema_maps::{GridConfig, InstanceSource};
use serde_json::json;

/// The paper's config for a crowd on a map, lifelong.
///
/// # Errors
/// If the sizes are out of range.
pub fn config(size: usize, num_agents: usize, seed: u64) -> Result<GridConfig, Error> {
    GridConfig::from_value(&json!({
        "size": size, "density": 0.3, "num_agents": num_agents, "obs_radius": 5, "seed": seed,
        "collision_system": "soft", "on_target": "restart", "max_episode_steps": 256,
    }))
}

/// The rules and the instance of such a config.
///
/// # Errors
/// If the map has no room for so many agents.
pub fn episode(size: usize, num_agents: usize, seed: u64) -> Result<(Config, Instance), Error> {
    let config = config(size, num_agents, seed)?;
    let rules = config.rules();
    Ok((rules, InstanceSource::new(config, None)?.generate()?.instance))
}
