//! The nodes of SIPP, and how a task evaluates them.

use crate::bfs::UNREACHABLE;
use crate::graph::Vertex;
use crate::sipp::task::{Horizon, Order, Task};

/// A node of the search: a vertex, a safe interval and the earliest arrival in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub vertex: Vertex,
    pub time: u32,
    pub until: u32,
    /// Number of goals reached.
    pub phase: u32,
    pub cost: u32,
    pub conflicts: u32,
    pub parent: u32,
    /// The previous node of the same vertex.
    pub sibling: u32,
}

impl Node {
    /// Returns whether this node dominates another: same interval and phase, no later, no more expensive, no more
    /// conflicts.
    #[inline]
    pub fn dominates(&self, other: &Self) -> bool {
        self.vertex == other.vertex
            && self.until == other.until
            && self.phase == other.phase
            && self.time <= other.time
            && self.cost <= other.cost
            && self.conflicts <= other.conflicts
    }
}

impl Task<'_> {
    /// Returns the f-value of a node, unless it exceeds a limit.
    #[inline]
    pub(super) fn bound(&self, node: &Node) -> Option<u32> {
        let bound = match self.legs.get(node.phase as usize) {
            Some(leg) if leg.to_go[node.vertex as usize] == UNREACHABLE => return None,
            Some(leg) => node.cost + leg.to_go[node.vertex as usize] + leg.then,
            None => node.cost,
        };
        let max_steps = match self.horizon {
            Horizon::Stay { max_steps } => max_steps,
            Horizon::Window(_) => u32::MAX,
        };
        let max_cost = match self.order {
            Order::Cost => u32::MAX,
            Order::Conflicts { max_cost } => max_cost,
        };
        (bound <= max_steps.min(max_cost)).then_some(bound)
    }

    /// Returns whether a node ends the path.
    #[inline]
    pub(super) fn is_end(&self, node: &Node) -> bool {
        let is_finished = node.phase as usize == self.legs.len();
        match self.horizon {
            Horizon::Stay { .. } => is_finished,
            Horizon::Window(last) => node.time >= last || (is_finished && node.until >= last),
        }
    }

    /// Returns whether a step is beyond the window.
    #[inline]
    pub(super) fn is_beyond(&self, time: u32) -> bool {
        matches!(self.horizon, Horizon::Window(last) if time > last)
    }

    /// Returns the cost after waiting until a step. An agent that has reached all goals pays nothing.
    #[inline]
    pub(super) fn cost_after(&self, node: &Node, time: u32) -> u32 {
        let is_finished = node.phase as usize == self.legs.len();
        if is_finished { node.cost } else { node.cost + time - node.time }
    }

    /// Returns whether a move is forbidden or swaps with a reserved path.
    #[inline]
    pub(super) fn is_barred(&self, from: Vertex, to: Vertex, time: u32) -> bool {
        self.banned.contains(&(from, to, time)) || self.reserved.num_swaps(from, to, time) > 0
    }

    /// Shortens the interval of a node to the part with a constant number of soft conflicts, and counts them.
    #[inline]
    pub(super) fn split(&self, node: Node) -> Node {
        let Some(avoided) = self.avoided else { return node };
        let (count, until) = avoided.count_at(node.vertex, node.time);
        let until = match self.horizon {
            Horizon::Window(last) if until >= last => node.until,
            _ => until.min(node.until),
        };
        Node { until, conflicts: node.conflicts + count, ..node }
    }
}
