//! Paths drawn into windows.

use crate::encode::costs::{NO_COST, ToGoal};
use crate::grid::Layout;

/// Writes 1 to the cells of a path. Stops before the first cell that is farther than `cut` from the centre.
///
/// The path begins with the place in the centre of the window. Cells within `cut` but outside the window are skipped.
pub(crate) fn draw_path(
    layout: Layout,
    path: impl IntoIterator<Item = usize>,
    cut: usize,
    window: &mut [f32],
) {
    let side = window.len().isqrt();
    let (radius, cut) = ((side / 2) as isize, cut as isize);
    let (mut row, mut col, mut last) = (0_isize, 0_isize, None);
    for place in path {
        match place as isize - last.unwrap_or(place) as isize {
            0 => {}
            1 => col += 1,
            -1 => col -= 1,
            down if down > 0 => row += 1,
            _ => row -= 1,
        }
        debug_assert!(last.is_none_or(|last| [1, layout.stride()].contains(&place.abs_diff(last))));
        last = Some(place);
        if row.abs().max(col.abs()) > cut {
            return;
        }
        if row.abs().max(col.abs()) <= radius {
            window[((row + radius) * side as isize + col + radius) as usize] = 1.0;
        }
    }
}

/// Returns the places of a shortest path from a place to the goal, both included; nothing if there is no path.
///
/// Of several shortest paths, it takes the first in the order of the actions up, down, left, right at each cell.
pub(crate) fn shortest_path(
    layout: Layout,
    costs: &ToGoal,
    place: usize,
) -> impl Iterator<Item = usize> + '_ {
    let start = (costs.grid.at(place) != NO_COST).then_some(place);
    std::iter::successors(start, move |&place| {
        let nearer = costs.grid.at(place) - 1;
        let neighbours = [place - layout.stride(), place + layout.stride(), place - 1, place + 1];
        // On the goal, `nearer` equals the entry of an obstacle.
        neighbours.into_iter().find(|&next| nearer != NO_COST && costs.grid.at(next) == nearer)
    })
}
