//! An instance: everything an episode needs besides its actions.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use crate::{Cell, Config, Error, GoalStream, Map};

/// What agents see beyond the wall around the map.
///
/// Rule: border/outside
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outside {
    /// Free cells.
    #[default]
    Free,
    /// Random obstacles, as a map that is wider by the radius on every side.
    ///
    /// Shape: `[height + 2 * radius, width + 2 * radius]`; only its rim is ever seen.
    Noise(Map),
}

/// A map, what surrounds it, and where each agent starts and wants to go.
///
/// Engines rely on what [`Instance::new`] has checked, so its parts can be read but not changed.
#[derive(Clone, Debug)]
pub struct Instance {
    map: Map,
    outside: Outside,
    starts: Vec<Cell>,
    goals: Vec<GoalStream>,
}

impl Instance {
    /// An instance, checked as a whole.
    ///
    /// # Errors
    /// [`Error::Length`] unless each start has its goals; [`Error::Agent`] for a start or first goal off the
    /// map, or two agents with one start.
    ///
    /// Rule: place/explicit
    pub fn new(map: Map, outside: Outside, starts: Vec<Cell>, goals: Vec<GoalStream>) -> Result<Self, Error> {
        Error::check_length("goals", starts.len(), goals.len())?;
        check_inside(&map, "start", starts.iter().copied())?;
        check_inside(&map, "goal", goals.iter().map(GoalStream::first))?;
        let mut seen = HashMap::with_capacity(starts.len());
        for (agent, &start) in starts.iter().enumerate() {
            if let Some(other) = seen.insert(start, agent) {
                return Err(Error::agent(agent, format!("start {start} is the start of agent {other} too")));
            }
        }
        Ok(Self { map, outside, starts, goals })
    }

    /// The map without its border.
    pub fn map(&self) -> &Map {
        &self.map
    }

    /// What lies beyond the wall.
    pub fn outside(&self) -> &Outside {
        &self.outside
    }

    /// Where each agent starts.
    pub fn starts(&self) -> &[Cell] {
        &self.starts
    }

    /// The goals of each agent, in order.
    pub fn goals(&self) -> &[GoalStream] {
        &self.goals
    }

    /// The goals of each agent, and nothing else, without copying them.
    pub fn into_goals(self) -> Vec<GoalStream> {
        self.goals
    }

    /// Passes if the instance can be played with a config: one start and goal per agent, and noise as large as
    /// the map with the border that the radius asks for.
    ///
    /// # Errors
    /// [`Error::Length`] naming what does not fit.
    pub fn check_fits(&self, config: &Config) -> Result<(), Error> {
        Error::check_length("starts", config.num_agents, self.starts.len())?;
        if let Outside::Noise(noise) = &self.outside {
            let border = 2 * config.radius;
            Error::check_length("rows of noise", self.map.height() + border, noise.height())?;
            Error::check_length("columns of noise", self.map.width() + border, noise.width())?;
        }
        Ok(())
    }

    /// The first goal of each agent.
    pub fn first_goals(&self) -> Vec<Cell> {
        self.goals.iter().map(GoalStream::first).collect()
    }
}

fn check_inside(map: &Map, what: &str, cells: impl Iterator<Item = Cell>) -> Result<(), Error> {
    for (agent, cell) in cells.enumerate() {
        if !map.contains(cell) {
            return Err(Error::outside(agent, what, cell, map.height(), map.width()));
        }
    }
    Ok(())
}
