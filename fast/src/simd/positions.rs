//! The positions of windows in the strips, and of goals in the records.

use std::ops::Range;

use pogema_core::Cell;

use super::WindowSource;

/// Number of agents whose positions are computed at a time.
pub const GROUP: usize = 16;

/// The positions of the windows and goals of a group of agents.
pub struct WindowPositions {
    /// The word of the window's first row in the strips.
    pub first: [u32; GROUP],
    /// The shift that moves the window's first column to bit 0.
    pub shift: [u32; GROUP],
    /// The bit of the goal in the agent's record.
    pub goal: [u32; GROUP],
}

impl WindowPositions {
    /// Computes the positions of at most [`GROUP`] agents, whose windows have side `SIDE`.
    #[allow(clippy::inline_always, reason = "so that each path compiles it with its own features")]
    #[inline(always)]
    pub fn of<const SIDE: usize>(source: &WindowSource<'_>, agents: Range<usize>) -> Self {
        let (cells, goals) = (group(&source.cells[agents.clone()]), group(&source.goals[agents]));
        let mut positions = Self { first: [0; GROUP], shift: [0; GROUP], goal: [0; GROUP] };
        for (index, (&cell, &goal)) in cells.iter().zip(&goals).enumerate() {
            let (first, shift) = source.obstacles.locate(usize::from(cell.row), usize::from(cell.col));
            (positions.first[index], positions.shift[index]) = (first as u32, shift);
            positions.goal[index] = (2 * SIDE * SIDE + WindowSource::goal_index(cell, goal, SIDE)) as u32;
        }
        positions
    }
}

/// Returns a whole group, padded with an arbitrary cell.
#[inline]
fn group(cells: &[Cell]) -> [Cell; GROUP] {
    <[Cell; GROUP]>::try_from(cells).unwrap_or_else(|_| {
        let mut group = [Cell::new(0, 0); GROUP];
        group[..cells.len()].copy_from_slice(cells);
        group
    })
}
