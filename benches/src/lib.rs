//! The environments of POGEMA's paper, shared by the benchmarks.

#![forbid(unsafe_code)]

use std::path::PathBuf;

use pogema_core::{Config, Error, Instance};
use pogema_maps::{GridConfig, InstanceSource};
use serde_json::json;

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

/// Returns the folder of the published networks, which the environment variable `POGEMA_WEIGHTS` names; without it,
/// prints that `bench` is skipped.
pub fn weights(bench: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("POGEMA_WEIGHTS").filter(|folder| !folder.is_empty());
    if folder.is_none() {
        eprintln!("SKIPPED: {bench}: POGEMA_WEIGHTS does not name the folder of the published networks");
    }
    folder.map(PathBuf::from)
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
