//! The work of one call, split into parts for the threads.

use std::time::Instant;

use pogema_core::{Action, Config, Error, StepOut};

use crate::buffers::{ObservationBuffers, Observations};
use crate::simd::prefetch_all;

use super::Lane;
use super::pace::Pace;
use super::team::Team;

/// Some lanes and the buffers for their observations. If the lanes play a step, also its actions and results.
pub(super) struct Jobs<'a> {
    /// The config of the batch, which determines the sizes of buffers.
    pub config: &'a Config,
    pub lanes: &'a mut [Lane],
    pub steps: Option<Steps<'a>>,
    pub buffers: ObservationBuffers<'a>,
    /// Whether the observations of all lanes should be written with stores that bypass the cache.
    pub streaming: bool,
}

/// The function that plays a step of a lane.
type Play<'a> = &'a (dyn Fn(&mut Lane, &[Action], StepOut<'_>) -> Result<(), Error> + Sync);

impl<'a> Jobs<'a> {
    /// Plays and observes all lanes on the threads of a team.
    pub fn run(self, team: &Team, pace: &mut Pace, play: Play<'_>) -> Result<(), Error> {
        if team.num_threads() == 1 {
            return self.run_here(play);
        }
        let start = Instant::now();
        let played = if pace.is_alone() { self.run_here(play) } else { self.run_shared(team, play) };
        pace.record(start.elapsed());
        played
    }

    fn run_shared(self, team: &Team, play: Play<'_>) -> Result<(), Error> {
        // The parts are small, so that no thread waits long for another.
        const PARTS_PER_THREAD: usize = 8;
        let most = self.lanes.len().div_ceil(PARTS_PER_THREAD * team.num_threads());
        let mut parts = Vec::with_capacity(self.lanes.len().div_ceil(most));
        let mut rest = self;
        while rest.lanes.len() > most {
            parts.push(rest.take_first(most));
        }
        parts.push(rest);
        team.share(parts, |part| part.run_here(play)).into_iter().collect()
    }

    fn run_here(mut self, play: Play<'_>) -> Result<(), Error> {
        while let Some(lane) = self.lanes.split_off_first_mut() {
            self.prefetch_first();
            if let Some((actions, out)) = self.take_steps(1) {
                play(lane, actions, out)?;
            }
            self.buffers.take_first(1, self.config).write(&lane.engine, self.streaming)?;
        }
        Ok(())
    }

    /// Prefetches the data of the first lane, so that it is loaded from memory while the previous lane plays.
    fn prefetch_first(&self) {
        let Some(Lane { engine, .. }) = self.lanes.first() else { return };
        if self.steps.is_some() {
            prefetch_all(engine.board.squares());
            prefetch_all(&engine.active);
            prefetch_all(&engine.on_goal);
            prefetch_all(&engine.targets);
            prefetch_all(&engine.ahead);
        }
        if !matches!(self.buffers.observations, Observations::None) {
            prefetch_all(engine.obstacles.words());
        }
        prefetch_all(engine.occupied.words());
        prefetch_all(&engine.cells);
        prefetch_all(&engine.goals);
    }

    /// Removes the first lanes with their steps and buffers, and returns them.
    fn take_first(&mut self, num_lanes: usize) -> Self {
        let Self { config, streaming, .. } = *self;
        let steps = self.take_steps(num_lanes);
        let lanes = self.lanes.split_off_mut(..num_lanes).unwrap_or_default();
        Self { config, lanes, steps, buffers: self.buffers.take_first(num_lanes, config), streaming }
    }

    fn take_steps(&mut self, num_lanes: usize) -> Option<Steps<'a>> {
        let num_agents = num_lanes * self.config.num_agents;
        let (actions, out) = self.steps.take()?;
        let (first_actions, actions) = actions.split_at(num_agents);
        let (first_out, out) = out.split_at(num_agents);
        self.steps = Some((actions, out));
        Some((first_actions, first_out))
    }
}

type Steps<'a> = (&'a [Action], StepOut<'a>);
