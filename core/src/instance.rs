//! Instances: everything that an episode needs besides its config and its actions.

use rustc_hash::{FxBuildHasher, FxHashMap};
use serde::{Deserialize, Serialize};

use crate::{Cell, Config, Error, GoalStream, Map};

/// The cells that agents see beyond the wall around the map.
///
/// Rule: border/outside
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outside {
    /// Free cells.
    #[default]
    Free,
    /// Random obstacles, given as a map that is larger by the radius on every side.
    ///
    /// Shape: `[height + 2 * radius, width + 2 * radius]`; agents only see its rim.
    Noise(Map),
}

impl Outside {
    /// Checks that noise is as large as the map with its border.
    ///
    /// # Errors
    /// [`Error::Length`] for the rows or the columns of the noise.
    pub fn check_fits(&self, map: &Map, config: &Config) -> Result<(), Error> {
        if let Self::Noise(noise) = self {
            let border = 2 * config.radius;
            Error::check_length("noise", map.height() + border, noise.height())?;
            Error::check_length("each row of noise", map.width() + border, noise.width())?;
        }
        Ok(())
    }
}

/// A map, its surroundings, and the start and goals of each agent.
///
/// Engines rely on the checks of [`Instance::new`], so the parts of an instance are read-only.
#[derive(Clone, Debug)]
pub struct Instance {
    map: Map,
    outside: Outside,
    starts: Vec<Cell>,
    goals: Vec<GoalStream>,
}

impl Instance {
    /// Creates an instance and checks it.
    ///
    /// # Errors
    /// [`Error::Length`] if the number of goal streams differs from the number of starts. [`Error::Agent`] if a start,
    /// a first goal or a goal of a sequence lies outside the map, or if two agents have the same start.
    ///
    /// Rule: place/explicit
    pub fn new(map: Map, outside: Outside, starts: Vec<Cell>, goals: Vec<GoalStream>) -> Result<Self, Error> {
        Error::check_length("goals", starts.len(), goals.len())?;
        check_inside(&map, "start", starts.iter().copied().enumerate())?;
        let known = goals.iter().enumerate();
        check_inside(
            &map,
            "goal",
            known.flat_map(|(agent, stream)| stream.known().map(move |cell| (agent, cell))),
        )?;
        let mut seen = FxHashMap::with_capacity_and_hasher(starts.len(), FxBuildHasher);
        for (agent, &start) in starts.iter().enumerate() {
            if let Some(other) = seen.insert(start, agent) {
                return Err(Error::agent(agent, format!("start {start} is the start of agent {other} too")));
            }
        }
        Ok(Self { map, outside, starts, goals })
    }

    /// Returns the map without its border.
    pub fn map(&self) -> &Map {
        &self.map
    }

    /// Returns the area beyond the wall.
    pub fn outside(&self) -> &Outside {
        &self.outside
    }

    /// Returns the start of each agent.
    pub fn starts(&self) -> &[Cell] {
        &self.starts
    }

    /// Returns the goals of each agent, in order.
    pub fn goals(&self) -> &[GoalStream] {
        &self.goals
    }

    /// Returns the goals of each agent without copying them, and drops the rest.
    pub fn into_goals(self) -> Vec<GoalStream> {
        self.goals
    }

    /// Checks that the instance can be played with a config.
    ///
    /// Each agent needs a start and a goal, and noise must be as large as the map with its border.
    ///
    /// # Errors
    /// [`Error::Length`] naming the part that does not fit.
    pub fn check_fits(&self, config: &Config) -> Result<(), Error> {
        Error::check_length("starts", config.num_agents, self.starts.len())?;
        self.outside.check_fits(&self.map, config)
    }

    /// Returns the first goal of each agent.
    pub fn first_goals(&self) -> Vec<Cell> {
        self.goals.iter().map(GoalStream::first).collect()
    }
}

fn check_inside(map: &Map, what: &str, cells: impl Iterator<Item = (usize, Cell)>) -> Result<(), Error> {
    for (agent, cell) in cells {
        if !map.contains(cell) {
            return Err(Error::outside(agent, what, cell, map.height(), map.width()));
        }
    }
    Ok(())
}
