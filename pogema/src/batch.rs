//! Creates batches from configs.

use std::sync::Arc;

use pogema_core::{Config, Error, Instance, Map};
use pogema_fast::{Batch, Instances, suited_threads};
use pogema_maps::{GridConfig, InstanceSource};

use crate::episode::built_in;
use crate::seeds::Seed;

/// Creates a batch of environments from a config.
///
/// The number of threads suits a batch of this size with `u8` observations, and is at most one per core.
///
/// Call [`Batch::reset`] before the first step. When an episode ends, the next one starts automatically. Each
/// environment has its own maps: the seeds of all episodes follow from `seed` (see [`Seed::Shared`]). If a drawn map
/// has no room for all agents, another is drawn. `map_name` names a built-in map; for other maps, create an
/// [`EnvSource`].
///
/// # Errors
/// If the config is out of range, does not fit a batch or names an unknown map, or if `num_envs` is 0.
pub fn batch(config: &GridConfig, num_envs: usize, seed: u64) -> Result<Batch, Error> {
    let rules = config.rules();
    rules.check()?;
    let source = EnvSource::new(vec![(config.clone(), built_in(config)?)], vec![0; num_envs])?;
    let source = source.with_seeds(vec![Seed::Shared(seed); num_envs])?;
    let values_per_agent = Config { num_agents: 1, ..rules }.num_observed();
    let num_threads = suited_threads(num_envs, rules.num_agents, values_per_agent);
    Batch::new(rules, num_envs, num_threads, source)
}

/// Maximum number of maps that are drawn for an episode until one has room for all agents.
///
/// POGEMA draws up to 11 for an episode without a seed. A training run draws millions of maps, and must not end because
/// one of them has no room.
const MAX_ATTEMPTS: u64 = 100;

/// A config and the map that its `map_name` names.
pub type ConfigWithMap = (GridConfig, Option<Map>);

/// Source of the instances of many environments. They share the rules and the radius, but their maps and their numbers
/// of agents may differ.
#[derive(Clone, Debug)]
pub struct EnvSource {
    /// The config of each environment. Environments made from the same entry of a list share one.
    configs: Arc<[Arc<ConfigWithMap>]>,
    seeds: Vec<Seed>,
}

impl EnvSource {
    /// Creates a source from configs, each with the map that its `map_name` names; `of_env` holds the index of each
    /// environment's config.
    ///
    /// # Errors
    /// [`Error::Argument`] if there are no environments or an index is out of range; [`Error::Config`] if a config does
    /// not fit a batch, or differs from another in a field that all must share.
    pub fn new(configs: Vec<ConfigWithMap>, of_env: Vec<usize>) -> Result<Self, Error> {
        let configs = per_env(configs, &of_env)?;
        let Some(first) = configs.first() else { return Err(Error::argument("num_envs", 0, "at least 1")) };
        let shared = Seed::from_os()?;
        let mut seeds = Vec::with_capacity(configs.len());
        for (env, config) in configs.iter().enumerate() {
            let reason = || format!("because environment {env} must share it with environment 0");
            check_alike(&config.0, &first.0, reason)?;
            seeds.push(config.0.seed.map_or(shared, Seed::Shared));
        }
        Ok(Self { configs: configs.into(), seeds })
    }

    /// Replaces the seeds, one for each environment.
    ///
    /// # Errors
    /// [`Error::Length`] if the numbers of seeds and environments differ.
    pub fn with_seeds(self, seeds: Vec<Seed>) -> Result<Self, Error> {
        Error::check_length("seeds", self.configs.len(), seeds.len())?;
        Ok(Self { seeds, ..self })
    }

    /// Replaces the configs of some environments and keeps their seeds.
    ///
    /// `envs` lists these environments. `of_env` holds the index of each listed environment's config.
    ///
    /// # Errors
    /// [`Error::Argument`] if an index is out of range; [`Error::Length`] if the lengths of `of_env` and `envs` differ;
    /// [`Error::Config`] if a config does not fit a batch, or if a field that all environments must share would change.
    pub fn with_configs(
        self,
        configs: Vec<ConfigWithMap>,
        of_env: &[usize],
        envs: &[usize],
    ) -> Result<Self, Error> {
        Error::check_length("of_env", envs.len(), of_env.len())?;
        let mut every = self.configs.to_vec();
        for (config, &env) in per_env(configs, of_env)?.into_iter().zip(envs) {
            check_alike(&config.0, self.config(0), || "which cannot change".into())?;
            let expected = || format!("below {}, the number of environments", self.configs.len());
            *every.get_mut(env).ok_or_else(|| Error::argument("envs", env, expected()))? = config;
        }
        Ok(Self { configs: every.into(), ..self })
    }

    /// Returns the rules of all environments, with the largest of their numbers of agents.
    pub fn rules(&self) -> Config {
        let num_agents = self.configs.iter().map(|config| config.0.num_agents).max();
        let rules = self.config(0).rules();
        Config { num_agents: num_agents.unwrap_or(rules.num_agents), ..rules }
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
        let sizes = self.configs.iter().map(|named| match &**named {
            (config, Some(map)) if config.map_name.is_some() => map.sides(),
            (config, _) => (config.height, config.width),
        });
        sizes.fold((0, 0), |most, size| (most.0.max(size.0), most.1.max(size.1)))
    }

    /// Returns the config of an environment.
    pub fn config(&self, env: usize) -> &GridConfig {
        &self.configs[env].0
    }

    /// Returns POGEMA's seed of an episode. If several maps may be drawn for the episode, this takes as long as making
    /// the instance.
    ///
    /// # Errors
    /// If several maps may be drawn and none of them yields an instance.
    pub fn seed(&self, env: usize, episode: u64) -> Result<u64, Error> {
        if self.num_attempts(env, episode) == 1 {
            return Ok(self.seeds[env].of_attempt(env, episode, 0));
        }
        self.first_attempt(env, episode).map(|(seed, _)| seed)
    }

    /// Returns how many maps may be drawn for an episode.
    fn num_attempts(&self, env: usize, episode: u64) -> u64 {
        let config = self.config(env);
        let draws_map = config.map.is_none() && config.map_name.is_none();
        let may_have_room = config.num_agents <= config.height.saturating_mul(config.width) / 2;
        let is_chosen = matches!(self.seeds[env], Seed::Own(_)) && episode == 0;
        if draws_map && may_have_room && !is_chosen { MAX_ATTEMPTS } else { 1 }
    }

    /// Returns the seed and the instance of an episode's first attempt that has an instance.
    fn first_attempt(&self, env: usize, episode: u64) -> Result<(u64, Instance), Error> {
        let (config, registered) = &*self.configs[env];
        let num_attempts = self.num_attempts(env, episode);
        let attempts = if num_attempts > 1 { format!(", {num_attempts} maps") } else { String::new() };
        let mut attempt = 0;
        loop {
            let seed = self.seeds[env].of_attempt(env, episode, attempt);
            // A new source for each attempt, because a source keeps the pools as earlier episodes shuffled them.
            let config = GridConfig { seed: Some(seed), ..config.clone() };
            let made = InstanceSource::new(config, registered.clone()).and_then(|mut one| one.generate());
            attempt += 1;
            match made {
                Ok(generated) => return Ok((seed, generated.instance)),
                Err(_) if attempt < num_attempts => {}
                Err(error) => {
                    let episode = format!("environment {env}, episode {episode}{attempts}, seed {seed}");
                    return Err(Error::instance(format!("{episode}: {error}")));
                }
            }
        }
    }
}

impl Instances for EnvSource {
    fn instance(&self, env: usize, episode: u64) -> Result<Instance, Error> {
        self.first_attempt(env, episode).map(|(_, instance)| instance)
    }
}

/// Returns the config of each environment, given as indices into a list.
fn per_env(configs: Vec<ConfigWithMap>, of_env: &[usize]) -> Result<Vec<Arc<ConfigWithMap>>, Error> {
    configs.iter().try_for_each(|(config, _)| check_playable(config))?;
    let configs: Vec<_> = configs.into_iter().map(Arc::new).collect();
    let config = |&index: &usize| {
        let config = configs.get(index).map(Arc::clone);
        config.ok_or_else(|| Error::argument("of_env", index, "the index of a config"))
    };
    of_env.iter().map(config).collect()
}

fn check_playable(config: &GridConfig) -> Result<(), Error> {
    if config.persistent {
        return Err(Error::config("persistent", true, "false, because a batch keeps no steps"));
    }
    Ok(())
}

/// Checks that a config has the same rules as another, except for the number of agents.
fn check_alike(config: &GridConfig, first: &GridConfig, reason: impl Fn() -> String) -> Result<(), Error> {
    const SHARED: [&str; 7] = [
        "obs_radius",
        "collision_system",
        "on_target",
        "max_episode_steps",
        "observation_type",
        "occupancy",
        "reward",
    ];
    if (Config { num_agents: first.num_agents, ..config.rules() }) == first.rules() {
        return Ok(());
    }
    let (own, first) = (config.to_value(), first.to_value());
    let field = SHARED.into_iter().find(|&field| own[field] != first[field]).unwrap_or("config");
    let expected = format!("{}, {}", first[field], reason());
    Err(Error::config(field, &own[field], expected))
}
