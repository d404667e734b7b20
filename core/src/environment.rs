//! What every engine can do.

use serde::{Deserialize, Serialize};

use crate::{Action, Cell, Config, Error, Instance};

/// An implementation of the rules: one environment, its whole state inside.
///
/// The caller owns every buffer. Lengths are checked before anything changes, and an `Err` leaves the state
/// as it was. A step never resets; stepping on after the end is allowed (rule: end/after).
pub trait Environment {
    /// The rules and sizes this environment was made for.
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

    /// Takes the last step back; says whether there was one. Needs `persistent` in the config.
    ///
    /// # Errors
    /// Before the first reset, or if the config does not keep steps.
    ///
    /// Rule: history/step-back
    fn step_back(&mut self) -> Result<bool, Error>;

    /// Writes the `default` observation of all agents.
    ///
    /// Shape: `[agents, 3, side, side]`; channels obstacles, agents, goal; every value 0 or 1.
    ///
    /// # Errors
    /// Before the first reset, or for a buffer of the wrong length.
    ///
    /// Rule: observe/default
    fn observe(&self, out: &mut [f32]) -> Result<(), Error>;

    /// Writes the `POMAPF` observation of all agents.
    ///
    /// # Errors
    /// Before the first reset, or for a buffer of the wrong length.
    ///
    /// Rule: observe/pomapf
    fn observe_pomapf(&self, out: PomapfOut<'_>) -> Result<(), Error>;

    /// Writes what the `MAPF` observation adds to `POMAPF`.
    ///
    /// # Errors
    /// Before the first reset, or for a buffer of the wrong length.
    ///
    /// Rule: observe/mapf
    fn observe_mapf(&self, out: MapfOut<'_>) -> Result<(), Error>;

    /// The whole visible state. Before the first reset everything is empty.
    fn snapshot(&self) -> Snapshot;
}

/// Where a step writes its results, one value per agent.
#[derive(Debug)]
pub struct StepOut<'a> {
    /// Rule: reward/own, reward/shared
    pub rewards: &'a mut [f32],
    /// Rule: end/terminated
    pub terminated: &'a mut [bool],
    /// Rule: end/truncated
    pub truncated: &'a mut [bool],
}

impl StepOut<'_> {
    /// Passes if there is one place per agent in every buffer.
    ///
    /// # Errors
    /// [`Error::Length`] naming the first buffer that does not fit.
    pub fn check(&self, num_agents: usize) -> Result<(), Error> {
        Error::check_length("rewards", num_agents, self.rewards.len())?;
        Error::check_length("terminated", num_agents, self.terminated.len())?;
        Error::check_length("truncated", num_agents, self.truncated.len())
    }
}

/// Where the `POMAPF` observation goes.
///
/// Rule: observe/pomapf
#[derive(Debug)]
pub struct PomapfOut<'a> {
    /// Shape: `[agents, side, side]`
    pub obstacles: &'a mut [f32],
    /// Shape: `[agents, side, side]`
    pub agents: &'a mut [f32],
    /// Shape: `[agents, 2]`, the cell minus the start, (row, col)
    pub cells: &'a mut [i32],
    /// Shape: `[agents, 2]`, the goal minus the start, (row, col)
    pub goals: &'a mut [i32],
}

/// Where the arrays go that `MAPF` adds to `POMAPF`.
///
/// Rule: observe/mapf
#[derive(Debug)]
pub struct MapfOut<'a> {
    /// Shape: `[height + 2 * radius, width + 2 * radius]`, 1 for an obstacle
    pub obstacles: &'a mut [u8],
    /// Shape: `[agents, 2]`, the cell counted from the border's corner, (row, col)
    pub cells: &'a mut [i32],
    /// Shape: `[agents, 2]`, the goal counted from the border's corner, (row, col)
    pub goals: &'a mut [i32],
}

/// The visible state between two steps.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Snapshot {
    /// Units: steps since the reset.
    #[serde(default, skip_serializing)]
    pub step: u64,
    /// Where each agent is; a finished agent stays where it finished.
    pub cells: Vec<Cell>,
    /// Where each agent wants to go now.
    pub goals: Vec<Cell>,
    /// Which agents still take part.
    pub active: Vec<bool>,
    /// Which active agents stood on their goals after the last move, before goals changed.
    pub on_goal: Vec<bool>,
    /// The cells that the occupancy grid marks, row by row.
    pub occupied: Vec<Cell>,
}
