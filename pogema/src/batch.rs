//! Creates batches from configs.

use std::sync::Arc;

use pogema_core::{Error, Instance, Map};
use pogema_fast::{Batch, Instances, suited_threads};
use pogema_maps::{GridConfig, InstanceSource};

use crate::seeds::Seed;

/// Creates a batch of environments from a config, with as many threads as suit its size, at most one per core.
///
/// Call [`Batch::reset`] before the first step. When an episode ends, the next one starts automatically. Each
/// environment has its own maps: the seeds of all episodes follow from `seed` (see [`Seed::Shared`]).
///
/// # Errors
/// If the config is out of range or does not fit a batch, or if `num_envs` is 0.
pub fn batch(config: &GridConfig, num_envs: usize, seed: u64) -> Result<Batch, Error> {
    let source = EnvSource::new(vec![(config.clone(), None)], vec![0; num_envs])?;
    let source = source.with_seeds(vec![Seed::Shared(seed); num_envs])?;
    let rules = config.rules();
    let num_threads = suited_threads(num_envs, rules.num_agents, rules.num_observed() / rules.num_agents);
    Batch::new(rules, num_envs, num_threads, source)
}

/// A config and the map that its `map_name` names.
type Named = (GridConfig, Option<Map>);

/// Source of the instances of many environments that share rules and array shapes, but not maps.
#[derive(Clone, Debug)]
pub struct EnvSource {
    configs: Arc<[Named]>,
    /// Index of each environment's config.
    of_env: Arc<[usize]>,
    seeds: Vec<Seed>,
}

impl EnvSource {
    /// Creates a source from configs, each with the map that its `map_name` names; `of_env` holds the index of each
    /// environment's config.
    ///
    /// # Errors
    /// [`Error::Argument`] if there are no environments or an index is out of range; [`Error::Config`] if a config does
    /// not fit a batch, or differs from another in a field that all must share.
    pub fn new(configs: Vec<(GridConfig, Option<Map>)>, of_env: Vec<usize>) -> Result<Self, Error> {
        if of_env.is_empty() {
            return Err(Error::argument("num_envs", 0, "at least 1"));
        }
        let shared = Seed::from_os()?;
        let mut seeds = Vec::with_capacity(of_env.len());
        for (env, &index) in of_env.iter().enumerate() {
            let config = configs.get(index).map(|(config, _)| config);
            let config = config.ok_or_else(|| Error::argument("of_env", index, "the index of a config"))?;
            check_playable(config)?;
            check_alike(env, config, &configs[of_env[0]].0)?;
            seeds.push(config.seed.map_or(shared, Seed::Shared));
        }
        Ok(Self { configs: configs.into(), of_env: of_env.into(), seeds })
    }

    /// Replaces the seeds, one for each environment.
    ///
    /// # Errors
    /// [`Error::Length`] if the numbers of seeds and environments differ.
    pub fn with_seeds(self, seeds: Vec<Seed>) -> Result<Self, Error> {
        Error::check_length("seeds", self.of_env.len(), seeds.len())?;
        Ok(Self { seeds, ..self })
    }

    /// Returns each environment's source of seeds.
    pub fn seeds(&self) -> &[Seed] {
        &self.seeds
    }

    /// Returns each environment's source of seeds, for replacing it.
    pub fn seeds_mut(&mut self) -> &mut [Seed] {
        &mut self.seeds
    }

    /// Returns the numbers of rows and columns that hold the map of every environment.
    pub fn largest_map(&self) -> (usize, usize) {
        let sizes = self.configs.iter().map(|(config, registered)| match registered {
            Some(map) if config.map_name.is_some() => (map.height(), map.width()),
            _ => (config.height, config.width),
        });
        sizes.fold((0, 0), |most, size| (most.0.max(size.0), most.1.max(size.1)))
    }

    /// Returns the config of an environment.
    pub fn config(&self, env: usize) -> &GridConfig {
        &self.configs[self.of_env[env]].0
    }
}

impl Instances for EnvSource {
    fn instance(&self, env: usize, episode: u64) -> Result<Instance, Error> {
        let (config, registered) = &self.configs[self.of_env[env]];
        let seed = self.seeds[env].of_episode(env, episode);
        // A new source for each episode, because pools would depend on earlier episodes.
        let config = GridConfig { seed: Some(seed), ..config.clone() };
        let generated = InstanceSource::new(config, registered.clone()).and_then(|mut one| one.generate());
        generated.map(|generated| generated.instance).map_err(|error| {
            Error::instance(format!("environment {env}, episode {episode}, seed {seed}: {error}"))
        })
    }
}

fn check_playable(config: &GridConfig) -> Result<(), Error> {
    if config.persistent {
        return Err(Error::config("persistent", true, "false, because a batch keeps no steps"));
    }
    Ok(())
}

/// Checks that a config has the same shapes and rules as that of the first environment.
fn check_alike(env: usize, config: &GridConfig, first: &GridConfig) -> Result<(), Error> {
    const SHARED: [&str; 8] = [
        "num_agents",
        "obs_radius",
        "collision_system",
        "on_target",
        "max_episode_steps",
        "observation_type",
        "occupancy",
        "reward",
    ];
    if config.rules() == first.rules() {
        return Ok(());
    }
    let (own, first) = (config.to_value(), first.to_value());
    let field = SHARED.into_iter().find(|&field| own[field] != first[field]).unwrap_or("config");
    let expected = format!("{}, because environment {env} must share it with environment 0", first[field]);
    Err(Error::config(field, &own[field], expected))
}
