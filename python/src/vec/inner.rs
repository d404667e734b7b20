//! The environments of a `VecEnv` and their episodes, without Python's arrays.

use std::sync::atomic::AtomicBool;

use pogema::{EnvSource, Seed};
use pogema_core::{Action, Config, Error, Occupancy};
use pogema_fast::{Autoreset, Firsts, suited_threads};

use crate::fields::Fields;
use crate::{config, interrupt, memory};

/// The environments, their source of instances, and a list for actions.
pub struct Inner {
    pub batch: pogema_fast::Batch,
    pub source: EnvSource,
    pub actions: Vec<Action>,
}

/// The next episodes of some environments, before they begin.
pub struct Next {
    chosen: Vec<bool>,
    /// The source with new seeds, if there are any, and its first instances.
    seeded: Option<(EnvSource, Firsts)>,
}

impl Inner {
    pub fn new(
        configs: &[(Fields, Option<String>)],
        of_env: Option<Vec<usize>>,
        num_envs: usize,
        exact: bool,
        (num_threads, cell_bits): (Option<usize>, usize),
    ) -> Result<Self, Error> {
        let read = |(config, map): &(Fields, Option<String>)| config::read(config, map.as_deref());
        let configs = configs.iter().map(read).collect::<Result<Vec<_>, _>>()?;
        // A batch of several configs holds a list of them, and is therefore small: the largest map counts for all.
        let largest = configs.iter().max_by_key(|(config, _)| config.height.saturating_mul(config.width));
        let bytes = largest.and_then(|(config, _)| memory::of_environments(config, num_envs));
        memory::check("the batch", bytes)?;
        let source = EnvSource::new(configs, of_env.unwrap_or_else(|| vec![0; num_envs]))?;
        let rules = source.config(0).rules();
        let occupancy = if exact { Occupancy::Exact } else { rules.occupancy };
        let rules = Config { occupancy, ..rules };
        let bytes_per_agent = rules.num_observed() / rules.num_agents * cell_bits / 8;
        let num_threads =
            num_threads.unwrap_or_else(|| suited_threads(num_envs, rules.num_agents, bytes_per_agent));
        let batch = pogema_fast::Batch::new(rules, num_envs, num_threads, source.clone())?;
        Ok(Self { batch, source, actions: Vec::with_capacity(num_envs * rules.num_agents) })
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
                return Ok(Next { chosen, seeded: None });
            }
        };
        Error::check_length("seeds", num_envs, given.len())?;
        let mut source = self.source.clone();
        for ((seed, given), chosen) in source.seeds_mut().iter_mut().zip(given).zip(&chosen) {
            *seed = if *chosen { given } else { *seed };
        }
        let firsts = self.batch.fetch_with(source.clone(), &chosen, stop)?;
        Ok(Next { chosen, seeded: Some((source, firsts)) })
    }

    pub fn begin(&mut self, next: Next) -> Result<(), Error> {
        let Some((source, firsts)) = next.seeded else { return self.batch.reset_lanes(&next.chosen) };
        self.batch.begin_with(firsts)?;
        self.source = source;
        Ok(())
    }

    /// Returns whether the next step ends episodes whose next instances may take long.
    pub fn ends_take_long(&self) -> bool {
        let config = self.source.config(0);
        let num_cells = config.height.saturating_mul(config.width);
        let num_ends = || self.batch.num_truncated();
        num_cells.saturating_mul(self.batch.num_lanes()) >= interrupt::LONG
            && num_ends().saturating_mul(num_cells) >= interrupt::LONG
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

/// Reads Gymnasium's name of an autoreset mode.
pub fn read_autoreset(name: &str) -> Result<Autoreset, Error> {
    match name {
        "SameStep" => Ok(Autoreset::SameStep),
        "NextStep" => Ok(Autoreset::NextStep),
        "Disabled" => Ok(Autoreset::Off),
        _ => Err(Error::argument("autoreset_mode", name, "`SameStep`, `NextStep` or `Disabled`")),
    }
}
