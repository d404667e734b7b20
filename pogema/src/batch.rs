//! From a config to a batch.

use std::sync::Arc;

use pogema_core::{Error, Instance, MAX_THREADS, Map, Observation};
use pogema_fast::{Batch, Instances};
use pogema_maps::{GridConfig, InstanceSource};

use crate::seeds::Seed;

/// Makes a batch of environments of a config, with one thread for each core. Call [`Batch::reset`] before the first
/// step; an episode that ends is followed by the next one.
///
/// Each environment has its own maps: the seeds of all episodes follow from `seed` (see [`Seed::Shared`]).
///
/// # Errors
/// If the config is out of range or does not fit a batch, or for no environments.
pub fn batch(config: &GridConfig, num_envs: usize, seed: u64) -> Result<Batch, Error> {
    let source = EnvSource::new(vec![(config.clone(), None)], vec![0; num_envs])?;
    let source = source.with_seeds(vec![Seed::Shared(seed); num_envs])?;
    let num_cores = std::thread::available_parallelism().map_or(1, usize::from);
    Batch::new(config.rules(), num_envs, num_cores.min(MAX_THREADS), source)
}

/// A config with the map that it names.
type Named = (GridConfig, Option<Map>);

/// The instances of many environments that share rules and shapes, but not maps.
#[derive(Clone, Debug)]
pub struct EnvSource {
    configs: Arc<[Named]>,
    /// Which config each environment has.
    of_env: Arc<[usize]>,
    seeds: Vec<Seed>,
}

impl EnvSource {
    /// A source for environments of some configs, each with the map that its `map_name` names; `of_env` chooses a config
    /// for each environment.
    ///
    /// # Errors
    /// [`Error::Argument`] for no environments; [`Error::Config`] for a config that does not fit a batch, or differs from another in what they have to share.
    pub fn new(configs: Vec<(GridConfig, Option<Map>)>, of_env: Vec<usize>) -> Result<Self, Error> {
        if of_env.is_empty() {
            return Err(Error::argument("num_envs", 0, "at least 1"));
        }
        let shared = Seed::from_os()?;
        let mut seeds = Vec::with_capacity(of_env.len());
        for (env, &index) in of_env.iter().enumerate() {
            let config = configs.get(index).map(|(config, _)| config);
            let config = config.ok_or_else(|| Error::argument("of_env", index, "the number of a config"))?;
            check_playable(config)?;
            check_alike(env, config, &configs[of_env[0]].0)?;
            seeds.push(config.seed.map_or(shared, Seed::Shared));
        }
        Ok(Self { configs: configs.into(), of_env: of_env.into(), seeds })
    }

    /// The same source with other seeds, one for each environment.
    ///
    /// # Errors
    /// [`Error::Length`] for another number of seeds.
    pub fn with_seeds(self, seeds: Vec<Seed>) -> Result<Self, Error> {
        Error::check_length("seeds", self.of_env.len(), seeds.len())?;
        Ok(Self { seeds, ..self })
    }

    /// The source of each environment's seeds.
    pub fn seeds(&self) -> &[Seed] {
        &self.seeds
    }

    /// The source of each environment's seeds, to choose others.
    pub fn seeds_mut(&mut self) -> &mut [Seed] {
        &mut self.seeds
    }

    /// The config of an environment.
    pub fn config(&self, env: usize) -> &GridConfig {
        &self.configs[self.of_env[env]].0
    }
}

impl Instances for EnvSource {
    fn instance(&self, env: usize, episode: u64) -> Result<Instance, Error> {
        let (config, registered) = &self.configs[self.of_env[env]];
        let seed = self.seeds[env].of_episode(env, episode);
        // A source of its own for each episode, since pools would remember the episodes before.
        let config = GridConfig { seed: Some(seed), ..config.clone() };
        let generated = InstanceSource::new(config, registered.clone()).and_then(|mut one| one.generate());
        generated.map(|generated| generated.instance).map_err(|error| {
            Error::instance(format!("environment {env}, episode {episode}, seed {seed}: {error}"))
        })
    }
}

fn check_playable(config: &GridConfig) -> Result<(), Error> {
    if config.observation_type != Observation::Default {
        let expected = "`default`, the only one that a batch observes";
        return Err(Error::config("observation_type", config.observation_type, expected));
    }
    if config.persistent {
        return Err(Error::config("persistent", true, "false, since a batch keeps no steps"));
    }
    Ok(())
}

/// Passes if a config has the same shapes and rules as the first environment's.
fn check_alike(env: usize, config: &GridConfig, first: &GridConfig) -> Result<(), Error> {
    const SHARED: [&str; 7] = [
        "num_agents",
        "obs_radius",
        "collision_system",
        "on_target",
        "max_episode_steps",
        "occupancy",
        "reward",
    ];
    if config.rules() == first.rules() {
        return Ok(());
    }
    let (own, first) = (config.to_value(), first.to_value());
    let field = SHARED.into_iter().find(|&field| own[field] != first[field]).unwrap_or("config");
    let expected = format!("{}, since environment {env} has to share it with environment 0", first[field]);
    Err(Error::config(field, &own[field], expected))
}
