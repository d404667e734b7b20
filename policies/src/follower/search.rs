//! Follower's A*, with the same steps as the authors' code.
//!
//! Its heuristic is neither admissible nor consistent, so the path depends on the order of the search.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use pogema_planners::HeapQ;

use crate::follower::entry::Entry;

/// The cost of entering an obstacle. No path costs that much.
pub(crate) const OBSTACLE: f32 = f32::INFINITY;

/// The cost of a place that the search has not reached.
const UNREACHED: f32 = 1e9;

/// The memory of searches on a padded grid.
#[derive(Clone, Debug)]
pub(crate) struct Search {
    stride: usize,
    nodes: Vec<Node>,
    heap: HeapQ<Entry>,
    /// Number of the search; a node of an earlier one counts as unreached.
    now: u32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Node {
    g: f32,
    parent: u32,
    search: u32,
}

impl Search {
    /// Creates the memory for a grid of `len` places.
    pub fn new(len: usize, stride: usize) -> Self {
        Self { stride, nodes: vec![Node::default(); len], heap: HeapQ::default(), now: 0 }
    }

    /// Writes the path from start to goal, both included; nothing if there is no path or the start is the goal.
    ///
    /// `costs` holds the cost of entering each place. The margin of the grid consists of obstacles.
    pub fn find(&mut self, start: usize, goal: usize, costs: &[f32], heuristic: &[f32], path: &mut Vec<u32>) {
        path.clear();
        if start == goal || !self.reaches(start as u32, goal as u32, costs, heuristic) {
            return;
        }
        let mut place = goal as u32;
        path.push(place);
        while place != start as u32 {
            place = self.nodes[place as usize].parent;
            path.push(place);
        }
        path.reverse();
    }

    /// Searches until the goal is popped from the heap, and returns whether it was reached.
    fn reaches(&mut self, start: u32, goal: u32, costs: &[f32], heuristic: &[f32]) -> bool {
        self.begin();
        // As in the authors' code, the start has no cost yet, so its neighbours add it again. The additional element
        // can change the order of equal elements, and thus the path.
        self.heap.push(Entry { place: start, g: 0.0, f: heuristic[start as usize] });
        while let Some(entry) = self.heap.pop() {
            if entry.place == goal {
                // Expanding the goal would not change its path.
                return true;
            }
            if self.cost(entry.place as usize) < entry.g {
                continue;
            }
            let place = entry.place as usize;
            // Right, down, up, left.
            for next in [place + 1, place + self.stride, place - self.stride, place - 1] {
                let g = entry.g + costs[next];
                if self.cost(next) > g {
                    self.nodes[next] = Node { g, parent: entry.place, search: self.now };
                    self.heap.push(Entry { place: next as u32, g, f: g + heuristic[next] });
                }
            }
        }
        false
    }

    fn begin(&mut self) {
        self.heap.clear();
        self.now = self.now.wrapping_add(1);
        if self.now == 0 {
            self.nodes.fill(Node::default());
            self.now = 1;
        }
    }

    fn cost(&self, place: usize) -> f32 {
        let node = self.nodes[place];
        if node.search == self.now { node.g } else { UNREACHED }
    }
}

/// Returns the heuristic: the least sum of static costs from the goal outwards, [`OBSTACLE`] where there is no path.
///
/// A sum contains the cost of its place, but not that of the goal. The sums of `f32` only grow along a path, so the
/// least sum does not depend on the order of the search.
pub(crate) fn heuristic(goal: usize, costs: &[f32], stride: usize) -> Vec<f32> {
    let mut sums = vec![OBSTACLE; costs.len()];
    if costs[goal] == OBSTACLE {
        return sums;
    }
    sums[goal] = 0.0;
    // The bits of positive floats have the order of their values.
    let mut queue = BinaryHeap::from([Reverse((0_u32, goal as u32))]);
    while let Some(Reverse((bits, place))) = queue.pop() {
        let (sum, place) = (f32::from_bits(bits), place as usize);
        if sum > sums[place] {
            continue;
        }
        for next in [place + 1, place + stride, place - stride, place - 1] {
            let longer = sum + costs[next];
            if longer < sums[next] {
                sums[next] = longer;
                queue.push(Reverse((longer.to_bits(), next as u32)));
            }
        }
    }
    sums
}
