//! The buffers for global states: whole maps, with the cells and goals of all agents.

use pogema_core::{Config, Error, from_border};

use crate::Engine;

use super::take_first;

/// The buffers for the global states of some lanes. All maps are padded to one size.
#[derive(Debug)]
pub struct GlobalBuffers<'a> {
    /// Rows and columns of a padded map, border included.
    pub size: (usize, usize),
    /// Width of the border in the buffer, at most the radius. Cells and goals are counted from its top left corner.
    pub border: usize,
    /// The obstacles; 1 for an obstacle and for padding.
    ///
    /// Shape: `[lanes, rows, columns]`
    pub obstacles: &'a mut [u8],
    /// The cells of the agents; a finished agent stays where it finished.
    ///
    /// Shape: `[lanes, agents, 2]`
    pub cells: &'a mut [i64],
    /// The current goals of the agents.
    ///
    /// Shape: `[lanes, agents, 2]`
    pub goals: &'a mut [i64],
}

impl GlobalBuffers<'_> {
    pub(super) fn check(&self, num_lanes: usize, config: &Config) -> Result<(), Error> {
        if self.border > config.radius {
            return Err(Error::argument("border", self.border, format!("at most {}", config.radius)));
        }
        let num_cells = self.size.0.checked_mul(self.size.1);
        let num_cells = num_cells.and_then(|number| number.checked_mul(num_lanes)).unwrap_or(usize::MAX);
        Error::check_length("obstacles", num_cells, self.obstacles.len())?;
        Error::check_length("cells", 2 * num_lanes * config.num_agents, self.cells.len())?;
        Error::check_length("goals", 2 * num_lanes * config.num_agents, self.goals.len())
    }

    pub(super) fn take_first(&mut self, num_lanes: usize, config: &Config) -> Self {
        let Self { size, border, .. } = *self;
        Self {
            size,
            border,
            obstacles: take_first(&mut self.obstacles, num_lanes * size.0 * size.1),
            cells: take_first(&mut self.cells, 2 * num_lanes * config.num_agents),
            goals: take_first(&mut self.goals, 2 * num_lanes * config.num_agents),
        }
    }

    /// Returns the number of rows and columns of an engine's map with the border, if it fits the buffer.
    pub(super) fn padded(&self, engine: &Engine) -> Result<(usize, usize), Error> {
        let (height, width) = (engine.height + 2 * self.border, engine.width + 2 * self.border);
        if height > self.size.0 || width > self.size.1 {
            let size = format!("{} x {}", self.size.0, self.size.1);
            let expected = format!("at least {height} x {width}, a map with its border of {}", self.border);
            return Err(Error::argument("size", size, expected));
        }
        Ok((height, width))
    }

    /// Writes the global state of one lane.
    ///
    /// Rule: observe/mapf/global
    pub(super) fn write(self, engine: &Engine) -> Result<(), Error> {
        let (height, width) = self.padded(engine)?;
        let first = engine.config.radius - self.border;
        for (row, values) in self.obstacles.chunks_mut(self.size.1).enumerate() {
            let (map, padding) = values.split_at_mut(if row < height { width } else { 0 });
            engine.obstacles.read_row(first + row, first, map);
            padding.fill(1);
        }
        write_pairs(from_border(&engine.cells, self.border), self.cells);
        write_pairs(from_border(&engine.goals, self.border), self.goals);
        Ok(())
    }
}

/// Writes pairs of numbers into a list, and fills the rest with 0.
pub(super) fn write_pairs(pairs: impl Iterator<Item = [i32; 2]>, out: &mut [i64]) {
    let mut rest = out.chunks_exact_mut(2);
    for (pair, out) in pairs.zip(rest.by_ref()) {
        out[0] = pair[0].into();
        out[1] = pair[1].into();
    }
    rest.for_each(|padding| padding.fill(0));
}
