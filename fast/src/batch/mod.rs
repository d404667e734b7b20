//! Many environments, stepped and observed by one call.

mod jobs;
mod lane;
mod prepare;
mod team;

use pogema_core::{Action, Config, Error, Metrics, StepOut, check_threads};

use crate::{Engine, SimdPath};

use jobs::Jobs;
use lane::Lane;
use prepare::Preparer;
use team::Team;

pub use jobs::{ObservationBuffers, Observations};
pub use prepare::Instances;

/// What follows the end of a lane's episode by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Autoreset {
    /// The next episode begins within the same step: rewards and ends are those of the last step, observations
    /// those of the new episode.
    #[default]
    SameStep,
    /// The next episode begins with the next step, which ignores the lane's actions: rewards are 0, nothing ends,
    /// observations are those of the new episode.
    NextStep,
    /// Nothing: steps leave the lane as it ended, with rewards of 0 and the ends of its last step, until a reset.
    Off,
}

/// Many environments of one config, the lanes, each with its own map and its own episodes.
///
/// Every array has a leading axis `lanes`. An episode that ends, since all agents terminated or were cut off, is
/// followed by what [`Autoreset`] says, and stays readable through [`Batch::ended`] until the lane's next one ends.
///
/// What comes out does not depend on the number of threads.
pub struct Batch {
    config: Config,
    autoreset: Autoreset,
    lanes: Vec<Lane>,
    team: Team,
    preparer: Preparer,
    is_started: bool,
}

impl Batch {
    /// A batch of `num_lanes` environments, played by at most `num_threads` threads, the calling one among them. Call
    /// `reset` before the first step.
    ///
    /// # Errors
    /// If the config is out of range; for no lanes, or a number of threads other than 1 to 1024; if threads cannot be
    /// started.
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
        let preparer = Preparer::new(Box::new(source), num_lanes)?;
        Ok(Self { config, autoreset: Autoreset::default(), lanes, team, preparer, is_started: false })
    }

    /// The same batch with another rule for the ends of episodes, to be chosen before the first reset.
    #[must_use]
    pub fn with_autoreset(mut self, autoreset: Autoreset) -> Self {
        self.autoreset = autoreset;
        self
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
    /// If a lane has no next instance, or one that does not fit the config; every lane is then as it was. If
    /// memory does not suffice for a lane's map; that lane is then as it was.
    pub fn reset(&mut self) -> Result<(), Error> {
        self.reset_lanes(&vec![true; self.lanes.len()])
    }

    /// Begins the next episode of some lanes and leaves the others as they are; the first time it has to be all.
    ///
    /// # Errors
    /// As for [`Batch::reset`]; if there is not one flag per lane, or a lane is left out the first time.
    pub fn reset_lanes(&mut self, chosen: &[bool]) -> Result<(), Error> {
        self.check_chosen(chosen)?;
        let preparer = &self.preparer;
        over_lanes(&self.team, &mut self.lanes, |lane| {
            if chosen[lane.index] { lane.look_ahead(preparer) } else { Ok(()) }
        })?;
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

    /// Begins episode 0 of another source in some lanes, and leaves the others as they are; their later episodes
    /// come from the new source, too, under the numbers that follow, but for one that lies ready already.
    ///
    /// # Errors
    /// As for [`Batch::reset_lanes`]; if the thread of the source cannot be started.
    pub fn reset_with(&mut self, source: impl Instances + 'static, chosen: &[bool]) -> Result<(), Error> {
        self.check_chosen(chosen)?;
        let (team, config) = (&self.team, &self.config);
        let preparer = Preparer::new(Box::new(source), self.lanes.len())?;
        let first = |lane: &mut Lane| {
            let instance = preparer.take(lane.index)?;
            instance.check_fits(config).map(|()| Some(instance))
        };
        let firsts =
            over_lanes(
                team,
                &mut self.lanes,
                |lane| if chosen[lane.index] { first(lane) } else { Ok(None) },
            )?;
        self.preparer = preparer;
        let mut begun = Ok(());
        for (lane, instance) in self.lanes.iter_mut().zip(firsts) {
            match instance {
                Some(instance) => begun = begun.and(lane.begin_anew(instance, &self.preparer)),
                None => self.preparer.want(lane.index, lane.wanted),
            }
        }
        self.is_started |= begun.is_ok();
        begun
    }

    /// Plays one step in every lane, begins new episodes as [`Autoreset`] says, and shows what comes out.
    ///
    /// Shape: `actions` and each buffer of `out` are `[lanes, agents]`.
    ///
    /// # Errors
    /// Before the first reset, for a list or buffer of the wrong length, or if a lane's next episode could not
    /// begin in an earlier step; nothing is played then.
    pub fn step<'a>(
        &mut self,
        actions: &[Action],
        out: StepOut<'_>,
        view: impl Into<ObservationBuffers<'a>>,
    ) -> Result<(), Error> {
        let view = view.into();
        self.check_started()?;
        let num_agents = self.lanes.len() * self.config.num_agents;
        Error::check_length("actions", num_agents, actions.len())?;
        out.check(num_agents)?;
        view.check(self.lanes.len(), &self.config)?;
        if let Some(failure) = self.lanes.iter().find_map(|lane| lane.failure.as_ref()) {
            return Err(failure.clone());
        }
        let (autoreset, preparer) = (self.autoreset, &self.preparer);
        let beyond_cache = view.observations.is_beyond_cache();
        let steps = Some((actions, out));
        let jobs = Jobs { lanes: &mut self.lanes, steps, view, beyond_cache };
        jobs.run(&self.team, &|lane, actions, out| lane.step(actions, out, autoreset, preparer))
    }

    /// Observes every lane, or shows whatever else is asked for.
    ///
    /// # Errors
    /// Before the first reset, or for a buffer of the wrong length.
    ///
    /// Rule: observe/default
    pub fn observe<'a>(&mut self, view: impl Into<ObservationBuffers<'a>>) -> Result<(), Error> {
        let view = view.into();
        self.check_started()?;
        view.check(self.lanes.len(), &self.config)?;
        let beyond_cache = view.observations.is_beyond_cache();
        let jobs = Jobs { lanes: &mut self.lanes, steps: None, view, beyond_cache };
        jobs.run(&self.team, &|_, _, _| Ok(()))
    }

    /// Observes the last episodes of some lanes at their ends, in the order given.
    ///
    /// # Errors
    /// For a lane that is not there or of which no episode ended yet, or for a buffer of the wrong length.
    pub fn observe_ended(&self, lanes: &[usize], observations: Observations<'_>) -> Result<(), Error> {
        let no_end = |lane| Error::NotEnded { lane };
        let engine = |&lane| Ok(self.ended(lane)?.ok_or_else(|| no_end(lane))?.0);
        let engines = lanes.iter().map(engine).collect::<Result<Vec<_>, Error>>()?;
        observations.check(lanes.len(), &self.config)?;
        let beyond_cache = observations.is_beyond_cache();
        let per_lane = observations.per_lane(&self.config);
        match observations {
            Observations::None => Ok(()),
            Observations::F32(out) => self.in_parts(per_lane, out, |index, out| {
                engines[index].observe_all(out, beyond_cache);
                Ok(())
            }),
            Observations::U8(out) => self.in_parts(per_lane, out, |index, out| {
                engines[index].observe_all(out, beyond_cache);
                Ok(())
            }),
            Observations::Bits(out) => self.in_parts(per_lane, out, |index, out| {
                engines[index].observe_bits(0..self.config.num_agents, out)
            }),
        }
    }

    /// The environment of a lane.
    ///
    /// # Errors
    /// If there is no such lane.
    pub fn lane(&self, lane: usize) -> Result<&Engine, Error> {
        self.check_lane(lane).map(|lane| &lane.engine)
    }

    /// The number of a lane's present episode; none before the first reset.
    ///
    /// # Errors
    /// If there is no such lane.
    pub fn episode(&self, lane: usize) -> Result<Option<u64>, Error> {
        self.check_lane(lane).map(|lane| lane.episode)
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
        self.lanes.get(lane).ok_or_else(|| Error::config("lane", lane, expected()))
    }

    /// Writes a buffer part by part, shared among the team.
    fn in_parts<T: Send>(
        &self,
        per_part: usize,
        out: &mut [T],
        write: impl Fn(usize, &mut [T]) -> Result<(), Error> + Sync,
    ) -> Result<(), Error> {
        let parts = out.chunks_mut(per_part).enumerate().collect();
        self.team.share(parts, |(part, out)| write(part, out)).into_iter().collect()
    }
}

/// Does something to all lanes, shared among a team; the error is that of the first lane that has one.
fn over_lanes<T: Send + Sync>(
    team: &Team,
    lanes: &mut [Lane],
    work: impl Fn(&mut Lane) -> Result<T, Error> + Sync,
) -> Result<Vec<T>, Error> {
    team.share(lanes.iter_mut().collect(), work).into_iter().collect()
}
