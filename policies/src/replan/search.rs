//! RePlan's A*, with the same order of steps as the authors' code.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use pogema_core::Action;
use rustc_hash::FxHashMap;

/// A cell of an unbounded grid: (row, column).
pub(crate) type Place = (i32, i32);

/// The memory of searches.
#[derive(Clone, Debug, Default)]
pub(crate) struct Search {
    /// Cells to expand: total cost, cost so far, cell. Equal costs follow the rows and columns.
    heap: BinaryHeap<Reverse<(u32, u32, Place)>>,
    /// For each generated cell, the cell from which it was generated. The start is its own.
    parents: FxHashMap<Place, Place>,
}

/// A search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Query {
    pub start: Place,
    pub goal: Place,
    /// The order in which the neighbours of a cell are generated.
    pub moves: [Action; 4],
    /// Whether the cell nearest to the goal replaces a goal without a path.
    pub best_move: bool,
}

impl Search {
    /// The largest number of cells that a search expands.
    const MAX_EXPANSIONS: usize = 10_000;

    /// Returns the first cell of a path to the goal.
    ///
    /// A cell keeps the parent that generated it first, so the path is not always the shortest.
    pub fn first_step(&mut self, query: Query, is_blocked: impl Fn(Place) -> bool) -> Option<Place> {
        let Query { start, goal, moves, best_move } = query;
        self.heap.clear();
        self.parents.clear();
        self.parents.insert(start, start);
        self.heap.push(Reverse((distance(start, goal), 0, start)));
        let mut best = (distance(start, goal), start);
        for _ in 0..Self::MAX_EXPANSIONS {
            let Some(Reverse((_, cost, place))) = self.heap.pop() else { break };
            let left = distance(place, goal);
            if left < best.0 {
                best = (left, place);
            }
            if left == 0 {
                break;
            }
            for action in moves {
                let next = toward(place, action);
                if !self.parents.contains_key(&next) && !is_blocked(next) {
                    self.parents.insert(next, place);
                    self.heap.push(Reverse((cost + 1 + distance(next, goal), cost + 1, next)));
                }
            }
        }
        let (left, end) = best;
        ((left == 0 || best_move) && end != start).then(|| self.after_start(start, end))
    }

    /// Returns the first cell after the start on the path to another cell.
    fn after_start(&self, start: Place, end: Place) -> Place {
        let mut place = end;
        while self.parents[&place] != start {
            place = self.parents[&place];
        }
        place
    }
}

/// Returns the next cell in the direction of an action.
pub(crate) fn toward((row, col): Place, action: Action) -> Place {
    let (down, right) = action.delta();
    (row + down, col + right)
}

fn distance((row, col): Place, (goal_row, goal_col): Place) -> u32 {
    row.abs_diff(goal_row) + col.abs_diff(goal_col)
}
