//! The environments of a `VecEnv` and their episodes, without Python's arrays.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use pogema::{ConfigWithMap, EnvSource, Seed};
use pogema_core::{Action, Config, Error, Instance, Occupancy, StepOut};
use pogema_fast::{Autoreset, Batch, FirstInstances, ObservationBuffers, suited_threads};
use pogema_maps::GridConfig;
use pogema_policies::EncoderSettings;
use pyo3::prelude::*;

use super::buffers::Buffer;
use super::dense::DenseRewards;
use super::encoders::{Encoded, Encoders, Prepared};
use super::film::Film;
use crate::fields::Fields;
use crate::{config, interrupt, memory};

/// Number of bytes of observations that the engine writes while an encoder computes one number.
const ENCODED_BYTES: usize = 16;

/// The environments and their source of instances, a list for actions, and the optional film, encoders and dense
/// rewards.
pub struct Inner {
    pub batch: pogema_fast::Batch,
    pub source: EnvSource,
    pub actions: Vec<Action>,
    /// The numbers of rows and columns for which the arrays have room.
    pub map_size: (usize, usize),
    pub film: Option<Film>,
    pub encoders: Option<Encoders>,
    pub dense: Option<DenseRewards>,
}

/// Configs, each with the text of the map that its `map_name` names, and the index of each environment's config.
///
/// Without indices, all environments have the first config.
pub type Configs = (Vec<(Fields, Option<String>)>, Option<Vec<usize>>);

/// The requested number of agents, and rows and columns of maps, for which the arrays have room.
pub type Room = (Option<usize>, Option<(usize, usize)>);

/// The next episodes of some environments, before they begin.
pub struct Next {
    chosen: Vec<bool>,
    /// The source with new seeds, if there are any, and its first instances.
    seeded: Option<(EnvSource, FirstInstances)>,
    encoders: Prepared,
}

impl Inner {
    pub fn new(
        configs: &Configs,
        room: Room,
        num_envs: usize,
        exact: bool,
        (num_threads, cell_bits): (Option<usize>, usize),
        encoder: Option<EncoderSettings>,
    ) -> Result<Self, Error> {
        let (configs, of_env) = read_configs(configs, num_envs, room)?;
        let source = EnvSource::new(configs, of_env)?;
        let (rules, map_size) = with_room(&source, room)?;
        let occupancy = if exact { Occupancy::Exact } else { rules.occupancy };
        let rules = Config { occupancy, ..rules };
        let bytes_per_agent = match &encoder {
            Some(settings) => ENCODED_BYTES * (settings.window_len() + settings.scalars_len()),
            None => rules.num_observed() / rules.num_agents * cell_bits / 8,
        };
        let num_threads =
            num_threads.unwrap_or_else(|| suited_threads(num_envs, rules.num_agents, bytes_per_agent));
        let batch = pogema_fast::Batch::new(rules, num_envs, num_threads, source.clone())?;
        let actions = Vec::with_capacity(num_envs * rules.num_agents);
        let encoders = encoder.map(|settings| Encoders::new(settings, num_envs, rules.num_agents));
        Ok(Self {
            batch,
            source,
            actions,
            map_size,
            film: None,
            encoders: encoders.transpose()?,
            dense: None,
        })
    }

    /// Changes the configs of some environments from their next episodes on; without `envs`, those of all.
    ///
    /// An error changes nothing, except [`Error::Memory`], after which the next step fails, too. [`Error::Instance`] is
    /// about an episode, any other error about the configs.
    pub fn set_configs(
        &mut self,
        configs: &Configs,
        envs: Option<Vec<usize>>,
        stop: &AtomicBool,
    ) -> Result<(), Error> {
        let num_envs = self.batch.num_lanes();
        let envs = envs.unwrap_or_else(|| (0..num_envs).collect());
        let room = (Some(self.batch.config().num_agents), Some(self.map_size));
        let (configs, of_env) = read_configs(configs, envs.len(), room)?;
        let source = self.source.clone().with_configs(configs, &of_env, &envs)?;
        check_room(&source, self.batch.config().num_agents, self.map_size)?;
        let mut changed = vec![false; num_envs];
        for env in envs {
            changed[env] = true;
        }
        self.batch.replace_source(source.clone(), &changed, stop)?;
        self.source = source;
        Ok(())
    }

    /// Fetches the instances of a reset, and changes no episode.
    pub fn fetch(
        &mut self,
        chosen: Option<Vec<bool>>,
        seed: Option<u64>,
        seeds: Option<Vec<u64>>,
        stop: &AtomicBool,
    ) -> Result<Next, Error> {
        let num_envs = self.batch.num_lanes();
        let chosen = chosen.unwrap_or_else(|| vec![true; num_envs]);
        Error::check_length("chosen environments", num_envs, chosen.len())?;
        let given: Vec<Seed> = match (seed, seeds) {
            (Some(seed), _) => vec![Seed::Shared(seed); num_envs],
            (None, Some(seeds)) => seeds.into_iter().map(Seed::Own).collect(),
            (None, None) => {
                self.batch.fetch(&chosen, stop)?;
                let next = |batch: &Batch, env: usize| batch.next_instance(env).ok()?.cloned();
                let encoders = self.prepare(next, stop)?;
                return Ok(Next { chosen, seeded: None, encoders });
            }
        };
        Error::check_length("seeds", num_envs, given.len())?;
        let mut source = self.source.clone();
        for ((seed, given), chosen) in source.seeds_mut().iter_mut().zip(given).zip(&chosen) {
            *seed = if *chosen { given } else { *seed };
        }
        let firsts = self.batch.fetch_with(source.clone(), &chosen, stop)?;
        let encoders = self.prepare(|_, env| firsts.instance(env).cloned(), stop)?;
        Ok(Next { chosen, seeded: Some((source, firsts)), encoders })
    }

    /// Returns the encoders of next episodes, if there are encoders and their work may take long.
    fn prepare(
        &mut self,
        next: impl Fn(&Batch, usize) -> Option<Instance> + Sync,
        stop: &AtomicBool,
    ) -> Result<Prepared, Error> {
        let Self { batch, encoders, map_size, .. } = self;
        let Some(encoders) = encoders else { return Ok(Prepared::new()) };
        let is_long = encoders.work_to_begin(map_size.0 * map_size.1, batch.num_lanes()) >= interrupt::LONG;
        if is_long { encoders.prepare(batch, next, stop) } else { Ok(Prepared::new()) }
    }

    /// Fetches the next instances of the environments whose episodes reach the step limit in the next step, and changes
    /// no episode. Returns the next encoders.
    pub fn fetch_at_limit(&mut self, stop: &AtomicBool) -> Result<Prepared, Error> {
        self.batch.fetch_at_limit(stop)?;
        self.prepare(|batch, env| batch.next_instance(env).ok()?.cloned(), stop)
    }

    /// Begins the fetched episodes, and returns their encoders.
    pub fn begin(&mut self, next: Next) -> Result<Prepared, Error> {
        let Next { chosen, seeded, encoders } = next;
        match seeded {
            None => self.batch.reset_lanes(&chosen)?,
            Some((source, firsts)) => {
                self.batch.begin_with(firsts)?;
                self.source = source;
            }
        }
        let Self { film, batch, source, .. } = self;
        film.as_mut().map_or(Ok(()), |film| film.follow_reset(&chosen, batch, source))?;
        Ok(encoders)
    }

    /// Writes the current states of all environments; `prepared` are the encoders of new episodes.
    pub fn observe(
        &mut self,
        buffers: ObservationBuffers<'_>,
        encoded: Option<Encoded<'_>>,
        prepared: Prepared,
    ) -> Result<(), Error> {
        self.batch.observe(buffers)?;
        self.encode(encoded, prepared)
    }

    /// Writes the final states of the last episodes of some environments.
    pub fn observe_ended(
        &self,
        envs: &[usize],
        buffers: ObservationBuffers<'_>,
        encoded: Option<Encoded<'_>>,
    ) -> Result<(), Error> {
        self.batch.observe_ended(envs, buffers)?;
        match (&self.encoders, encoded) {
            (Some(encoders), Some(out)) => encoders.write_ended(envs, out),
            _ => Ok(()),
        }
    }

    fn encode(&mut self, encoded: Option<Encoded<'_>>, prepared: Prepared) -> Result<(), Error> {
        match (&mut self.encoders, encoded) {
            (Some(encoders), Some(out)) => encoders.encode(&mut self.batch, prepared, out),
            _ => Ok(()),
        }
    }

    /// Returns whether computing the distances for the rewards of the next step may take long.
    pub fn goals_take_long(&self) -> bool {
        self.dense.as_ref().is_some_and(|dense| dense.work(&self.batch) >= interrupt::LONG)
    }

    /// Computes the distances that the rewards of the next step need, and changes no episode.
    pub fn prepare_goals(&mut self, stop: &AtomicBool) -> Result<(), Error> {
        let Self { dense, batch, .. } = self;
        dense.as_mut().map_or(Ok(()), |dense| dense.prepare(batch, stop))
    }

    /// Plays a step with the stored actions; `prepared` are the encoders of the episodes that it begins.
    pub fn step(
        &mut self,
        out: StepOut<'_>,
        buffers: ObservationBuffers<'_>,
        encoded: Option<Encoded<'_>>,
        prepared: Prepared,
    ) -> Result<(), Error> {
        // INVARIANT: nothing sets this flag.
        self.prepare_goals(&AtomicBool::new(false))?;
        let StepOut { rewards, terminated, truncated } = out;
        let out = StepOut { rewards: &mut *rewards, terminated, truncated };
        self.batch.step(&self.actions, out, buffers)?;
        let Self { dense, batch, .. } = self;
        dense.as_ref().map_or(Ok(()), |dense| dense.add(batch, rewards))?;
        self.encode(encoded, prepared)?;
        let Self { batch, source, actions, film, .. } = self;
        film.as_mut().map_or(Ok(()), |film| film.follow_step(actions, batch, source))
    }

    /// Returns whether the next step ends episodes whose next instances or encoders may take long.
    pub fn ends_take_long(&self) -> bool {
        let num_cells = self.map_size.0.saturating_mul(self.map_size.1);
        let num_ends = || self.batch.num_at_limit();
        if let Some(encoders) = &self.encoders {
            let work = |num_envs| encoders.work_to_begin(num_cells, num_envs);
            return work(self.batch.num_lanes()) >= interrupt::LONG && work(num_ends()) >= interrupt::LONG;
        }
        num_cells.saturating_mul(self.batch.num_lanes()) >= interrupt::LONG
            && num_ends().saturating_mul(num_cells) >= interrupt::LONG
    }

    /// Returns POGEMA's seed of each environment's current episode.
    pub fn episode_seeds(&self, stop: &AtomicBool) -> Result<Vec<u64>, Error> {
        let seed = |env| {
            if stop.load(Relaxed) {
                return Err(Error::Cancelled);
            }
            self.source.seed(env, self.batch.episode(env)?.ok_or(Error::NotReset)?)
        };
        (0..self.batch.num_lanes()).map(seed).collect()
    }

    /// Takes the caller's buffer for observations.
    pub fn buffer<'py>(&self, arrays: &Bound<'py, PyAny>) -> PyResult<Buffer<'py>> {
        if self.encoders.is_some() { Buffer::encoded(arrays) } else { Buffer::new(arrays) }
    }

    /// Stores actions, or returns the index and the number of the first invalid one.
    pub fn read_actions(&mut self, numbers: &[i64]) -> Result<(), (usize, i64)> {
        let is_action = |&number: &i64| (number as u64) < Action::ALL.len() as u64;
        // No early exit, so that the loop is vectorized.
        if !numbers.iter().fold(true, |all, number| all & is_action(number)) {
            let wrong = numbers.iter().position(|number| !is_action(number)).unwrap_or_default();
            return Err((wrong, numbers[wrong]));
        }
        self.actions.clear();
        self.actions.extend(numbers.iter().map(|&number| Action::ALL[number as usize]));
        Ok(())
    }
}

/// Reads configs, and checks that there is memory for environments of the requested room.
fn read_configs(
    (configs, of_env): &Configs,
    num_envs: usize,
    (num_agents, map_size): Room,
) -> Result<(Vec<ConfigWithMap>, Vec<usize>), Error> {
    let read = |(config, map): &(Fields, Option<String>)| config::read(config, map.as_deref());
    let configs = configs.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    // If there are several configs, the batch is small, because they come from a list. The largest sizes are then used
    // for all.
    if let Some(mut largest) = configs.first().map(|(config, _)| config.clone()) {
        let most = |each: fn(&GridConfig) -> usize, room: Option<usize>| {
            configs.iter().map(|(config, _)| each(config)).chain(room).max().unwrap_or_default()
        };
        largest.num_agents = most(|config| config.num_agents, num_agents);
        largest.height = most(|config| config.height, map_size.map(|(rows, _)| rows));
        largest.width = most(|config| config.width, map_size.map(|(_, columns)| columns));
        memory::check("the batch", memory::of_environments(&largest, num_envs))?;
    }
    Ok((configs, of_env.clone().unwrap_or_else(|| vec![0; num_envs])))
}

/// Returns the rules of a source and the size of its largest map, both enlarged to the requested room.
fn with_room(source: &EnvSource, (num_agents, map_size): Room) -> Result<(Config, (usize, usize)), Error> {
    let (rules, size) = (source.rules(), source.largest_map());
    let (num_agents, map_size) = (num_agents.unwrap_or(rules.num_agents), map_size.unwrap_or(size));
    check_room(source, num_agents, map_size)?;
    Ok((Config { num_agents, ..rules }, map_size))
}

/// Checks that every config fits into the arrays.
fn check_room(source: &EnvSource, num_agents: usize, map_size: (usize, usize)) -> Result<(), Error> {
    let (rules, (rows, columns)) = (source.rules(), source.largest_map());
    if rules.num_agents > num_agents {
        let expected = format!("at most {num_agents}, the number of agents for which the arrays have room");
        return Err(Error::config("num_agents", rules.num_agents, expected));
    }
    if rows > map_size.0 || columns > map_size.1 {
        let expected =
            format!("at most {} x {}, the size for which the arrays have room", map_size.0, map_size.1);
        return Err(Error::config("map_size", format!("{rows} x {columns}"), expected));
    }
    Ok(())
}

/// Reads Gymnasium's name of an autoreset mode.
pub fn read_autoreset(name: &str) -> Result<Autoreset, Error> {
    match name {
        "SameStep" => Ok(Autoreset::SameStep),
        "NextStep" => Ok(Autoreset::NextStep),
        "Disabled" => Ok(Autoreset::Off),
        _ => Err(Error::argument("autoreset_mode", name, "`SameStep`, `NextStep` or `Disabled`")),
    }
}
