//! Returning to an earlier state or to a saved state.

use pogema_core::{Environment, Error, GoalStream, Instance, Snapshot};

use crate::Engine;

impl Engine {
    /// Continues an episode at a saved state, `step` steps after the reset. `streams` holds the saved goal streams.
    ///
    /// # Errors
    /// If the state does not fit the instance, or the instance does not fit the config.
    pub fn resume(
        &mut self,
        instance: &Instance,
        streams: Vec<GoalStream>,
        step: u64,
        state: &Snapshot,
    ) -> Result<(), Error> {
        instance.check_fits(&self.config)?;
        let size = (instance.map().height(), instance.map().width());
        state.check_fits(self.config.num_agents, size)?;
        if streams.len() != instance.goals().len() {
            return Err(Error::ForeignState);
        }
        self.reset(instance)?;
        self.set_streams(streams)?;
        self.on_goal.clone_from(&state.on_goal);
        self.num_on_goal = self.on_goal.iter().filter(|&&on_goal| on_goal).count();
        self.return_to(step, state)
    }

    /// Replaces the goal stream of each agent; the current goals stay.
    ///
    /// # Errors
    /// [`Error::Length`] if `streams` does not have one stream per agent.
    pub fn set_streams(&mut self, streams: Vec<GoalStream>) -> Result<(), Error> {
        Error::check_length("streams", self.streams.len(), streams.len())?;
        self.streams = streams;
        Ok(())
    }

    /// Restores cells, goals, active agents, occupancy and time, but neither the goal streams nor `on_goal`.
    ///
    /// Rule: history/step-back
    pub(crate) fn return_to(&mut self, step: u64, state: &Snapshot) -> Result<(), Error> {
        state.check_fits(self.config.num_agents, self.size())?;
        for agent in 0..self.cells.len() {
            self.vacate(self.board.place(self.cells[agent]), agent as u32);
        }
        self.occupied.clear_all();
        for &cell in &state.occupied {
            self.mark(cell);
        }
        self.step = step;
        self.cells.clone_from(&state.cells);
        self.goals.clone_from(&state.goals);
        self.active.clone_from(&state.active);
        self.place_agents();
        Ok(())
    }
}
