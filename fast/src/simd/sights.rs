//! Where agents look, and where they see their goals.

use std::ops::Range;

use pogema_core::Cell;

use super::Scene;
use crate::grid::STRIDE;

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
    /// Rule: observe/default/goal
    #[allow(clippy::inline_always, reason = "so that each path compiles it with its own features")]
    #[inline(always)]
    pub fn of<const SIDE: usize>(scene: &Scene<'_>, agents: Range<usize>) -> Self {
        let (cells, goals) = (group(&scene.cells[agents.clone()]), group(&scene.goals[agents]));
        let num_rows = scene.obstacles.num_rows() as u32;
        let radius = SIDE as u16 / 2;
        // Without a sign, since places differ by more than one of 16 bits can say.
        let toward = |cell: u16, goal: u16| {
            radius + goal.saturating_sub(cell).min(radius) - cell.saturating_sub(goal).min(radius)
        };
        let mut sights = Self { first: [0; GROUP], shift: [0; GROUP], goal: [0; GROUP] };
        for index in 0..GROUP {
            let (cell, goal) = (cells[index], goals[index]);
            sights.first[index] = (u32::from(cell.col) / STRIDE as u32 + 1) * num_rows + u32::from(cell.row);
            sights.shift[index] = u32::from(cell.col) % STRIDE as u32;
            let (down, right) = (toward(cell.row, goal.row), toward(cell.col, goal.col));
            sights.goal[index] = 2 * (SIDE * SIDE) as u32 + u32::from(down) * SIDE as u32 + u32::from(right);
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
