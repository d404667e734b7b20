//! What agents see, as policies and meters want it.

use pogema_core::{Environment, Error, PomapfOut};

use crate::astar::View;

/// The arrays of the `POMAPF` observation.
#[derive(Clone, Debug)]
pub struct Windows {
    side: usize,
    /// Shape: `[agents, side, side]`, not 0 for an obstacle.
    pub obstacles: Vec<f32>,
    /// Shape: `[agents, side, side]`, not 0 for an agent.
    pub agents: Vec<f32>,
    /// Where each agent is, counted from its start.
    ///
    /// Shape: `[agents, 2]`
    pub cells: Vec<i32>,
    /// Where each agent's goal is, counted from its start.
    ///
    /// Shape: `[agents, 2]`
    pub goals: Vec<i32>,
}

impl Windows {
    /// Looks through the eyes of all agents.
    ///
    /// # Errors
    /// Before the first reset.
    pub fn of(environment: &dyn Environment) -> Result<Self, Error> {
        let config = environment.config();
        let (num_agents, side) = (config.num_agents, config.side());
        let mut windows = Self {
            side,
            obstacles: vec![0.0; num_agents * side * side],
            agents: vec![0.0; num_agents * side * side],
            cells: vec![0; 2 * num_agents],
            goals: vec![0; 2 * num_agents],
        };
        environment.observe_pomapf(PomapfOut {
            obstacles: &mut windows.obstacles,
            agents: &mut windows.agents,
            cells: &mut windows.cells,
            goals: &mut windows.goals,
        })?;
        Ok(windows)
    }

    /// What each agent's A* is told.
    pub fn views(&self) -> impl Iterator<Item = View<'_>> {
        let obstacles = self.obstacles.chunks(self.side * self.side);
        let places = pairs(&self.cells).into_iter().zip(pairs(&self.goals));
        obstacles.zip(places).map(|(obstacles, (cell, goal))| View { cell, goal, obstacles, side: self.side })
    }

    /// For each agent how many agents and how many free cells it sees.
    pub fn counts(&self) -> Vec<(u32, u32)> {
        let area = self.side * self.side;
        let count =
            |window: &[f32], wanted: bool| window.iter().filter(|&&value| (value != 0.0) == wanted).count();
        let agents = self.agents.chunks(area).map(|window| count(window, true) as u32);
        let free = self.obstacles.chunks(area).map(|window| count(window, false) as u32);
        agents.zip(free).collect()
    }
}

/// Values two by two.
pub fn pairs(values: &[i32]) -> Vec<[i32; 2]> {
    values.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect()
}
