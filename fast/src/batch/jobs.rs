//! The work of one call, split into parts for the threads.

use pogema_core::{Action, Config, Error, StepOut};

use crate::observe::{is_beyond_cache, words_per_agent};
use crate::simd::fetch_all;

use super::Lane;
use super::team::Team;

/// The buffer for the observations of a batch, if they are requested.
#[derive(Debug)]
pub enum Observations<'a> {
    /// No observations are requested.
    None,
    /// Shape: `[lanes, agents, 3, side, side]`
    F32(&'a mut [f32]),
    /// Shape: `[lanes, agents, 3, side, side]`
    U8(&'a mut [u8]),
    /// Shape: `[lanes, agents, words]` with [`words_per_agent`] words, in the format of
    /// [`crate::Engine::observe_bits`].
    Bits(&'a mut [u64]),
}

impl Observations<'_> {
    /// Returns the number of entries per lane.
    pub(super) fn per_lane(&self, config: &Config) -> usize {
        match self {
            Self::None => 0,
            Self::F32(_) | Self::U8(_) => config.num_observed(),
            Self::Bits(_) => config.num_agents * words_per_agent(config.radius),
        }
    }

    fn len(&self) -> usize {
        match self {
            Self::None => 0,
            Self::F32(out) => out.len(),
            Self::U8(out) => out.len(),
            Self::Bits(out) => out.len(),
        }
    }

    pub(super) fn check(&self, num_lanes: usize, config: &Config) -> Result<(), Error> {
        Error::check_length("observations", num_lanes * self.per_lane(config), self.len())
    }

    fn split_at(self, index: usize) -> (Self, Self) {
        match self {
            Self::None => (Self::None, Self::None),
            Self::F32(out) => {
                let (left, right) = out.split_at_mut(index);
                (Self::F32(left), Self::F32(right))
            }
            Self::U8(out) => {
                let (left, right) = out.split_at_mut(index);
                (Self::U8(left), Self::U8(right))
            }
            Self::Bits(out) => {
                let (left, right) = out.split_at_mut(index);
                (Self::Bits(left), Self::Bits(right))
            }
        }
    }

    /// Returns whether a buffer for all lanes should be written with stores that bypass the cache.
    pub(super) fn is_beyond_cache(&self) -> bool {
        match self {
            Self::None => false,
            Self::F32(out) => is_beyond_cache(size_of_val(*out)),
            Self::U8(out) => is_beyond_cache(size_of_val(*out)),
            Self::Bits(out) => is_beyond_cache(size_of_val(*out)),
        }
    }

    fn write(self, lane: &Lane, beyond_cache: bool) -> Result<(), Error> {
        match self {
            Self::None => {}
            Self::F32(out) => lane.engine.observe_all(out, beyond_cache),
            Self::U8(out) => lane.engine.observe_all(out, beyond_cache),
            Self::Bits(out) => lane.engine.observe_bits(0..lane.engine.on_goal().len(), out)?,
        }
        Ok(())
    }
}

/// The buffers that a step or an observation of a batch fills. [`Observations`] alone convert into them.
#[derive(Debug)]
pub struct ObservationBuffers<'a> {
    /// The buffer for observations.
    pub observations: Observations<'a>,
    /// The buffer for action masks, in the format of [`crate::Engine::mask_actions`], if they are requested.
    ///
    /// Shape: `[lanes, agents, 5]`
    pub masks: Option<&'a mut [i8]>,
}

impl<'a> From<Observations<'a>> for ObservationBuffers<'a> {
    fn from(observations: Observations<'a>) -> Self {
        Self { observations, masks: None }
    }
}

impl ObservationBuffers<'_> {
    pub(super) fn check(&self, num_lanes: usize, config: &Config) -> Result<(), Error> {
        self.observations.check(num_lanes, config)?;
        let expected = num_lanes * config.num_agents * Action::ALL.len();
        self.masks.as_ref().map_or(Ok(()), |masks| Error::check_length("action masks", expected, masks.len()))
    }

    fn split_at(self, num_lanes: usize, config: &Config) -> (Self, Self) {
        let num_observed = num_lanes * self.observations.per_lane(config);
        let (left, right) = self.observations.split_at(num_observed);
        let num_masks = num_lanes * config.num_agents * Action::ALL.len();
        let (left_masks, right_masks) = self.masks.map(|masks| masks.split_at_mut(num_masks)).unzip();
        (Self { observations: left, masks: left_masks }, Self { observations: right, masks: right_masks })
    }

    fn write(self, lane: &Lane, beyond_cache: bool) -> Result<(), Error> {
        self.observations.write(lane, beyond_cache)?;
        self.masks.map_or(Ok(()), |masks| lane.engine.mask_actions(masks))
    }
}

/// Some lanes, the actions and results of their step if there is one, and the buffers for their observations.
pub(super) struct Jobs<'a> {
    pub lanes: &'a mut [Lane],
    pub steps: Option<(&'a [Action], StepOut<'a>)>,
    pub buffers: ObservationBuffers<'a>,
    /// Whether the observations of all lanes should be written with stores that bypass the cache.
    pub beyond_cache: bool,
}

/// The function that plays a step of a lane.
type Play<'a> = &'a (dyn Fn(&mut Lane, &[Action], StepOut<'_>) -> Result<(), Error> + Sync);

impl Jobs<'_> {
    /// Plays and observes all lanes on the threads of a team.
    pub fn run(self, team: &Team, play: Play<'_>) -> Result<(), Error> {
        // The parts are small, so that no thread waits long for another.
        const PARTS_PER_THREAD: usize = 4;
        if team.num_threads() == 1 {
            return self.run_here(play);
        }
        let most = self.lanes.len().div_ceil(PARTS_PER_THREAD * team.num_threads());
        let mut parts = Vec::with_capacity(self.lanes.len().div_ceil(most));
        let mut rest = self;
        while rest.lanes.len() > most {
            let (part, others) = rest.split_at(most);
            parts.push(part);
            rest = others;
        }
        parts.push(rest);
        team.share(parts, |part| part.run_here(play)).into_iter().collect()
    }

    fn run_here(mut self, play: Play<'_>) -> Result<(), Error> {
        while !self.lanes.is_empty() {
            let (first, rest) = self.split_at(1);
            rest.fetch_first();
            let lane = &mut first.lanes[0];
            if let Some((actions, out)) = first.steps {
                play(lane, actions, out)?;
            }
            first.buffers.write(lane, first.beyond_cache)?;
            self = rest;
        }
        Ok(())
    }

    /// Prefetches the data of the first lane, so that it is loaded from memory while the previous lane plays.
    fn fetch_first(&self) {
        let Some(Lane { engine, .. }) = self.lanes.first() else { return };
        if self.steps.is_some() {
            fetch_all(engine.board.squares());
            fetch_all(&engine.active);
            fetch_all(&engine.on_goal);
            fetch_all(&engine.targets);
            fetch_all(&engine.ahead);
        }
        if !matches!(self.buffers.observations, Observations::None) {
            fetch_all(engine.obstacles.words());
        }
        fetch_all(engine.occupied.words());
        fetch_all(&engine.cells);
        fetch_all(&engine.goals);
    }

    fn split_at(self, num_lanes: usize) -> (Self, Self) {
        let Some(lane) = self.lanes.first() else { unreachable!("a split needs at least one lane") };
        let config = pogema_core::Environment::config(&lane.engine);
        let num_agents = num_lanes * config.num_agents;
        let beyond_cache = self.beyond_cache;
        let (left, right) = self.buffers.split_at(num_lanes, config);
        let (left_steps, right_steps) = self.steps.map(|steps| split_steps(steps, num_agents)).unzip();
        let (left_lanes, right_lanes) = self.lanes.split_at_mut(num_lanes);
        (
            Self { lanes: left_lanes, steps: left_steps, buffers: left, beyond_cache },
            Self { lanes: right_lanes, steps: right_steps, buffers: right, beyond_cache },
        )
    }
}

type Steps<'a> = (&'a [Action], StepOut<'a>);

fn split_steps((actions, out): Steps<'_>, index: usize) -> (Steps<'_>, Steps<'_>) {
    let (left, right) = actions.split_at(index);
    let (left_rewards, right_rewards) = out.rewards.split_at_mut(index);
    let (left_terminated, right_terminated) = out.terminated.split_at_mut(index);
    let (left_truncated, right_truncated) = out.truncated.split_at_mut(index);
    let left_out = StepOut { rewards: left_rewards, terminated: left_terminated, truncated: left_truncated };
    let right_out =
        StepOut { rewards: right_rewards, terminated: right_terminated, truncated: right_truncated };
    ((left, left_out), (right, right_out))
}
