//! The beginning of an episode.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use pogema_core::{CollisionMeter, Config, DensityMeter, Episode, Error, Instance, Occupancy, Outside};
use pogema_maps::InstanceSource;
use pyo3::prelude::*;

use super::Inner;
use super::drawn::Drawn;
use crate::fields::Fields;
use crate::{config, errors, interrupt, memory};

impl Inner {
    /// Makes an environment that needs a reset before its first step.
    pub(super) fn new(source: InstanceSource, exact: bool, time_limit: i64) -> Result<Self, Error> {
        let rules = rules(&source, exact, time_limit);
        Ok(Self {
            source,
            exact,
            time_limit,
            episode: Episode::new(pogema_fast::Engine::new(rules)?),
            is_filmed: false,
            is_measured: false,
            drawn: Drawn::default(),
            actions: Vec::with_capacity(rules.num_agents),
            executed: Vec::new(),
            before: Vec::new(),
        })
    }

    /// Returns whether the area beyond the wall is free.
    pub(super) fn has_free_outside(&self) -> bool {
        self.episode.instance().map_or(true, |instance| *instance.outside() == Outside::Free)
    }

    /// Begins an episode and returns the warnings of the instance source.
    pub(super) fn begin(
        &mut self,
        py: Python<'_>,
        config: Option<&Fields>,
        registered: Option<&str>,
    ) -> PyResult<Vec<String>> {
        let mut source = match config {
            Some(config) => config::source(config, registered).map_err(|error| errors::config(py, &error))?,
            None => self.source.clone(),
        };
        let bytes = memory::of_environments(source.config(), 1);
        memory::check("the environment", bytes).map_err(|error| errors::memory(&error))?;
        let stop = Arc::<AtomicBool>::default();
        source = source.cancelled_by(&stop);
        let num_cells = source.num_cells_drawn();
        let generate = move || source.generate().map(|generated| (source, generated));
        let generated = if num_cells < interrupt::LONG {
            py.detach(generate)
        } else {
            interrupt::detach(py, generate).inspect_err(|_| stop.store(true, Relaxed))?
        };
        let (source, generated) = generated.map_err(|error| errors::instance(py, &error))?;
        let rules = rules(&source, self.exact, self.time_limit);
        self.start(rules, generated.instance).map_err(|error| match error {
            Error::Config { .. } | Error::CellOutside { .. } => errors::config(py, &error),
            _ => errors::instance(py, &error),
        })?;
        self.episode.meters_mut().episode.measure_over(source.config().max_episode_steps);
        self.source = source;
        self.drawn.begin(rules.num_agents, rules.persistent);
        self.executed.clear();
        Ok(generated.warnings)
    }

    /// Starts an episode, on the same engine if the rules have not changed.
    ///
    /// POGEMA 1.4.0 does not clear its metrics at a reset, so the counters carry over if the number of agents
    /// is the same.
    fn start(&mut self, rules: Config, instance: Instance) -> Result<(), Error> {
        let counted = self.episode.meters().episode.clone();
        let mut fresh = if rules == *self.episode.config() {
            None
        } else {
            Some(Episode::new(pogema_fast::Engine::new(rules)?))
        };
        let episode = fresh.as_mut().unwrap_or(&mut self.episode);
        episode.record(self.is_filmed);
        if self.is_measured {
            let meters = episode.meters_mut();
            meters.density.get_or_insert_with(DensityMeter::default);
            meters.collisions.get_or_insert_with(CollisionMeter::default);
        }
        episode.start(instance)?;
        if counted.num_agents() == rules.num_agents {
            episode.meters_mut().episode = counted;
        }
        if let Some(episode) = fresh {
            self.episode = episode;
        }
        Ok(())
    }
}

fn rules(source: &InstanceSource, exact: bool, time_limit: i64) -> Config {
    let rules = source.config().rules();
    let occupancy = if exact { Occupancy::Exact } else { rules.occupancy };
    Config { max_steps: time_limit, occupancy, ..rules }
}
