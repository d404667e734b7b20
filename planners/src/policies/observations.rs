//! The `POMAPF` observations of all agents.

use pogema_core::{Environment, Episode, Error, from_starts};

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
    /// Shape: `[agents, side, side]`, nonzero for an obstacle.
    pub obstacles: Vec<f32>,
    /// Shape: `[agents, side, side]`, nonzero for an agent.
    pub agents: Vec<f32>,
    /// The cell of each agent, relative to its start.
    ///
    /// Shape: `[agents, 2]`
    pub cells: Vec<[i32; 2]>,
    /// The goal of each agent, relative to its start.
    ///
    /// Shape: `[agents, 2]`
    pub goals: Vec<[i32; 2]>,
}

impl PomapfObservations {
    /// Observes the agents of an episode.
    ///
    /// # Errors
    /// Before the start of the episode.
    pub fn of<E: Environment>(episode: &Episode<E>) -> Result<Self, Error> {
        let (config, starts) = (episode.config(), episode.instance()?.starts());
        let area = config.side() * config.side();
        let mut values = vec![0.0; config.num_observed()];
        episode.engine().observe(&mut values)?;
        let channel = |index: usize| values.chunks(area).skip(index).step_by(3).flatten().copied().collect();
        let state = episode.state();
        Ok(Self {
            side: config.side(),
            obstacles: channel(0),
            agents: channel(1),
            cells: from_starts(state.cells, starts).collect(),
            goals: from_starts(state.goals, starts).collect(),
        })
    }

    /// Returns the observation of each agent.
    pub fn each(&self) -> impl Iterator<Item = PomapfObservation<'_>> {
        let obstacles = self.obstacles.chunks(self.side * self.side);
        let places = self.cells.iter().zip(&self.goals);
        obstacles.zip(places).map(|(obstacles, (&cell, &goal))| PomapfObservation {
            cell,
            goal,
            obstacles,
            side: self.side,
        })
    }
}
