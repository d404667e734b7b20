//! What there is to draw.

use std::ops::RangeInclusive;

use pogema_core::{Cell, Config, Error, Map, Outside, Snapshot, Trace, TraceStep};

use crate::ground::Ground;

/// An episode to be drawn: a map, and the state after the reset and after each step.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// The rules and sizes.
    pub config: Config,
    /// The map without its border.
    pub map: Map,
    /// What lies beyond the wall.
    pub outside: Outside,
    /// The state after the reset.
    pub start: Snapshot,
    /// What each step did.
    pub steps: Vec<TraceStep>,
}

impl Film {
    /// The film of a recorded episode.
    pub fn of(trace: &Trace) -> Self {
        Self {
            config: trace.header.config,
            map: trace.header.map.clone(),
            outside: trace.header.outside.clone(),
            start: trace.start.state.clone(),
            steps: trace.steps.clone(),
        }
    }

    /// The state after the reset and after each step, one more than there are steps.
    pub fn states(&self) -> impl Iterator<Item = &Snapshot> {
        std::iter::once(&self.start).chain(self.steps.iter().map(|step| &step.state))
    }

    /// The state at a frame: 0 is after the reset, 1 after the first step.
    ///
    /// # Errors
    /// [`Error::State`] if the episode ends before it.
    pub fn state(&self, frame: usize) -> Result<&Snapshot, Error> {
        match frame.checked_sub(1) {
            None => Some(&self.start),
            Some(step) => self.steps.get(step).map(|step| &step.state),
        }
        .ok_or_else(|| refused("frame", frame, &format!("0 to {}", self.steps.len())))
    }

    /// The part of the episode from one frame to another, both included.
    ///
    /// # Errors
    /// [`Error::State`] if the range is empty or the episode ends before it does.
    pub fn part(&self, frames: RangeInclusive<usize>) -> Result<Self, Error> {
        let (first, last) = (*frames.start(), *frames.end());
        if first > last {
            return Err(refused("range of steps", format!("{first}..{last}"), "first..last"));
        }
        self.state(last)?;
        Ok(Self {
            config: self.config,
            map: self.map.clone(),
            outside: self.outside.clone(),
            start: self.state(first)?.clone(),
            steps: self.steps[first..last].to_vec(),
        })
    }

    /// The map, its border and what lies beyond.
    pub fn ground(&self) -> Ground<'_> {
        Ground { map: &self.map, outside: &self.outside, radius: self.config.radius }
    }

    /// Passes if an agent of this index takes part.
    ///
    /// # Errors
    /// [`Error::State`] if there is none.
    pub fn check_agent(&self, agent: usize) -> Result<(), Error> {
        check_agent(agent, self.start.cells.len())
    }

    /// Passes if every state has as many agents as the first, all of them and their goals on the map.
    ///
    /// # Errors
    /// [`Error::Length`] or [`Error::State`] about the first state that cannot be drawn.
    pub fn check(&self) -> Result<(), Error> {
        let num_agents = self.start.cells.len();
        for (frame, state) in self.states().enumerate() {
            Error::check_length("cells", num_agents, state.cells.len())?;
            Error::check_length("goals", num_agents, state.goals.len())?;
            Error::check_length("active", num_agents, state.active.len())?;
            let is_off = |cell: &&Cell| !self.map.contains(**cell);
            if let Some(cell) = state.cells.iter().chain(&state.goals).find(is_off) {
                let (height, width) = (self.map.height(), self.map.width());
                let expected = format!("a cell of the map of {height} rows and {width} columns");
                return Err(refused(&format!("a cell of frame {frame}"), cell, &expected));
            }
        }
        Ok(())
    }
}

/// Passes if `agent` is one of `num_agents`.
pub(crate) fn check_agent(agent: usize, num_agents: usize) -> Result<(), Error> {
    match num_agents.checked_sub(1) {
        Some(last) if agent <= last => Ok(()),
        Some(last) => Err(refused("agent", agent, &format!("0 to {last}"))),
        None => Err(refused("agent", agent, "none, the episode has no agents")),
    }
}

/// An error about one thing that was asked for.
pub(crate) fn refused(what: &str, value: impl std::fmt::Display, expected: &str) -> Error {
    Error::State { reason: format!("{what} is `{value}`, expected {expected}") }
}
