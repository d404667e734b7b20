//! RePlan's A*, with the same order of steps as the authors' code.

use pogema_core::Action;

use crate::replan::place::{Place, distance, toward};
use crate::replan::reached::Reached;

/// The memory of searches.
///
/// Cells are expanded in the order of total cost, cost so far, row and column. A heap is not needed: a neighbour's cost
/// is larger by 1, and its total cost by 0 or 2. Therefore, all cells with the same total cost and the same cost are
/// known before the first of them is expanded.
#[derive(Clone, Debug, Default)]
pub(crate) struct Search {
    /// Cells of the present total cost that cells of smaller total costs generated, each with its cost.
    level: Vec<(u32, Node)>,
    /// The same for the next total cost.
    next_level: Vec<(u32, Node)>,
    /// Cells of the present total cost and cost.
    group: Vec<Node>,
    /// Cells of the present total cost and the next cost.
    next_group: Vec<Node>,
    reached: Reached,
}

/// A cell that a search has generated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Node {
    place: Place,
    /// The index of the first move of the path to the cell.
    first_move: u8,
}

/// A search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Query {
    pub start: Place,
    pub goal: Place,
    /// The order in which the neighbours of a cell are generated.
    pub moves: [Action; 4],
    /// Whether the cell nearest to the goal replaces the goal if the search finds no path.
    pub best_move: bool,
}

impl Search {
    /// The largest number of cells that a search expands.
    const MAX_EXPANSIONS: usize = 10_000;

    /// Returns the first cell of a path to the goal.
    ///
    /// A cell keeps the path that generated it first.
    pub fn first_step(&mut self, query: Query, is_blocked: impl Fn(Place) -> bool) -> Option<Place> {
        let (left, first_move) = self.nearest(query, is_blocked)?;
        (left == 0 || query.best_move).then(|| toward(query.start, query.moves[usize::from(first_move)]))
    }

    /// Returns the distance between the goal and the nearest expanded cell, and the first move to this cell; `None` if
    /// this cell is the start.
    fn nearest(&mut self, query: Query, is_blocked: impl Fn(Place) -> bool) -> Option<(u32, u8)> {
        let Query { start, goal, moves, .. } = query;
        let (mut best_left, mut best_first) = (distance(start, goal), None);
        let mut num_expansions_left = Self::MAX_EXPANSIONS;
        self.begin(start);
        'search: loop {
            self.level.sort_unstable();
            let (mut level, mut cost) = (self.level.iter().peekable(), 0);
            loop {
                if self.group.is_empty() {
                    let Some(&&(next, _)) = level.peek() else { break };
                    cost = next;
                }
                while let Some(&(_, node)) = level.next_if(|(other, _)| *other == cost) {
                    self.group.push(node);
                }
                self.group.sort_unstable();
                for node in self.group.drain(..) {
                    if num_expansions_left == 0 {
                        break 'search;
                    }
                    num_expansions_left -= 1;
                    let left = distance(node.place, goal);
                    if left < best_left {
                        (best_left, best_first) = (left, Some(node.first_move));
                    }
                    if left == 0 {
                        break 'search;
                    }
                    for (index, action) in (0..).zip(moves) {
                        let place = toward(node.place, action);
                        if self.reached.contains(place) || is_blocked(place) {
                            continue;
                        }
                        self.reached.insert(place);
                        let first_move = if node.place == start { index } else { node.first_move };
                        let node = Node { place, first_move };
                        if distance(place, goal) < left {
                            self.next_group.push(node);
                        } else {
                            self.next_level.push((cost + 1, node));
                        }
                    }
                }
                std::mem::swap(&mut self.group, &mut self.next_group);
                cost += 1;
            }
            if self.next_level.is_empty() {
                break;
            }
            self.level.clear();
            std::mem::swap(&mut self.level, &mut self.next_level);
        }
        best_first.map(|first_move| (best_left, first_move))
    }

    /// Begins a search, and forgets the previous one.
    fn begin(&mut self, start: Place) {
        self.level.clear();
        self.next_level.clear();
        self.group.clear();
        self.next_group.clear();
        self.reached.clear_around(start);
        self.reached.insert(start);
        self.group.push(Node { place: start, first_move: 0 });
    }
}
