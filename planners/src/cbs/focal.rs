//! The queues of ECBS.

use std::collections::BTreeSet;

use crate::cbs::memory::MemoryUse;
use crate::cbs::node::Node;
use crate::conflicts::all_conflicts;
use crate::paths::PathConflict;

/// A node of the constraint tree in the queue.
pub(super) struct Entry {
    pub node: Node,
    num_conflicts: usize,
    /// The first conflict.
    pub conflict: Option<PathConflict>,
}

/// The open list, and its nodes within the suboptimality bound ordered by conflicts.
pub(super) struct FocalQueue {
    weight: f64,
    num_vertices: usize,
    pub memory: MemoryUse,
    entries: Vec<Option<Entry>>,
    /// All nodes, ordered by lower bound.
    open: BTreeSet<(u64, usize)>,
    /// Nodes within the bound, ordered by conflicts, cost and age, newest first.
    focal: BTreeSet<(usize, u64, std::cmp::Reverse<usize>)>,
    /// Nodes that are not yet known to be within the bound, ordered by cost.
    beyond: BTreeSet<(u64, usize)>,
}

impl FocalQueue {
    /// Creates an empty queue.
    pub fn new(weight: f64, num_vertices: usize, memory: MemoryUse) -> Self {
        Self {
            weight,
            num_vertices,
            memory,
            entries: Vec::new(),
            open: BTreeSet::new(),
            focal: BTreeSet::new(),
            beyond: BTreeSet::new(),
        }
    }

    /// Inserts a node.
    pub fn insert(&mut self, node: Node) {
        let conflicts = all_conflicts(&node.paths, self.num_vertices);
        let conflict = conflicts.first().copied();
        let number = self.entries.len();
        self.memory.add_node(&node);
        self.memory.add(size_of::<Option<Entry>>());
        self.open.insert((node.lower_bound(), number));
        self.beyond.insert((node.paths.total_cost(), number));
        self.entries.push(Some(Entry { node, num_conflicts: conflicts.len(), conflict }));
    }

    /// Takes the node within the bound that has the fewest conflicts; also returns the lower bound.
    pub fn pop(&mut self) -> Option<(Entry, u64)> {
        let &(lower_bound, _) = self.open.first()?;
        let is_within = |cost: u64| is_within(cost, lower_bound, self.weight);
        while let Some(&(cost, number)) = self.beyond.first().filter(|&&(cost, _)| is_within(cost)) {
            self.beyond.pop_first();
            let num_conflicts = self.entries[number].as_ref()?.num_conflicts;
            self.focal.insert((num_conflicts, cost, std::cmp::Reverse(number)));
        }
        let (_, _, std::cmp::Reverse(number)) = self.focal.pop_first()?;
        let entry = self.entries[number].take()?;
        self.open.remove(&(entry.node.lower_bound(), number));
        self.memory.remove_node(&entry.node);
        Some((entry, lower_bound))
    }
}

/// Returns whether a cost is at most `weight` times the lower bound `least`, with a tolerance for rounding.
///
/// The costs of single agents are rounded one by one. Without the tolerance, the queue could run out of nodes within
/// the bound. The product of a least cost of 0 and an infinite weight is NaN, but the least cost itself is always
/// within the bound.
fn is_within(cost: u64, least: u64, weight: f64) -> bool {
    cost <= least || cost as f64 <= least as f64 * weight * (1.0 + 1e-12)
}

#[cfg(test)]
mod tests {
    use super::is_within;

    #[test]
    fn a_cost_equal_to_the_bound_is_within_it() {
        // Nine agents whose paths cost 7 instead of 5; in floating point, 45 × 1.4 is slightly less than 63.
        assert!(is_within(63, 45, 1.4));
        assert!(!is_within(64, 45, 1.4));
        assert!(is_within(6, 5, 1.2) && !is_within(7, 5, 1.2));
        assert!(is_within(0, 0, f64::INFINITY) && is_within(9, 5, f64::INFINITY));
    }
}
