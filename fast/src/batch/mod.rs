//! Many environments, stepped and observed by one call.

mod jobs;
mod prepare;

use pogema_core::{Action, Config, Environment, EpisodeMeter, Error, Instance, Metrics, StepOut};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::{Engine, Path};

use jobs::Jobs;
use prepare::Preparer;

pub use jobs::Observations;
pub use prepare::Instances;

/// Many environments of one shape, the lanes, each with its own map and its own episodes.
///
/// Every array has a leading axis `lanes`. An episode that ends, since all agents terminated or were cut off, is
/// followed by the lane's next one within the same step: rewards and ends are those of the last step, observations
/// those of the new episode. The ended episode stays readable through [`Batch::ended`] until the lane ends again.
///
/// What comes out does not depend on the number of threads.
pub struct Batch {
    config: Config,
    lanes: Vec<Lane>,
    pool: Option<ThreadPool>,
    preparer: Preparer,
    is_started: bool,
}

/// One environment of a batch.
struct Lane {
    index: usize,
    engine: Engine,
    meter: EpisodeMeter,
    /// The number of the episode after the present one.
    next_episode: u64,
    /// Its instance, if it is here already.
    pending: Option<Instance>,
    /// The environment at the end of its last episode, and what that came to.
    ended: Engine,
    metrics: Option<Metrics>,
    has_just_ended: bool,
    /// Why the lane has no next episode.
    failure: Option<Error>,
}

impl Batch {
    /// A batch of `num_lanes` environments, played by `num_threads` threads; it wants a reset first.
    ///
    /// # Errors
    /// If the config is out of range; for no lanes, no threads or more threads than lanes; if threads cannot be
    /// started.
    pub fn new(
        config: Config,
        num_lanes: usize,
        num_threads: usize,
        source: impl Instances + 'static,
    ) -> Result<Self, Error> {
        if num_lanes == 0 {
            return Err(Error::config("num_lanes", num_lanes, "at least 1"));
        }
        if !(1..=num_lanes).contains(&num_threads) {
            let expected = format!("1 to {num_lanes}, the number of lanes");
            return Err(Error::config("num_threads", num_threads, expected));
        }
        let path = Path::from_environment()?;
        let lane = |index| Lane::new(index, config, path);
        let lanes = (0..num_lanes).map(lane).collect::<Result<_, _>>()?;
        let pool = (num_threads > 1).then(|| ThreadPoolBuilder::new().num_threads(num_threads).build());
        let pool = pool.transpose().map_err(|error| Error::State { reason: error.to_string() })?;
        let preparer = Preparer::new(Box::new(source), num_lanes)?;
        Ok(Self { config, lanes, pool, preparer, is_started: false })
    }

    /// The rules and sizes of every lane.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Number of lanes.
    pub fn num_lanes(&self) -> usize {
        self.lanes.len()
    }

    /// Begins the next episode of every lane, the first time episode 0.
    ///
    /// # Errors
    /// If a lane has no next instance, or one of another shape than the first lane's. Every lane is then as it
    /// was.
    pub fn reset(&mut self) -> Result<(), Error> {
        let preparer = &self.preparer;
        over_lanes(self.pool.as_ref(), &mut self.lanes, |lane| lane.look_ahead(preparer).map(|_| ()))?;
        let mut size = None;
        for instance in self.lanes.iter().filter_map(|lane| lane.pending.as_ref()) {
            let size = *size.get_or_insert((instance.map().height(), instance.map().width()));
            check_shape(instance, &self.config, size)?;
        }
        over_lanes(self.pool.as_ref(), &mut self.lanes, Lane::begin)?;
        self.is_started = true;
        Ok(())
    }

    /// Plays one step in every lane, begins new episodes where one ended, and observes.
    ///
    /// Shape: `actions` and each buffer of `out` are `[lanes, agents]`.
    ///
    /// # Errors
    /// Before the first reset, for a list or buffer of the wrong length, or if a lane's next episode could not
    /// begin in an earlier step; nothing is played then.
    pub fn step(
        &mut self,
        actions: &[Action],
        out: StepOut<'_>,
        observations: Observations<'_>,
    ) -> Result<(), Error> {
        self.check_started()?;
        let num_agents = self.lanes.len() * self.config.num_agents;
        Error::check_length("actions", num_agents, actions.len())?;
        out.check(num_agents)?;
        observations.check(self.lanes.len(), &self.config)?;
        if let Some(failure) = self.lanes.iter().find_map(|lane| lane.failure.as_ref()) {
            return Err(failure.clone());
        }
        let size = self.lanes[0].engine.size();
        let preparer = &self.preparer;
        let beyond_cache = observations.is_beyond_cache();
        let steps = Some((actions, out));
        let jobs = Jobs { lanes: &mut self.lanes, steps, observations, beyond_cache };
        jobs.run(self.pool.as_ref(), &|lane, actions, out| {
            lane.step(actions, out)?;
            if lane.has_just_ended {
                lane.begin_next(preparer, size);
            }
            Ok(())
        })
    }

    /// Observes every lane.
    ///
    /// # Errors
    /// Before the first reset, or for a buffer of the wrong length.
    ///
    /// Rule: observe/default
    pub fn observe(&mut self, observations: Observations<'_>) -> Result<(), Error> {
        self.check_started()?;
        observations.check(self.lanes.len(), &self.config)?;
        let beyond_cache = observations.is_beyond_cache();
        let jobs = Jobs { lanes: &mut self.lanes, steps: None, observations, beyond_cache };
        jobs.run(self.pool.as_ref(), &|_, _, _| Ok(()))
    }

    /// The environment of a lane.
    ///
    /// # Errors
    /// If there is no such lane.
    pub fn lane(&self, lane: usize) -> Result<&Engine, Error> {
        self.check_lane(lane).map(|lane| &lane.engine)
    }

    /// Whether an episode of a lane ended in the last step.
    ///
    /// # Errors
    /// If there is no such lane.
    pub fn has_just_ended(&self, lane: usize) -> Result<bool, Error> {
        self.check_lane(lane).map(|lane| lane.has_just_ended)
    }

    /// The last episode of a lane that ended: the environment at its end, for the terminal observation, and its
    /// figures.
    ///
    /// # Errors
    /// If there is no such lane.
    ///
    /// Rule: metrics/finish, metrics/nothing, metrics/restart
    pub fn ended(&self, lane: usize) -> Result<Option<(&Engine, Metrics)>, Error> {
        let lane = self.check_lane(lane)?;
        // Without a next episode the environment stays where the last one ended.
        let engine = if lane.failure.is_some() { &lane.engine } else { &lane.ended };
        Ok(lane.metrics.map(|metrics| (engine, metrics)))
    }

    fn check_started(&self) -> Result<(), Error> {
        if self.is_started {
            return Ok(());
        }
        Err(Error::State { reason: "the batch was not reset yet".into() })
    }

    fn check_lane(&self, lane: usize) -> Result<&Lane, Error> {
        let expected = || format!("below {}, the number of lanes", self.lanes.len());
        self.lanes.get(lane).ok_or_else(|| Error::config("lane", lane, expected()))
    }
}

impl Lane {
    fn new(index: usize, config: Config, path: Path) -> Result<Self, Error> {
        Ok(Self {
            index,
            engine: Engine::with_path(config, path)?,
            meter: EpisodeMeter::new(&config),
            next_episode: 0,
            pending: None,
            ended: Engine::with_path(config, path)?,
            metrics: None,
            has_just_ended: false,
            failure: None,
        })
    }

    fn step(&mut self, actions: &[Action], out: StepOut<'_>) -> Result<(), Error> {
        let StepOut { rewards, terminated, truncated } = out;
        self.engine.step(actions, StepOut { rewards, terminated, truncated })?;
        let metrics = self.meter.feed(self.engine.on_goal(), terminated, truncated);
        self.has_just_ended = metrics.is_some();
        self.metrics = metrics.or(self.metrics);
        Ok(())
    }

    /// The instance of the next episode.
    fn look_ahead(&mut self, preparer: &Preparer) -> Result<&Instance, Error> {
        if self.pending.is_none() {
            let taken = preparer.take(self.index);
            self.next_episode += u64::from(taken.is_ok());
            preparer.want(self.index, self.next_episode);
            self.pending = Some(taken?);
        }
        // INVARIANT: there is one now.
        self.pending.as_ref().ok_or_else(|| Error::State { reason: "no instance was made".into() })
    }

    /// Begins the episode whose instance is here.
    fn begin(&mut self) -> Result<(), Error> {
        self.pending.take().map_or(Ok(()), |instance| self.engine.start(instance))?;
        self.meter.reset();
        self.failure = None;
        self.has_just_ended = false;
        Ok(())
    }

    /// Puts the ended episode aside and begins the next one, if there is one.
    fn begin_next(&mut self, preparer: &Preparer, size: (usize, usize)) {
        match self.try_begin_next(preparer, size) {
            Ok(()) => std::mem::swap(&mut self.engine, &mut self.ended),
            Err(error) => self.failure = Some(error),
        }
    }

    fn try_begin_next(&mut self, preparer: &Preparer, size: (usize, usize)) -> Result<(), Error> {
        let config = *self.engine.config();
        check_shape(self.look_ahead(preparer)?, &config, size)?;
        self.pending.take().map_or(Ok(()), |instance| self.ended.start(instance))
    }
}

/// Does something to all lanes, on the threads of a pool if there is one; the error is that of the first lane that
/// has one.
fn over_lanes(
    pool: Option<&ThreadPool>,
    lanes: &mut [Lane],
    work: impl Fn(&mut Lane) -> Result<(), Error> + Sync,
) -> Result<(), Error> {
    let done: Vec<_> = match pool {
        Some(pool) => pool.install(|| lanes.par_iter_mut().map(&work).collect()),
        None => lanes.iter_mut().map(work).collect(),
    };
    done.into_iter().collect()
}

fn check_shape(instance: &Instance, config: &Config, (height, width): (usize, usize)) -> Result<(), Error> {
    instance.check_fits(config)?;
    Error::check_length("rows of the lane's map", height, instance.map().height())?;
    Error::check_length("columns of the lane's map", width, instance.map().width())
}
