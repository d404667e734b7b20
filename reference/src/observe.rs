//! What agents see.

use pogema_core::{Cell, Error, MapfOut, PomapfOut};

use crate::Reference;
use crate::grid::{Grid, place};

impl Reference {
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

    /// The part of a grid around an agent, the agent in its centre.
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

    /// A single 1 where the goal is, or on the rim towards it, each axis clamped by itself.
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

    /// Rule: observe/pomapf, observe/pomapf/relative
    ///
    /// Source: POGEMA 1.4.0, `envs.py`, `Pogema._pomapf_obs`
    pub(crate) fn write_pomapf(&self, out: PomapfOut<'_>) -> Result<(), Error> {
        let area = self.config.side() * self.config.side();
        let num_agents = self.config.num_agents;
        Error::check_length("obstacles", num_agents * area, out.obstacles.len())?;
        Error::check_length("agents", num_agents * area, out.agents.len())?;
        Error::check_length("cells", 2 * num_agents, out.cells.len())?;
        Error::check_length("goals", 2 * num_agents, out.goals.len())?;
        for agent in 0..num_agents {
            self.write_window(&self.obstacles, agent, &mut out.obstacles[agent * area..][..area]);
            self.write_window(&self.occupied, agent, &mut out.agents[agent * area..][..area]);
            let (row, col) = place(self.starts[agent]);
            write_place(&mut out.cells[2 * agent..], self.cells[agent], (-row, -col));
            write_place(&mut out.goals[2 * agent..], self.goals[agent], (-row, -col));
        }
        Ok(())
    }

    /// Rule: observe/mapf, observe/mapf/global
    ///
    /// Source: POGEMA 1.4.0, `envs.py`, `Pogema._obs`
    pub(crate) fn write_mapf(&self, out: MapfOut<'_>) -> Result<(), Error> {
        let rows = self.obstacles.rows();
        let num_agents = self.config.num_agents;
        Error::check_length("global obstacles", rows.iter().map(Vec::len).sum(), out.obstacles.len())?;
        Error::check_length("global cells", 2 * num_agents, out.cells.len())?;
        Error::check_length("global goals", 2 * num_agents, out.goals.len())?;
        for (value, &obstacle) in out.obstacles.iter_mut().zip(rows.iter().flatten()) {
            *value = u8::from(obstacle);
        }
        let border = self.config.radius as i32;
        for agent in 0..num_agents {
            write_place(&mut out.cells[2 * agent..], self.cells[agent], (border, border));
            write_place(&mut out.goals[2 * agent..], self.goals[agent], (border, border));
        }
        Ok(())
    }
}

fn write_place(out: &mut [i32], cell: Cell, (down, right): (i32, i32)) {
    let (row, col) = place(cell);
    out[0] = row + down;
    out[1] = col + right;
}
