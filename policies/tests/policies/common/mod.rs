//! Episodes for tests.

pub mod recorded;
pub mod weights;

use pogema_core::{Action, Episode, Error, Instance};
use pogema_fast::Engine;
use pogema_maps::{GridConfig, InstanceSource};
use pogema_numpy::Generator;

/// Returns the instance of a config.
pub fn instance(config: &GridConfig) -> Result<Instance, Error> {
    Ok(InstanceSource::new(config.clone(), None)?.generate()?.instance)
}

/// Starts the episode of a config in YAML.
pub fn start(yaml: &str) -> Result<Episode<Engine>, Error> {
    let config = GridConfig::from_yaml(yaml)?;
    let mut episode = Episode::new(Engine::new(config.rules())?);
    episode.start(instance(&config)?)?;
    Ok(episode)
}

/// Draws actions that mostly move.
pub fn actions(generator: &mut Generator, num_agents: usize) -> Vec<Action> {
    pogema_planners::sample(generator, num_agents)
}
