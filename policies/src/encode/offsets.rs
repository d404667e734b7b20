//! Positions and goals as scalars, and the goal as a window.

use pogema_core::Cell;

use crate::encode::words::Scalars;

/// Returns the offset from one cell to another, (rows, columns).
pub(crate) fn offset(from: Cell, to: Cell) -> (isize, isize) {
    (to.row as isize - from.row as isize, to.col as isize - from.col as isize)
}

/// Returns the two values of one kind.
pub(crate) fn scalars(kind: Scalars, start: Cell, cell: Cell, goal: Cell) -> [f32; Scalars::LEN] {
    let scaled = |(rows, cols)| [rows, cols].map(|x: isize| x as f32 / x.unsigned_abs().max(64) as f32);
    match kind {
        Scalars::Position => scaled(offset(start, cell)),
        Scalars::GoalPosition => scaled(offset(start, goal)),
        Scalars::GoalOffset => scaled(offset(cell, goal)),
        Scalars::GoalDirection => {
            let (rows, cols) = offset(cell, goal);
            let length = ((rows * rows + cols * cols) as f32).sqrt().max(1.0);
            [rows as f32 / length, cols as f32 / length]
        }
    }
}

/// Marks the goal, or if it is outside the window, the nearest cell of the window.
///
/// Rule: observe/default/goal
pub(crate) fn write_goal(cell: Cell, goal: Cell, out: &mut [f32]) {
    let side = out.len().isqrt();
    let radius = (side / 2) as isize;
    let (rows, cols) = offset(cell, goal);
    let place = |x: isize| (x.clamp(-radius, radius) + radius) as usize;
    out[place(rows) * side + place(cols)] = 1.0;
}
