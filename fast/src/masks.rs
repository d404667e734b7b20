//! Action masks.

use std::sync::atomic::Ordering::Relaxed;

use pogema_core::{Action, Error};

use crate::Engine;
use crate::grid::OBSTACLE;

impl Engine {
    /// Writes 1 for each action that no obstacle prevents, otherwise 0.
    ///
    /// Staying is always allowed. A move is allowed if its target is on the map and holds no obstacle, even if another
    /// agent stands there. Inactive agents may only stay.
    ///
    /// Shape: `[agents, 5]`
    ///
    /// # Errors
    /// Before the first reset, or for a buffer of the wrong length.
    pub fn mask_actions(&self, out: &mut [i8]) -> Result<(), Error> {
        self.check_started()?;
        Error::check_length("action masks", self.cells.len() * Action::ALL.len(), out.len())?;
        let offsets = self.board.offsets();
        for ((mask, &cell), &active) in out.chunks_exact_mut(offsets.len()).zip(&self.cells).zip(&self.active)
        {
            let place = self.board.place(cell);
            for (allowed, offset) in mask.iter_mut().zip(offsets) {
                let square = self.board.square(place.wrapping_add(offset));
                *allowed = i8::from(active && square.agent.load(Relaxed) != OBSTACLE);
            }
            mask[0] = 1;
        }
        Ok(())
    }
}
