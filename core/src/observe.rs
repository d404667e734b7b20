//! The positions in `POMAPF` and `MAPF` observations, shared by all engines.

use crate::Cell;

/// Returns cells relative to the start of each agent, as (row, col).
///
/// Shape: `[agents, 2]`
///
/// Rule: observe/pomapf, observe/pomapf/relative
///
/// Source: POGEMA 1.4.0, `envs.py`, `Pogema._pomapf_obs`
pub fn from_starts<'a>(cells: &'a [Cell], starts: &'a [Cell]) -> impl Iterator<Item = [i32; 2]> + 'a {
    let pairs = cells.iter().zip(starts);
    pairs.map(|(cell, start)| {
        [i32::from(cell.row) - i32::from(start.row), i32::from(cell.col) - i32::from(start.col)]
    })
}

/// Returns cells relative to the top left corner of the border, as (row, col).
///
/// Shape: `[agents, 2]`
///
/// Rule: observe/mapf, observe/mapf/global
///
/// Source: POGEMA 1.4.0, `envs.py`, `Pogema._obs`
pub fn from_border(cells: &[Cell], radius: usize) -> impl Iterator<Item = [i32; 2]> + '_ {
    cells.iter().map(move |cell| [i32::from(cell.row) + radius as i32, i32::from(cell.col) + radius as i32])
}
