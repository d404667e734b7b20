//! The literal engine with one planted bug. The engine itself is correct: the bug changes its config, instance,
//! actions, states and results on their way in or out.

use pogema_conformance::Literal;
use pogema_core::{
    Action, Cell, Collision, Config, Environment, Error, Instance, Map, Occupancy, OnGoal, Outside, Reward,
    Snapshot, State, StepOut,
};

use crate::bug::Bug;
use crate::moves::Moves;
use crate::views::{corrupt, is_ring, shown_goal};

/// A [`Literal`] engine with one planted bug.
pub struct BuggyEngine {
    bug: Bug,
    config: Config,
    inner: Literal,
    instance: Option<Instance>,
    /// The state that callers see.
    visible: Snapshot,
}

impl BuggyEngine {
    pub fn make(bug: Bug, config: Config) -> Result<Box<dyn Environment>, Error> {
        let mut inner = config;
        match bug {
            Bug::TruncatesOneLate => inner.max_steps = config.max_steps.max(1).saturating_add(1),
            Bug::TruncatesOneEarly => inner.max_steps = config.max_steps.saturating_sub(1),
            Bug::NeverTruncatesAtZero if config.max_steps <= 0 => inner.max_steps = i64::MAX,
            Bug::SoftNoVanishing if config.collision == Collision::Soft => {
                inner.occupancy = Occupancy::Exact;
            }
            _ => {}
        }
        let inner = Literal::new(inner)?;
        Ok(Box::new(Self { bug, config, inner, instance: None, visible: Snapshot::default() }))
    }

    fn map(&self) -> &Map {
        self.instance.as_ref().unwrap().map()
    }

    /// Restores the inner engine to the visible state. The engine rejects impossible states, such as two agents on one
    /// cell; callers see them nevertheless.
    fn follow(&mut self) {
        let step = self.inner.state().step;
        let _ = self.inner.restore(step, &self.visible);
    }

    /// Restores the last goal of each agent whose goal sequence started again.
    fn keep_last_goals(&mut self, before: &Snapshot) {
        let first = self.instance.as_ref().unwrap().first_goals();
        for (agent, goal) in self.visible.goals.iter_mut().enumerate() {
            if self.visible.on_goal[agent] && *goal == first[agent] {
                *goal = before.goals[agent];
            }
        }
    }

    fn corrupt_results(&self, before: &Snapshot, out: StepOut<'_>) {
        let is_own = self.config.reward == Reward::Own;
        for (agent, cell) in self.visible.cells.iter().enumerate() {
            let is_there = *cell == before.goals[agent];
            match (self.bug, self.config.on_goal) {
                (Bug::RewardEveryStepOnGoal, OnGoal::Finish)
                | (Bug::NothingRewardsEachAlone, OnGoal::Nothing)
                    if is_own =>
                {
                    out.rewards[agent] = f32::from(u8::from(is_there));
                }
                (Bug::GoalChangesBeforeReward, OnGoal::Restart) => out.rewards[agent] = 0.0,
                (Bug::NothingEndsEachAlone, OnGoal::Nothing) | (Bug::RestartEndsOnGoal, OnGoal::Restart) => {
                    out.terminated[agent] = is_there;
                }
                (Bug::FinishEndsForOneStep, OnGoal::Finish) => {
                    out.terminated[agent] = self.visible.on_goal[agent];
                }
                (Bug::TruncatesActiveOnly, _) => out.truncated[agent] &= before.active[agent],
                _ => {}
            }
        }
    }
}

impl Environment for BuggyEngine {
    fn config(&self) -> &Config {
        &self.config
    }

    fn reset(&mut self, instance: &Instance) -> Result<(), Error> {
        let mut outside = instance.outside().clone();
        if self.bug == Bug::OutsideFilled {
            let border = 2 * self.config.radius;
            let (height, width) = (instance.map().height() + border, instance.map().width() + border);
            outside = Outside::Noise(Map::new(height, width, vec![true; height * width])?);
        }
        let (starts, goals) = (instance.starts().to_vec(), instance.goals().to_vec());
        self.inner.reset(&Instance::new(instance.map().clone(), outside, starts, goals)?)?;
        self.instance = Some(instance.clone());
        self.visible = self.inner.snapshot();
        if self.bug == Bug::StartOnGoalFinishes && self.config.on_goal == OnGoal::Finish {
            self.visible.active = self.visible.on_goal.iter().map(|reached| !reached).collect();
            let Snapshot { cells, active, .. } = self.visible.clone();
            self.visible
                .occupied
                .retain(|cell| cells.iter().zip(&active).any(|(own, &is)| is && own == cell));
            self.follow();
        }
        Ok(())
    }

    fn step(&mut self, actions: &[Action], out: StepOut<'_>) -> Result<(), Error> {
        Error::check_length("actions", self.config.num_agents, actions.len())?;
        let before = self.visible.clone();
        let is_over = self.inner.state().step as i64 >= self.config.max_steps.max(1);
        let map = self.map().clone();
        let moves = Moves::new(self.bug, &self.config, &map, &before, is_over, actions);
        let StepOut { rewards, terminated, truncated } = out;
        self.inner.step(&moves.played(), StepOut { rewards, terminated, truncated })?;
        self.visible = self.inner.snapshot();
        moves.add_missing(&mut self.visible);
        if self.bug == Bug::SequenceStopsAtItsEnd && self.config.on_goal == OnGoal::Restart {
            self.keep_last_goals(&before);
        }
        self.corrupt_results(&before, StepOut { rewards, terminated, truncated });
        self.follow();
        Ok(())
    }

    fn restore(&mut self, step: u64, state: &Snapshot) -> Result<(), Error> {
        let mut state = state.clone();
        if self.bug == Bug::BackKeepsGoals {
            state.goals.clone_from(&self.visible.goals);
        }
        let step = if self.bug == Bug::BackKeepsTime { self.inner.state().step } else { step };
        self.inner.restore(step, &state)?;
        self.visible = self.inner.snapshot();
        Ok(())
    }

    fn state(&self) -> State<'_> {
        self.visible.state(self.inner.state().step)
    }

    fn occupied(&self) -> Vec<Cell> {
        let mut occupied = self.visible.occupied.clone();
        if [Bug::FinishedAreSeen, Bug::FinishedStillBlock].contains(&self.bug) {
            let agents = self.visible.cells.iter().zip(&self.visible.active);
            occupied.extend(agents.filter(|(_, active)| !**active).map(|(cell, _)| cell));
            occupied.sort_unstable();
            occupied.dedup();
        }
        occupied
    }

    fn observe(&self, out: &mut [f32]) -> Result<(), Error> {
        let State { step, cells, .. } = self.state();
        let mut shown = self.snapshot();
        for (goal, &cell) in shown.goals.iter_mut().zip(cells) {
            *goal = shown_goal(self.bug, self.config.radius, cell, *goal);
        }
        let mut inner = self.inner.clone();
        let _ = inner.restore(step, &shown);
        inner.observe(out)?;
        for (agent, channels) in out.chunks_mut(3 * self.config.side().pow(2)).enumerate() {
            corrupt(self.bug, &self.config, self.map(), &self.visible, agent, channels);
        }
        Ok(())
    }

    fn observe_map(&self, out: &mut [u8]) -> Result<(), Error> {
        self.inner.observe_map(out)?;
        let width = self.map().width() + 2 * self.config.radius;
        for (at, value) in out.iter_mut().enumerate() {
            if self.bug == Bug::NoRing && is_ring(&self.config, self.map(), (at / width, at % width)) {
                *value = 0;
            }
        }
        Ok(())
    }
}
