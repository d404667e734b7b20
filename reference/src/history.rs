//! Steps kept, and taken back.

use pogema_core::{Error, Snapshot};

use crate::Reference;
use crate::grid::place;

impl Reference {
    /// All states since the reset, if the config keeps them.
    ///
    /// Rule: history/changes
    pub fn past(&self) -> &[Snapshot] {
        &self.past
    }

    pub(crate) fn remember(&mut self) {
        if self.config.persistent {
            self.past.push(pogema_core::Environment::snapshot(self));
        }
    }

    /// Restores the state before the last step: cells, goals, active agents, occupancy and the time. What was
    /// drawn stays drawn, so playing the step again can lead to other goals.
    ///
    /// Rule: history/step-back
    ///
    /// Source: POGEMA 1.4.0, `wrappers/persistence.py`, `PersistentWrapper.step_back`
    pub(crate) fn take_back(&mut self) -> Result<bool, Error> {
        if !self.config.persistent {
            return Err(Error::State { reason: "steps are only kept with persistent: true".into() });
        }
        if self.past.len() < 2 {
            return Ok(false);
        }
        self.past.pop();
        let Some(before) = self.past.last().cloned() else { return Ok(false) };
        for cell in self.snapshot_occupied() {
            self.occupied.set(cell, false);
        }
        for &cell in &before.occupied {
            self.occupied.set(place(cell), true);
        }
        self.step = before.step;
        self.cells = before.cells;
        self.goals = before.goals;
        self.active = before.active;
        Ok(true)
    }

    fn snapshot_occupied(&self) -> Vec<(i32, i32)> {
        pogema_core::Environment::snapshot(self).occupied.into_iter().map(place).collect()
    }
}
