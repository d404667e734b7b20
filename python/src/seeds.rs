//! Which instance each episode of each environment of a `VecEnv` plays.

use std::sync::Arc;

use pogema_core::{Error, Instance, Map, Observation};
use pogema_fast::Instances;
use pogema_maps::{GridConfig, InstanceSource};
use pogema_numpy::SeedSequence;

use crate::config;

/// Seeds are below this, as POGEMA wants them.
const SEEDS: u64 = i64::MAX as u64;

/// Where the seeds of an environment's episodes come from.
///
/// They depend on the seed given, the environment's number and the episode's, and on nothing else. With NumPy, where
/// `first(key)` is `int(SeedSequence(seed, spawn_key=key).generate_state(1, uint64)[0]) % (2**63 - 1)`:
///
/// | seed given | episode 0 | episode e |
/// | --- | --- | --- |
/// | one for all | `first((env, 0))` | `first((env, e))` |
/// | one of its own | the seed itself | `first((e,))` |
#[derive(Clone, Copy, Debug)]
pub enum Seed {
    /// One for all environments.
    Shared(u64),
    /// One of its own.
    Own(u64),
}

impl Seed {
    /// A seed for all that nobody can foresee.
    pub fn from_os() -> Result<Self, Error> {
        let sequence = SeedSequence::from_os()
            .map_err(|error| Error::instance(format!("the system gives no random seed: {error}")))?;
        Ok(Self::Shared(first(&sequence)))
    }

    /// POGEMA's seed of an episode.
    pub fn of_episode(self, env: usize, episode: u64) -> u64 {
        match self {
            Self::Shared(seed) => first(&SeedSequence::spawned(seed, &[env as u64, episode])),
            Self::Own(seed) if episode == 0 => seed,
            Self::Own(seed) => first(&SeedSequence::spawned(seed, &[episode])),
        }
    }
}

fn first(sequence: &SeedSequence) -> u64 {
    let [state] = sequence.generate_state_u64();
    state % SEEDS
}

/// A config with the map that it names.
type Named = (GridConfig, Option<Map>);

/// The instances of all environments.
#[derive(Clone)]
pub struct Source {
    configs: Arc<[Named]>,
    /// Which config each environment has.
    of_env: Arc<[usize]>,
    /// Where each environment's seeds come from.
    pub seeds: Vec<Seed>,
}

impl Source {
    /// A source for environments of some configs in JSON, each with the text of the map that it names.
    ///
    /// # Errors
    /// If a config is wrong or no config of a `VecEnv`; if two differ in what the environments have to share.
    pub fn new(configs: &[(String, Option<String>)], of_env: Vec<usize>) -> Result<Self, Error> {
        let read = |(config, map): &(String, Option<String>)| config::read(config, map.as_deref());
        let configs = configs.iter().map(read).collect::<Result<Arc<[Named]>, _>>()?;
        let shared = Seed::from_os()?;
        let mut seeds = Vec::with_capacity(of_env.len());
        for (env, &index) in of_env.iter().enumerate() {
            let config = configs.get(index).map(|(config, _)| config);
            let config = config.ok_or_else(|| Error::config("config", index, "the number of a config"))?;
            check_playable(config)?;
            check_alike(env, config, &configs[of_env[0]].0)?;
            seeds.push(config.seed.map_or(shared, Seed::Shared));
        }
        Ok(Self { configs, of_env: of_env.into(), seeds })
    }

    /// The config of an environment.
    pub fn config(&self, env: usize) -> &GridConfig {
        &self.configs[self.of_env[env]].0
    }
}

impl Instances for Source {
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
        let value = config.to_value()["observation_type"].to_string();
        return Err(Error::config("observation_type", value, "`default`, which a VecEnv observes"));
    }
    if config.persistent {
        return Err(Error::config("persistent", true, "false, since a VecEnv keeps no steps"));
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
