//! Returning to an earlier state.

use pogema_core::{Environment, Snapshot};

use crate::Reference;
use crate::grid::place;

impl Reference {
    /// Restores cells, goals, active agents, occupancy and time, but neither the goal streams nor `on_goal`.
    ///
    /// Rule: history/step-back
    ///
    /// Source: POGEMA 1.4.0, `wrappers/persistence.py`, `PersistentWrapper.step_back`
    pub(crate) fn return_to(&mut self, step: u64, state: &Snapshot) {
        for cell in self.occupied() {
            self.occupied.set(place(cell), false);
        }
        for &cell in &state.occupied {
            self.occupied.set(place(cell), true);
        }
        self.step = step;
        self.cells.clone_from(&state.cells);
        self.goals.clone_from(&state.goals);
        self.active.clone_from(&state.active);
    }
}
