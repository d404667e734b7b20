//! The observations of agents.

use pogema_core::Error;

use crate::Reference;
use crate::grid::{Grid, place};

impl Reference {
    /// Writes the `default` observation of all agents.
    ///
    /// Rule: observe/default, observe/default/agents, observe/default/inactive
    ///
    /// Source: POGEMA 1.4.0, `envs.py`, `PogemaBase._get_agents_obs`
    pub(crate) fn write_default(&self, out: &mut [f32]) -> Result<(), Error> {
        Error::check_length("observations", self.config.num_observed(), out.len())?;
        let area = self.config.side() * self.config.side();
        for (agent, channels) in out.chunks_mut(3 * area).enumerate() {
            self.write_window(&self.obstacles, agent, &mut channels[..area]);
            self.write_window(&self.occupied, agent, &mut channels[area..2 * area]);
            self.write_goal(agent, &mut channels[2 * area..]);
        }
        Ok(())
    }

    /// Writes the part of a grid around an agent, with the agent in the centre.
    ///
    /// Rule: observe/default/window
    fn write_window(&self, grid: &Grid, agent: usize, window: &mut [f32]) {
        let radius = self.config.radius as i32;
        let (row, col) = place(self.cells[agent]);
        let around = (-radius..=radius).flat_map(|down| (-radius..=radius).map(move |right| (down, right)));
        for (value, (down, right)) in window.iter_mut().zip(around) {
            *value = f32::from(u8::from(grid.get((row + down, col + right))));
        }
    }

    /// Writes a single 1 for the goal. A goal outside the window is clamped to its rim, each axis separately.
    ///
    /// Rule: observe/default/goal
    ///
    /// Source: POGEMA 1.4.0, `grid.py`, `Grid.get_square_target`
    fn write_goal(&self, agent: usize, window: &mut [f32]) {
        let radius = self.config.radius as i32;
        let (row, col) = place(self.cells[agent]);
        let (goal_row, goal_col) = place(self.goals[agent]);
        let down = (goal_row - row).clamp(-radius, radius) + radius;
        let right = (goal_col - col).clamp(-radius, radius) + radius;
        window.fill(0.0);
        window[down as usize * self.config.side() + right as usize] = 1.0;
    }

    /// Writes the map with its border.
    ///
    /// Rule: observe/mapf
    ///
    /// Source: POGEMA 1.4.0, `envs.py`, `Pogema._obs`
    pub(crate) fn write_map(&self, out: &mut [u8]) -> Result<(), Error> {
        let cells = || self.obstacles.rows().iter().flatten();
        Error::check_length("global obstacles", cells().count(), out.len())?;
        for (value, &obstacle) in out.iter_mut().zip(cells()) {
            *value = u8::from(obstacle);
        }
        Ok(())
    }
}
