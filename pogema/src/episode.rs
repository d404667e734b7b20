//! Starts episodes from configs.

use pogema_core::{Environment, Episode, Error, Map};
use pogema_fast::Engine;
use pogema_maps::{GridConfig, InstanceSource, named_map};

/// Starts the episode of a config on the fast engine and measures all metrics.
///
/// `map_name` names a built-in map; for other maps, create an [`InstanceSource`].
///
/// # Errors
/// If the config is out of range or names an unknown map; otherwise those of [`InstanceSource::generate`].
pub fn start(config: &GridConfig) -> Result<Episode<Engine>, Error> {
    start_on(Engine::new(config.rules())?, config)
}

/// Starts the episode of a config on any engine; otherwise works like [`start`].
///
/// The engine must have the rules of the config ([`GridConfig::rules`]): the config gives only the instance.
///
/// # Errors
/// Those of [`start`], or if the instance does not fit the engine.
pub fn start_on<E: Environment>(engine: E, config: &GridConfig) -> Result<Episode<E>, Error> {
    let instance = InstanceSource::new(config.clone(), built_in(config)?)?.generate()?.instance;
    let mut episode = Episode::new(engine).with_density().with_collisions();
    episode.start(instance)?;
    Ok(episode)
}

/// Returns the built-in map that the `map_name` of a config names.
///
/// Rule: grid/named
pub(crate) fn built_in(config: &GridConfig) -> Result<Option<Map>, Error> {
    config.map_name.as_deref().map(|name| named_map(name).map(|text| text.map)).transpose()
}
