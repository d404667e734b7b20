//! Steps kept, and taken back.

use pogema_core::{Environment, Error, Snapshot};

use crate::Engine;

impl Engine {
    /// All states since the reset, if the config keeps them.
    ///
    /// Rule: history/changes
    pub fn past(&self) -> &[Snapshot] {
        &self.past
    }

    pub(crate) fn remember(&mut self) {
        if self.config.persistent {
            self.past.push(self.snapshot());
        }
    }

    /// Rule: history/step-back
    pub(crate) fn take_back(&mut self) -> Result<bool, Error> {
        if !self.config.persistent {
            return Err(Error::State { reason: "steps are only kept with persistent: true".into() });
        }
        if self.past.len() < 2 {
            return Ok(false);
        }
        self.past.pop();
        let Some(before) = self.past.last().cloned() else { return Ok(false) };
        for agent in 0..self.cells.len() {
            self.vacate(self.board.place(self.cells[agent]), agent as u32, false);
        }
        self.occupied.clear_all();
        for &cell in &before.occupied {
            self.mark(cell);
        }
        self.step = before.step;
        self.cells = before.cells;
        self.goals = before.goals;
        self.active = before.active;
        self.take_squares();
        Ok(true)
    }
}
