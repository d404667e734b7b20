//! The interface that every engine implements.

use std::collections::HashSet;

use serde::{Deserialize, Serialize};

use crate::metrics::Seen;
use crate::{Action, Cell, Config, Error, Instance, counted};

/// An engine: an implementation of the rules for one environment, with its whole state.
///
/// The caller owns every buffer. Every method checks lengths first, and an `Err` leaves the state unchanged.
/// A step never resets; further steps after the end are allowed (rule: end/after). An engine is `Send`, because the
/// kit for ports plays cases on several threads.
///
/// [`crate::Episode`] uses these methods to measure, record and undo steps.
pub trait Environment: Send {
    /// Returns the rules and sizes of this environment.
    fn config(&self) -> &Config;

    /// Starts an episode.
    ///
    /// # Errors
    /// If the instance does not fit the config.
    fn reset(&mut self, instance: &Instance) -> Result<(), Error>;

    /// Plays one step.
    ///
    /// # Errors
    /// Before the first reset, or for a buffer or action list of the wrong length.
    fn step(&mut self, actions: &[Action], out: StepOut<'_>) -> Result<(), Error>;

    /// Restores the state that the episode had `step` steps after the reset: cells, goals, active agents, occupancy
    /// and time.
    ///
    /// Goal streams and [`State::on_goal`] stay as they are, so repeating a step can lead to other goals.
    ///
    /// # Errors
    /// Before the first reset, or [`Error::ForeignState`] for a state that does not fit the map and its agents.
    ///
    /// Rule: history/step-back
    fn restore(&mut self, step: u64, state: &Snapshot) -> Result<(), Error>;

    /// Returns the state of all agents. Before the first reset every list is empty.
    fn state(&self) -> State<'_>;

    /// Returns the cells that the occupancy grid marks, row by row.
    fn occupied(&self) -> Vec<Cell>;

    /// Writes the `default` observation of all agents.
    ///
    /// Shape: `[agents, 3, side, side]`; channels obstacles, agents, goal; every value 0 or 1.
    ///
    /// # Errors
    /// Before the first reset, or for a buffer of the wrong length.
    ///
    /// Rule: observe/default
    fn observe(&self, out: &mut [f32]) -> Result<(), Error>;

    /// Writes the map with its border.
    ///
    /// Shape: `[height + 2 * radius, width + 2 * radius]`, 1 for an obstacle.
    ///
    /// # Errors
    /// Before the first reset, or for a buffer of the wrong length.
    ///
    /// Rule: observe/mapf
    fn observe_map(&self, out: &mut [u8]) -> Result<(), Error>;

    /// Counts the agents and the free cells in the window of each agent.
    ///
    /// # Errors
    /// Before the first reset.
    ///
    /// Rule: metrics/density
    fn count_seen(&self, seen: &mut Vec<Seen>) -> Result<(), Error> {
        let area = self.config().side() * self.config().side();
        let mut values = vec![0.0; self.config().num_observed()];
        self.observe(&mut values)?;
        let count =
            |window: &[f32], set: bool| window.iter().filter(|&&value| (value != 0.0) == set).count() as u32;
        seen.clear();
        seen.extend(values.chunks(3 * area).map(|channels| Seen {
            agents: count(&channels[area..2 * area], true),
            free_cells: count(&channels[..area], false),
        }));
        Ok(())
    }

    /// Returns a copy of the visible state.
    fn snapshot(&self) -> Snapshot {
        let State { cells, goals, active, on_goal, .. } = self.state();
        Snapshot {
            cells: cells.to_vec(),
            goals: goals.to_vec(),
            active: active.to_vec(),
            on_goal: on_goal.to_vec(),
            occupied: self.occupied(),
        }
    }
}

impl<E: Environment + ?Sized> Environment for Box<E> {
    fn config(&self) -> &Config {
        (**self).config()
    }

    fn reset(&mut self, instance: &Instance) -> Result<(), Error> {
        (**self).reset(instance)
    }

    fn step(&mut self, actions: &[Action], out: StepOut<'_>) -> Result<(), Error> {
        (**self).step(actions, out)
    }

    fn restore(&mut self, step: u64, state: &Snapshot) -> Result<(), Error> {
        (**self).restore(step, state)
    }

    fn state(&self) -> State<'_> {
        (**self).state()
    }

    fn occupied(&self) -> Vec<Cell> {
        (**self).occupied()
    }

    fn observe(&self, out: &mut [f32]) -> Result<(), Error> {
        (**self).observe(out)
    }

    fn observe_map(&self, out: &mut [u8]) -> Result<(), Error> {
        (**self).observe_map(out)
    }

    fn count_seen(&self, seen: &mut Vec<Seen>) -> Result<(), Error> {
        (**self).count_seen(seen)
    }

    fn snapshot(&self) -> Snapshot {
        (**self).snapshot()
    }
}

/// Borrowed buffers for the results of a step, one value per agent.
#[derive(Debug)]
pub struct StepOut<'a> {
    /// The reward of each agent.
    ///
    /// Rule: reward/own, reward/shared
    pub rewards: &'a mut [f32],
    /// Which agents are terminated.
    ///
    /// Rule: end/terminated
    pub terminated: &'a mut [bool],
    /// Which agents are truncated.
    ///
    /// Rule: end/truncated
    pub truncated: &'a mut [bool],
}

impl StepOut<'_> {
    /// Splits every buffer after the first `num_agents` entries.
    pub fn split_at(self, num_agents: usize) -> (Self, Self) {
        let (rewards, other_rewards) = self.rewards.split_at_mut(num_agents);
        let (terminated, other_terminated) = self.terminated.split_at_mut(num_agents);
        let (truncated, other_truncated) = self.truncated.split_at_mut(num_agents);
        (
            Self { rewards, terminated, truncated },
            Self { rewards: other_rewards, terminated: other_terminated, truncated: other_truncated },
        )
    }

    /// Checks that every buffer has one entry per agent.
    ///
    /// # Errors
    /// [`Error::Length`] naming the first buffer of the wrong length.
    pub fn check(&self, num_agents: usize) -> Result<(), Error> {
        Error::check_length("rewards", num_agents, self.rewards.len())?;
        Error::check_length("terminated", num_agents, self.terminated.len())?;
        Error::check_length("truncated", num_agents, self.truncated.len())
    }
}

/// Owned buffers for the results of a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepResults {
    /// The reward of each agent.
    ///
    /// Rule: reward/own, reward/shared
    pub rewards: Vec<f32>,
    /// Which agents are terminated.
    ///
    /// Rule: end/terminated
    pub terminated: Vec<bool>,
    /// Which agents are truncated.
    ///
    /// Rule: end/truncated
    pub truncated: Vec<bool>,
}

impl StepResults {
    /// Creates buffers for this many agents, counted over all environments.
    pub fn new(num_agents: usize) -> Self {
        Self {
            rewards: vec![0.0; num_agents],
            terminated: vec![false; num_agents],
            truncated: vec![false; num_agents],
        }
    }

    /// Borrows the buffers for an engine to write to.
    pub fn out(&mut self) -> StepOut<'_> {
        let Self { rewards, terminated, truncated } = self;
        StepOut { rewards, terminated, truncated }
    }
}

/// The state of all agents between two steps, borrowed from the engine, with one value per agent in every list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct State<'a> {
    /// The number of steps since the reset.
    pub step: u64,
    /// Current cells; a finished agent stays where it finished.
    pub cells: &'a [Cell],
    /// Current goals.
    pub goals: &'a [Cell],
    /// Which agents are still active.
    pub active: &'a [bool],
    /// Which active agents stood on their goals after the last move, before goals changed.
    pub on_goal: &'a [bool],
}

impl State<'_> {
    /// Checks that this is the state after the given step of an episode with `num_agents` agents.
    ///
    /// # Errors
    /// [`Error::OutOfStep`] if it is the state of another step, or of another number of agents.
    pub fn check_next(&self, step: u64, num_agents: usize) -> Result<(), Error> {
        let reason = if self.cells.len() != num_agents {
            format!("found a state of {}, expected {num_agents}", counted(self.cells.len(), "agent"))
        } else if self.step != step {
            format!("found the state of step {}, expected step {step} of the same episode", self.step)
        } else {
            return Ok(());
        };
        Err(Error::OutOfStep { reason })
    }
}

/// A copy of the visible state between two steps, as traces store it. The lists are those of [`State`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "State describes them")]
pub struct Snapshot {
    pub cells: Vec<Cell>,
    pub goals: Vec<Cell>,
    pub active: Vec<bool>,
    pub on_goal: Vec<bool>,
    /// The cells that the occupancy grid marks, row by row.
    pub occupied: Vec<Cell>,
}

impl Snapshot {
    /// Returns the state of the agents, `step` steps after the reset.
    pub fn state(&self, step: u64) -> State<'_> {
        State { step, cells: &self.cells, goals: &self.goals, active: &self.active, on_goal: &self.on_goal }
    }

    /// Checks that `num_agents` agents on a map of `height` rows and `width` columns can be in this state.
    ///
    /// # Errors
    /// [`Error::ForeignState`] for a list of the wrong length, a cell outside the map or two active agents on one cell.
    pub fn check_fits(&self, num_agents: usize, (height, width): (usize, usize)) -> Result<(), Error> {
        let is_inside = |cell: &Cell| cell.is_within(height, width);
        let lengths = [self.cells.len(), self.goals.len(), self.active.len(), self.on_goal.len()];
        let mut cells = self.cells.iter().chain(&self.goals).chain(&self.occupied);
        let mut taken = HashSet::new();
        let mut active = self.cells.iter().zip(&self.active).filter(|(_, active)| **active);
        let fits =
            lengths == [num_agents; 4] && cells.all(is_inside) && active.all(|(cell, _)| taken.insert(cell));
        if fits { Ok(()) } else { Err(Error::ForeignState) }
    }
}
