//! Starts episodes from configs.

use pogema_core::{Environment, Episode, Error};
use pogema_fast::Engine;
use pogema_maps::{GridConfig, InstanceSource};

/// Starts the episode of a config on the fast engine and records all metrics.
///
/// # Errors
/// If the config is out of range, or its map has no room for the agents.
pub fn start(config: &GridConfig) -> Result<Episode<Engine>, Error> {
    start_on(Engine::new(config.rules())?, config)
}

/// Starts the episode of a config on any engine and records all metrics.
///
/// # Errors
/// If the config is out of range, or its map has no room for the agents.
pub fn start_on<E: Environment>(engine: E, config: &GridConfig) -> Result<Episode<E>, Error> {
    let instance = InstanceSource::new(config.clone(), None)?.generate()?.instance;
    let mut episode = Episode::new(engine).with_density().with_collisions();
    episode.start(instance)?;
    Ok(episode)
}
