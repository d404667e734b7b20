//! Batches: many environments, stepped and observed by one call.

mod jobs;
mod lane;
mod pace;
mod prepare;
mod team;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Instant;

use pogema_core::{Action, Config, Error, Instance, Metrics, StepOut, check_threads};

use crate::buffers::ObservationBuffers;
use crate::observe::bypasses_cache;
use crate::{Engine, SimdPath};

use jobs::Jobs;
use lane::Lane;
use pace::Pace;
use prepare::Preparer;
use team::Team;

pub use prepare::Instances;
pub use team::suited_threads;

/// The time at which a lane begins its next episode after the end of an episode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Autoreset {
    /// The next episode begins within the same step. Rewards, `terminated` and `truncated` are those of the last step,
    /// and observations are those of the new episode.
    #[default]
    SameStep,
    /// The next episode begins with the next step, which ignores the lane's actions. Rewards are 0, no agent is
    /// terminated or truncated, and observations are those of the new episode.
    NextStep,
    /// The lane stays at the end until a reset. Further steps give rewards of 0 and repeat `terminated` and `truncated`
    /// of the last step.
    Off,
}

/// Many environments (lanes) of one config, each with its own map and its own episodes.
///
/// Every array has a leading axis `lanes`. All except the maps of global states then have an axis `agents` with the
/// config's number of agents. An instance may have fewer: the other rows are then padding, with observations and
/// rewards of 0, both flags `terminated` and `truncated` true, and action masks that only allow staying.
///
/// An episode ends when all agents are terminated or all are truncated. The lane then continues according to
/// [`Autoreset`]. [`Batch::ended`] returns the ended episode until the lane's next episode ends.
///
/// Results do not depend on the number of threads. As long as measured times show that further threads do not make a
/// step faster, the step uses only the calling thread.
pub struct Batch {
    config: Config,
    autoreset: Autoreset,
    lanes: Vec<Lane>,
    team: Team,
    pace: Pace,
    /// The pace of [`Batch::share`].
    shared_pace: Pace,
    preparer: Preparer,
    is_started: bool,
}

impl Batch {
    /// Creates a batch of `num_lanes` environments on at most `num_threads` threads, the calling thread included.
    ///
    /// Call `reset` before the first step.
    ///
    /// # Errors
    /// If the config is out of range, if `num_lanes` is 0, if `num_threads` is not 1 to 1024, if `POGEMA_SIMD` is not
    /// the name of a path that this machine supports, or if threads cannot be started.
    pub fn new(
        config: Config,
        num_lanes: usize,
        num_threads: usize,
        source: impl Instances + 'static,
    ) -> Result<Self, Error> {
        if num_lanes == 0 {
            return Err(Error::argument("num_lanes", num_lanes, "at least 1"));
        }
        // A lane is played by one thread at a time.
        let num_threads = check_threads("num_threads", num_threads)?.min(num_lanes);
        let path = SimdPath::from_environment()?;
        let lane = |index| Lane::new(index, config, path);
        let lanes = (0..num_lanes).map(lane).collect::<Result<_, _>>()?;
        let team = Team::new(num_threads)?;
        let preparer = Preparer::new(Arc::new(source), num_lanes)?;
        let (autoreset, pace, shared_pace) = (Autoreset::default(), Pace::default(), Pace::default());
        Ok(Self { config, autoreset, lanes, team, pace, shared_pace, preparer, is_started: false })
    }

    /// Sets the autoreset mode. Call this before the first reset.
    #[must_use]
    pub fn with_autoreset(mut self, autoreset: Autoreset) -> Self {
        self.autoreset = autoreset;
        self
    }

    /// Returns the rules and the radius of every lane, and the maximum number of its agents.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Returns the largest number of threads that play, the calling thread included.
    pub fn num_threads(&self) -> usize {
        self.team.num_threads()
    }

    /// Returns the number of lanes.
    pub fn num_lanes(&self) -> usize {
        self.lanes.len()
    }

    /// Begins the next episode of every lane; the first call begins episode 0.
    ///
    /// # Errors
    /// If a lane has no next instance, or its next instance does not fit the config, for example because it has more
    /// agents: every episode is then unchanged. If there is not enough memory for a lane's map: the episode of that
    /// lane is then unchanged.
    pub fn reset(&mut self) -> Result<(), Error> {
        self.reset_lanes(&vec![true; self.lanes.len()])
    }

    /// Begins the next episode of the chosen lanes and leaves the others unchanged.
    ///
    /// The first call must choose all lanes.
    ///
    /// # Errors
    /// As for [`Batch::reset`]; also if `chosen` does not have one flag per lane, or if the first call leaves out a
    /// lane.
    pub fn reset_lanes(&mut self, chosen: &[bool]) -> Result<(), Error> {
        self.fetch(chosen, &AtomicBool::new(false))?;
        over_lanes(
            &self.team,
            &mut self.lanes,
            |lane| {
                if chosen[lane.index] { lane.begin() } else { Ok(()) }
            },
        )?;
        self.is_started = true;
        Ok(())
    }

    /// Fetches the next instances of the chosen lanes, so that their reset takes little time. Changes no episode.
    ///
    /// Another thread may set `stop` to end the call soon.
    ///
    /// # Errors
    /// As for [`Batch::reset_lanes`]; also [`Error::Cancelled`] if the call was stopped.
    pub fn fetch(&mut self, chosen: &[bool], stop: &AtomicBool) -> Result<(), Error> {
        self.check_chosen(chosen)?;
        let preparer = &self.preparer;
        let fetch = |lane: &mut Lane| lane.fetch_next(preparer);
        over_chosen(&self.team, &mut self.lanes, chosen, stop, fetch).map(|_| ())
    }

    /// Returns the number of lanes whose episodes reach the step limit in the next step.
    pub fn num_at_limit(&self) -> usize {
        self.lanes.iter().filter(|lane| lane.is_at_limit()).count()
    }

    /// Fetches the next instances of the lanes whose episodes reach the step limit in the next step.
    ///
    /// That step then takes little time. With [`Autoreset::Off`], the function does nothing. Another thread may set
    /// `stop` to end the call soon. A lane without a next instance fails only after its episode has ended.
    ///
    /// # Errors
    /// [`Error::Cancelled`] if the call was stopped.
    pub fn fetch_at_limit(&mut self, stop: &AtomicBool) -> Result<(), Error> {
        if self.autoreset == Autoreset::Off {
            return Ok(());
        }
        let chosen: Vec<bool> = self.lanes.iter().map(Lane::is_at_limit).collect();
        let preparer = &self.preparer;
        let fetch = |lane: &mut Lane| {
            // The lane reports the error when its episode has ended.
            let _ = lane.fetch_next(preparer);
            Ok(())
        };
        over_chosen(&self.team, &mut self.lanes, &chosen, stop, fetch).map(|_| ())
    }

    /// Begins episode 0 of another source in the chosen lanes, and leaves the current episodes of the others unchanged.
    ///
    /// The later episodes of the other lanes come from the new source, too, and their numbers continue. Only an episode
    /// whose instance the lane has already fetched still comes from the old source.
    ///
    /// # Errors
    /// As for [`Batch::reset_lanes`]; also if the thread of the source cannot be started.
    pub fn reset_with(&mut self, source: impl Instances + 'static, chosen: &[bool]) -> Result<(), Error> {
        let firsts = self.fetch_with(source, chosen, &AtomicBool::new(false))?;
        self.begin_with(firsts)
    }

    /// Fetches the first instances of another source for the chosen lanes. Changes no episode.
    ///
    /// Another thread may set `stop` to end the call soon.
    ///
    /// # Errors
    /// As for [`Batch::reset_with`]; also [`Error::Cancelled`] if the call was stopped.
    pub fn fetch_with(
        &mut self,
        source: impl Instances + 'static,
        chosen: &[bool],
        stop: &AtomicBool,
    ) -> Result<FirstInstances, Error> {
        self.check_chosen(chosen)?;
        let preparer = Preparer::new(Arc::new(source), self.lanes.len())?;
        let first = |lane: &mut Lane| {
            let instance = preparer.take(lane.index)?;
            lane.check_fits(&instance).map(|()| instance)
        };
        let instances = over_chosen(&self.team, &mut self.lanes, chosen, stop, first)?;
        Ok(FirstInstances { preparer, instances })
    }

    /// Begins the episodes whose instances [`Batch::fetch_with`] has fetched.
    ///
    /// # Errors
    /// [`Error::Length`] if the instances belong to a batch of another size or an instance does not fit the config, or
    /// [`Error::NotReset`] if the first call leaves out a lane: every episode is then unchanged. [`Error::Memory`] if
    /// there is not enough memory for a lane's map: the episode of that lane is then unchanged.
    pub fn begin_with(&mut self, firsts: FirstInstances) -> Result<(), Error> {
        let FirstInstances { preparer, instances } = firsts;
        Error::check_length("first instances", self.lanes.len(), instances.len())?;
        for (lane, instance) in self.lanes.iter().zip(&instances) {
            instance.as_ref().map_or_else(|| self.check_started(), |instance| lane.check_fits(instance))?;
        }
        self.preparer = preparer;
        let mut begun = Ok(());
        for (lane, instance) in self.lanes.iter_mut().zip(instances) {
            match instance {
                Some(instance) => begun = begun.and(lane.begin_with(instance, &self.preparer)),
                None => self.preparer.request(lane.index, lane.requested),
            }
        }
        self.is_started |= begun.is_ok();
        begun
    }

    /// Replaces the source of the instances of all episodes that have not begun.
    ///
    /// The current episodes continue, and so do the numbers of the episodes. `changed` marks the lanes whose instances
    /// differ in the new source. Instances that are already prepared for the remaining lanes are kept. Another thread
    /// may set `stop` to end the call soon.
    ///
    /// # Errors
    /// If `changed` does not have one flag per lane. [`Error::Cancelled`] if the call was stopped. With
    /// [`Autoreset::NextStep`], if an episode begins with the next step, but the new source has no fitting instance for
    /// it. In these cases, every lane is unchanged. [`Error::Memory`] if there is not enough memory for such an
    /// episode: the next step then fails, too.
    pub fn replace_source(
        &mut self,
        source: impl Instances + 'static,
        changed: &[bool],
        stop: &AtomicBool,
    ) -> Result<(), Error> {
        Error::check_length("changed lanes", self.lanes.len(), changed.len())?;
        let next = |lane: &mut Lane| lane.next_instance_of(&source);
        let instances = over_chosen(&self.team, &mut self.lanes, changed, stop, next)?;
        self.preparer.replace(Arc::new(source));
        let lanes = self.lanes.iter_mut().zip(instances);
        let lanes = lanes.filter_map(|(lane, next)| Some(lane.change_source(next?, &self.preparer)));
        lanes.fold(Ok(()), Result::and)
    }

    /// Plays one step in every lane, begins new episodes according to [`Autoreset`], and fills the buffers.
    ///
    /// Shape: `actions` and each buffer of `out` are `[lanes, agents]`.
    ///
    /// # Errors
    /// Before the first reset, for a list or buffer of the wrong length, for a map that is larger than
    /// [`crate::GlobalBuffers::size`], or if a lane's next episode could not be prepared in an earlier step. No lane
    /// plays then, unless the map belongs to an episode that begins within the same step.
    pub fn step<'a>(
        &mut self,
        actions: &[Action],
        out: StepOut<'_>,
        buffers: impl Into<ObservationBuffers<'a>>,
    ) -> Result<(), Error> {
        let buffers = buffers.into();
        self.check_started()?;
        let num_agents = self.lanes.len() * self.config.num_agents;
        Error::check_length("actions", num_agents, actions.len())?;
        out.check(num_agents)?;
        buffers.check(self.lanes.len(), &self.config)?;
        if let Some(failure) = self.lanes.iter().find_map(|lane| lane.failure.as_ref()) {
            return Err(failure.clone());
        }
        buffers.check_maps(self.lanes.iter().map(Lane::next_engine))?;
        let (autoreset, preparer) = (self.autoreset, &self.preparer);
        let streaming = self.is_streamed(&buffers);
        let steps = Some((actions, out));
        let jobs = Jobs { config: &self.config, lanes: &mut self.lanes, steps, buffers, streaming };
        jobs.run(&self.team, &mut self.pace, &|lane, actions, out| {
            lane.step(actions, out, autoreset, preparer)
        })
    }

    /// Fills the buffers with the observations, or global states, and action masks of every lane.
    ///
    /// # Errors
    /// Before the first reset, for a buffer of the wrong length, or for a map that is larger than
    /// [`crate::GlobalBuffers::size`].
    ///
    /// Rule: observe/default
    pub fn observe<'a>(&mut self, buffers: impl Into<ObservationBuffers<'a>>) -> Result<(), Error> {
        let buffers = buffers.into();
        self.check_started()?;
        buffers.check(self.lanes.len(), &self.config)?;
        buffers.check_maps(self.lanes.iter().map(|lane| &lane.engine))?;
        let streaming = self.is_streamed(&buffers);
        let config = &self.config;
        let jobs = Jobs { config, lanes: &mut self.lanes, steps: None, buffers, streaming };
        jobs.run(&self.team, &mut self.pace, &|_, _, _| Ok(()))
    }

    /// Fills the buffers with the terminal observations, or global states, and action masks of the last ended episodes
    /// of some lanes, in the given order.
    ///
    /// # Errors
    /// For a lane that does not exist or has no ended episode, for a buffer of the wrong length, or for a map that is
    /// larger than [`crate::GlobalBuffers::size`].
    pub fn observe_ended<'a>(
        &self,
        lanes: &[usize],
        buffers: impl Into<ObservationBuffers<'a>>,
    ) -> Result<(), Error> {
        let buffers = buffers.into();
        let no_end = |lane| Error::NotEnded { lane };
        let engine = |&lane| Ok(self.ended(lane)?.ok_or_else(|| no_end(lane))?.0);
        let engines = lanes.iter().map(engine).collect::<Result<Vec<_>, Error>>()?;
        buffers.check(lanes.len(), &self.config)?;
        buffers.check_maps(engines.iter().copied())?;
        let streaming = self.is_streamed(&buffers);
        let mut rest = buffers;
        let parts = engines.into_iter().map(|engine| (engine, rest.take_first(1, &self.config))).collect();
        self.team.share(parts, |(engine, part)| part.write(engine, streaming)).into_iter().collect()
    }

    /// Returns whether a buffer should be written with streaming stores.
    fn is_streamed(&self, buffers: &ObservationBuffers<'_>) -> bool {
        let engines = self.lanes.iter().map(|lane| &lane.engine);
        bypasses_cache(buffers.observations.num_streamable(), engines, self.team.num_threads())
    }

    /// Returns the environment of a lane.
    ///
    /// # Errors
    /// If the lane does not exist.
    pub fn lane(&self, lane: usize) -> Result<&Engine, Error> {
        self.check_lane(lane).map(|lane| &lane.engine)
    }

    /// Returns the number of a lane's current episode, or `None` before the first reset.
    ///
    /// # Errors
    /// If the lane does not exist.
    pub fn episode(&self, lane: usize) -> Result<Option<u64>, Error> {
        self.check_lane(lane).map(|lane| lane.episode)
    }

    /// Returns whether the current episode of a lane has ended, so that the next step does not play it.
    ///
    /// # Errors
    /// If the lane does not exist.
    pub fn is_over(&self, lane: usize) -> Result<bool, Error> {
        self.check_lane(lane).map(|lane| lane.is_over)
    }

    /// Returns how many episodes a lane has begun. Unlike [`Batch::episode`], the number does not restart
    /// with a new source.
    ///
    /// # Errors
    /// If the lane does not exist.
    pub fn num_begun(&self, lane: usize) -> Result<u64, Error> {
        self.check_lane(lane).map(|lane| lane.num_begun)
    }

    /// Returns the instance of a lane's next episode, if it is fetched and no engine has started it.
    ///
    /// # Errors
    /// If the lane does not exist.
    pub fn next_instance(&self, lane: usize) -> Result<Option<&Instance>, Error> {
        self.check_lane(lane).map(|lane| lane.pending.as_ref())
    }

    /// Runs all parts of a caller's work on the threads of the batch, and returns the results in the order of the
    /// parts.
    ///
    /// Like a step, the call uses only the calling thread as long as further threads do not make the work faster. A
    /// part can run on any thread.
    pub fn share<P: Send, T: Send + Sync>(
        &mut self,
        parts: Vec<P>,
        work: impl Fn(&Self, P) -> T + Sync,
    ) -> Vec<T> {
        let start = Instant::now();
        let batch = &*self;
        let done = if batch.team.num_threads() == 1 || batch.shared_pace.is_alone() {
            parts.into_iter().map(|part| work(batch, part)).collect()
        } else {
            batch.team.share(parts, |part| work(batch, part))
        };
        self.shared_pace.record(start.elapsed());
        done
    }

    /// Returns whether an episode of a lane ended in the last step.
    ///
    /// # Errors
    /// If the lane does not exist.
    pub fn has_just_ended(&self, lane: usize) -> Result<bool, Error> {
        self.check_lane(lane).map(|lane| lane.has_just_ended)
    }

    /// Returns the last ended episode of a lane: the environment at its end, for the terminal observation, and its
    /// metrics.
    ///
    /// # Errors
    /// If the lane does not exist.
    ///
    /// Rule: metrics/finish, metrics/nothing, metrics/restart
    pub fn ended(&self, lane: usize) -> Result<Option<(&Engine, Metrics)>, Error> {
        self.check_lane(lane).map(Lane::ended)
    }

    fn check_started(&self) -> Result<(), Error> {
        if self.is_started {
            return Ok(());
        }
        Err(Error::NotReset)
    }

    fn check_chosen(&self, chosen: &[bool]) -> Result<(), Error> {
        Error::check_length("chosen lanes", self.lanes.len(), chosen.len())?;
        if chosen.contains(&false) { self.check_started() } else { Ok(()) }
    }

    fn check_lane(&self, lane: usize) -> Result<&Lane, Error> {
        let expected = || format!("below {}, the number of lanes", self.lanes.len());
        self.lanes.get(lane).ok_or_else(|| Error::argument("lane", lane, expected()))
    }
}

/// The first instances of another source, for some lanes of a batch.
pub struct FirstInstances {
    preparer: Preparer,
    instances: Vec<Option<Instance>>,
}

impl FirstInstances {
    /// Returns the instance of a lane, if the lane was chosen.
    pub fn instance(&self, lane: usize) -> Option<&Instance> {
        self.instances.get(lane)?.as_ref()
    }
}

/// Calls a function for the chosen lanes, until another thread sets `stop`.
fn over_chosen<T: Send + Sync>(
    team: &Team,
    lanes: &mut [Lane],
    chosen: &[bool],
    stop: &AtomicBool,
    work: impl Fn(&mut Lane) -> Result<T, Error> + Sync,
) -> Result<Vec<Option<T>>, Error> {
    over_lanes(team, lanes, |lane| {
        if !chosen[lane.index] {
            return Ok(None);
        }
        if stop.load(Relaxed) { Err(Error::Cancelled) } else { work(lane).map(Some) }
    })
}

/// Calls a function for all lanes on the threads of a team. If several lanes fail, the error is that of the first.
fn over_lanes<T: Send + Sync>(
    team: &Team,
    lanes: &mut [Lane],
    work: impl Fn(&mut Lane) -> Result<T, Error> + Sync,
) -> Result<Vec<T>, Error> {
    team.share(lanes.iter_mut().collect(), work).into_iter().collect()
}
