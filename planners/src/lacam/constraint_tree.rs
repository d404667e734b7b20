//! The low level of LaCAM: a tree of constraints on the next vertices of agents, enumerated by counting.

use crate::graph::{Graph, Vertex};
use crate::problem::Agent;

/// A node of the tree. It constrains the first `depth` agents in order; the digits of a number in mixed radix select
/// their next vertices.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ConstraintNode {
    depth: u32,
    number: u64,
    /// Number of nodes at this depth.
    width: u64,
}

impl ConstraintNode {
    /// Returns the next node in breadth-first order, if any.
    pub fn after(mut self, graph: &Graph, now: &[Vertex], order: &[Agent]) -> Option<Self> {
        self.number += 1;
        if self.number >= self.width.max(1) {
            let agent = *order.get(self.depth as usize)?;
            let choices = graph.neighbours(now[agent as usize]).len() as u64 + 1;
            self.width = self.width.max(1).saturating_mul(choices);
            self.depth += 1;
            self.number = 0;
        }
        Some(self)
    }

    /// Writes the constraints of the node. `turn` rotates the meaning of the digits.
    pub fn write_constraints(
        self,
        graph: &Graph,
        now: &[Vertex],
        order: &[Agent],
        turn: u64,
        constraints: &mut Vec<(Agent, Vertex)>,
    ) {
        constraints.clear();
        let mut number = self.number;
        for depth in (0..self.depth as usize).rev() {
            let agent = order[depth];
            let place = now[agent as usize];
            let around = graph.neighbours(place);
            let choices = around.len() as u64 + 1;
            let digit = (number % choices + turn + depth as u64) % choices;
            number /= choices;
            constraints.push((agent, around.get(digit as usize).copied().unwrap_or(place)));
        }
    }
}
