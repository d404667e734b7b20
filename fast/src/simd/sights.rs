//! Where agents look, and where they see their goals.

use std::ops::Range;

use pogema_core::Cell;

use super::WindowSource;

/// Agents whose sights are found at a time.
pub const GROUP: usize = 16;

/// Where some agents look, found for all of them at once.
pub struct Sights {
    /// The first row of the window in the strips.
    pub first: [u32; GROUP],
    /// How far its columns are from bit 0.
    pub shift: [u32; GROUP],
    /// The bit of the goal in the record.
    pub goal: [u32; GROUP],
}

impl Sights {
    #[allow(clippy::inline_always, reason = "so that each path compiles it with its own features")]
    #[inline(always)]
    pub fn of<const SIDE: usize>(scene: &WindowSource<'_>, agents: Range<usize>) -> Self {
        let (cells, goals) = (group(&scene.cells[agents.clone()]), group(&scene.goals[agents]));
        let mut sights = Self { first: [0; GROUP], shift: [0; GROUP], goal: [0; GROUP] };
        for (index, (&cell, &goal)) in cells.iter().zip(&goals).enumerate() {
            let (first, shift) = scene.obstacles.locate(usize::from(cell.row), usize::from(cell.col));
            (sights.first[index], sights.shift[index]) = (first as u32, shift);
            sights.goal[index] = (2 * SIDE * SIDE + WindowSource::goal_index(cell, goal, SIDE)) as u32;
        }
        sights
    }
}

/// A whole group, filled up with any cell.
#[inline]
fn group(cells: &[Cell]) -> [Cell; GROUP] {
    <[Cell; GROUP]>::try_from(cells).unwrap_or_else(|_| {
        let mut group = [Cell::new(0, 0); GROUP];
        group[..cells.len()].copy_from_slice(cells);
        group
    })
}
