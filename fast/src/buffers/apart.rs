//! The buffers for `POMAPF` and `MAPF` observations.

use pogema_core::{Config, Error, from_starts};

use crate::Engine;

use super::global::{GlobalBuffers, write_pairs};
use super::{pad, take_first};

/// The buffers for the windows of obstacles and agents.
///
/// Shape: both `[lanes, agents, side, side]`; every value 0 or 1.
#[derive(Debug)]
pub enum Windows<'a> {
    /// Windows of obstacles, and of agents.
    F32(&'a mut [f32], &'a mut [f32]),
    /// Windows of obstacles, and of agents.
    U8(&'a mut [u8], &'a mut [u8]),
}

impl Windows<'_> {
    fn lengths(&self) -> (usize, usize) {
        match self {
            Self::F32(obstacles, agents) => (obstacles.len(), agents.len()),
            Self::U8(obstacles, agents) => (obstacles.len(), agents.len()),
        }
    }

    fn take_first(&mut self, num_values: usize) -> Self {
        match self {
            Self::F32(obstacles, agents) => {
                Self::F32(take_first(obstacles, num_values), take_first(agents, num_values))
            }
            Self::U8(obstacles, agents) => {
                Self::U8(take_first(obstacles, num_values), take_first(agents, num_values))
            }
        }
    }

    pub(super) fn num_bytes(&self) -> usize {
        match self {
            Self::F32(obstacles, agents) => size_of_val(*obstacles) + size_of_val(*agents),
            Self::U8(obstacles, agents) => size_of_val(*obstacles) + size_of_val(*agents),
        }
    }
}

/// The buffers for `POMAPF` observations, and for `MAPF` observations if there are buffers for the global state.
#[derive(Debug)]
pub struct ApartBuffers<'a> {
    /// The windows.
    pub windows: Windows<'a>,
    /// The cells of the agents, relative to their starts.
    ///
    /// Shape: `[lanes, agents, 2]`
    pub xy: &'a mut [i64],
    /// The goals of the agents, relative to their starts.
    ///
    /// Shape: `[lanes, agents, 2]`
    pub target_xy: &'a mut [i64],
    /// The map, cells and goals, with a border as wide as the radius.
    pub global: Option<GlobalBuffers<'a>>,
}

impl ApartBuffers<'_> {
    pub(super) fn check(&self, num_lanes: usize, config: &Config) -> Result<(), Error> {
        let num_agents = num_lanes * config.num_agents;
        let (obstacles, agents) = self.windows.lengths();
        Error::check_length("obstacles", num_lanes * config.num_observed() / 3, obstacles)?;
        Error::check_length("agents", num_lanes * config.num_observed() / 3, agents)?;
        Error::check_length("xy", 2 * num_agents, self.xy.len())?;
        Error::check_length("target_xy", 2 * num_agents, self.target_xy.len())?;
        self.global.as_ref().map_or(Ok(()), |global| global.check(num_lanes, config))
    }

    pub(super) fn take_first(&mut self, num_lanes: usize, config: &Config) -> Self {
        let num_agents = num_lanes * config.num_agents;
        Self {
            windows: self.windows.take_first(num_lanes * config.num_observed() / 3),
            xy: take_first(&mut self.xy, 2 * num_agents),
            target_xy: take_first(&mut self.target_xy, 2 * num_agents),
            global: self.global.as_mut().map(|global| global.take_first(num_lanes, config)),
        }
    }

    /// Writes the observations of one lane.
    ///
    /// Rule: observe/pomapf, observe/pomapf/relative, observe/mapf
    pub(super) fn write(self, engine: &Engine, streaming: bool) -> Result<(), Error> {
        let len = engine.config.num_observed() / 3;
        match self.windows {
            Windows::F32(obstacles, agents) => {
                engine.write_windows(pad(obstacles, len), pad(agents, len), streaming);
            }
            Windows::U8(obstacles, agents) => {
                engine.write_windows(pad(obstacles, len), pad(agents, len), streaming);
            }
        }
        write_pairs(from_starts(&engine.cells, &engine.starts), self.xy);
        write_pairs(from_starts(&engine.goals, &engine.starts), self.target_xy);
        self.global.map_or(Ok(()), |global| global.write(engine))
    }
}
