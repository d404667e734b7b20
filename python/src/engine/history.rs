//! Undoing steps, the number of elapsed steps, and the history of the agents.

use pogema_core::{Environment, Error, LARGEST_STEP, Snapshot};

use super::Inner;

/// A change of an agent: its row and column, the row and column of its goal, the step, whether it is active, and
/// whether its goal was drawn.
pub type Change = (u16, u16, u16, u16, u64, bool, bool);

impl Inner {
    /// Takes the last step back and returns whether there was one.
    pub(super) fn step_back(&mut self) -> Result<bool, Error> {
        let past = self.episode.past();
        let last_two = past[past.len().saturating_sub(2)..].to_vec();
        let went_back = self.episode.step_back()?;
        if went_back {
            self.drawn.take_back(&last_two);
            self.executed.clear();
        }
        Ok(went_back)
    }

    /// Sets the number of steps that count towards the time limit so far; a reset sets it to 0.
    pub(super) fn set_elapsed(&mut self, elapsed: u64) -> Result<(), Error> {
        if self.episode.instance().is_err() {
            return Ok(());
        }
        let state = self.episode.snapshot();
        // No episode has more than half of `LARGEST_STEP` steps. The limit keeps the later steps of this one within
        // `LARGEST_STEP`, the largest step that a saved state may hold.
        self.episode.engine_mut().restore(elapsed.min(LARGEST_STEP / 2), &state)
    }

    /// Returns for each agent its first state and each later state that differs from the one before.
    ///
    /// Reads the states that a persistent episode keeps, or else those of the recording; without either, the result is
    /// empty.
    pub(super) fn history(&self) -> Vec<Vec<Change>> {
        let recorded = || -> Vec<Snapshot> {
            let recording = self.episode.recording();
            let states = |recording: &pogema_core::Recording| {
                let later = recording.steps.iter().map(|step| step.state.clone());
                std::iter::once(recording.start.clone()).chain(later).collect()
            };
            recording.map(states).unwrap_or_default()
        };
        let changes = match self.episode.past() {
            [] => pogema_core::changes(&recorded()),
            past => pogema_core::changes(past),
        };
        let of_agent = |(agent, changes): (usize, Vec<pogema_core::Change>)| {
            let is_drawn = self.drawn.kept(agent).iter().chain(std::iter::repeat(&false));
            let change = |(change, &is_drawn): (pogema_core::Change, &bool)| {
                let pogema_core::Change { cell, goal, step, active } = change;
                (cell.row, cell.col, goal.row, goal.col, step, active, is_drawn)
            };
            changes.into_iter().zip(is_drawn).map(change).collect()
        };
        changes.into_iter().enumerate().map(of_agent).collect()
    }
}
