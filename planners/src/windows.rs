//! What agents see, as policies and meters want it.

use pogema_core::{Environment, Episode, Error, from_starts};

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
    pub cells: Vec<[i32; 2]>,
    /// Where each agent's goal is, counted from its start.
    ///
    /// Shape: `[agents, 2]`
    pub goals: Vec<[i32; 2]>,
}

impl Windows {
    /// The windows and positions of all agents.
    ///
    /// # Errors
    /// Before the start of the episode.
    pub fn of<E: Environment>(episode: &Episode<E>) -> Result<Self, Error> {
        let (config, starts) = (episode.config(), episode.instance()?.starts());
        let side = config.side();
        let mut values = vec![0.0; config.num_observed()];
        episode.engine().observe(&mut values)?;
        let channel =
            |index: usize| values.chunks(side * side).skip(index).step_by(3).flatten().copied().collect();
        let state = episode.state();
        Ok(Self {
            side,
            obstacles: channel(0),
            agents: channel(1),
            cells: from_starts(state.cells, starts).collect(),
            goals: from_starts(state.goals, starts).collect(),
        })
    }

    /// What each agent's A* is told.
    pub fn views(&self) -> impl Iterator<Item = View<'_>> {
        let obstacles = self.obstacles.chunks(self.side * self.side);
        let places = self.cells.iter().zip(&self.goals);
        obstacles.zip(places).map(|(obstacles, (&cell, &goal))| View {
            cell,
            goal,
            obstacles,
            side: self.side,
        })
    }
}
