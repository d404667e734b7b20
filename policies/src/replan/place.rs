//! Cells of an unbounded grid.

use pogema_core::Action;

/// A cell of an unbounded grid: (row, column).
pub(crate) type Place = (i32, i32);

/// Returns the next cell in the direction of an action.
pub(crate) fn toward((row, col): Place, action: Action) -> Place {
    let (down, right) = action.delta();
    (row + down, col + right)
}

/// Returns the Manhattan distance.
pub(crate) fn distance((row, col): Place, (goal_row, goal_col): Place) -> u32 {
    row.abs_diff(goal_row) + col.abs_diff(goal_col)
}
