//! The `POMAPF` observations of all agents.

use pogema_core::{Environment, Error, PomapfOut};

/// The part of the `POMAPF` observation of one agent that the A* policy reads.
///
/// Rule: observe/pomapf
#[derive(Clone, Copy, Debug)]
pub struct PomapfObservation<'a> {
    /// The cell of the agent, relative to its start.
    pub cell: [i32; 2],
    /// The goal of the agent, relative to its start.
    pub goal: [i32; 2],
    /// Shape: `[side, side]`, nonzero for an obstacle.
    pub obstacles: &'a [f32],
    /// The side of the observation window. Units: cells.
    pub side: usize,
}

/// The arrays of the `POMAPF` observations of all agents.
#[derive(Clone, Debug)]
pub struct PomapfObservations {
    side: usize,
    /// Shape: `[agents, side, side]`, not 0 for an obstacle.
    pub obstacles: Vec<f32>,
    /// Shape: `[agents, side, side]`, not 0 for an agent.
    pub agents: Vec<f32>,
    /// The cell of each agent, relative to its start.
    ///
    /// Shape: `[agents, 2]`
    pub cells: Vec<i32>,
    /// The goal of each agent, relative to its start.
    ///
    /// Shape: `[agents, 2]`
    pub goals: Vec<i32>,
}

impl PomapfObservations {
    /// Observes an environment.
    ///
    /// # Errors
    /// Before the first reset.
    pub fn of(environment: &dyn Environment) -> Result<Self, Error> {
        let config = environment.config();
        let (num_agents, side) = (config.num_agents, config.side());
        let mut observations = Self {
            side,
            obstacles: vec![0.0; num_agents * side * side],
            agents: vec![0.0; num_agents * side * side],
            cells: vec![0; 2 * num_agents],
            goals: vec![0; 2 * num_agents],
        };
        environment.observe_pomapf(PomapfOut {
            obstacles: &mut observations.obstacles,
            agents: &mut observations.agents,
            cells: &mut observations.cells,
            goals: &mut observations.goals,
        })?;
        Ok(observations)
    }

    /// Returns the observation of each agent.
    pub fn each(&self) -> impl Iterator<Item = PomapfObservation<'_>> {
        let obstacles = self.obstacles.chunks(self.side * self.side);
        let places = pairs(&self.cells).into_iter().zip(pairs(&self.goals));
        obstacles.zip(places).map(|(obstacles, (cell, goal))| PomapfObservation {
            cell,
            goal,
            obstacles,
            side: self.side,
        })
    }

    /// Returns, for each agent, the numbers of agents and of free cells in its window.
    pub fn counts(&self) -> Vec<(u32, u32)> {
        let area = self.side * self.side;
        let count =
            |window: &[f32], wanted: bool| window.iter().filter(|&&value| (value != 0.0) == wanted).count();
        let agents = self.agents.chunks(area).map(|window| count(window, true) as u32);
        let free = self.obstacles.chunks(area).map(|window| count(window, false) as u32);
        agents.zip(free).collect()
    }
}

/// Groups values into pairs.
pub fn pairs(values: &[i32]) -> Vec<[i32; 2]> {
    values.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect()
}
