//! The low level of LaCAM: who is forced to go where, one more agent at each depth of a tree that is only counted
//! through.

use crate::graph::{Graph, Vertex};
use crate::stepper::Agent;

/// A node of the tree: as many agents as the depth, the first in order, are forced, and the digits of a number in mixed
/// radix say where to.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Constraints {
    depth: u32,
    number: u64,
    /// How many numbers the depth has.
    width: u64,
}

impl Constraints {
    /// The node that comes next, level by level, if there is one.
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

    /// Writes who must go where. Which digit means which place depends on `turn`.
    pub fn read(
        self,
        graph: &Graph,
        now: &[Vertex],
        order: &[Agent],
        turn: u64,
        forced: &mut Vec<(Agent, Vertex)>,
    ) {
        forced.clear();
        let mut number = self.number;
        for depth in (0..self.depth as usize).rev() {
            let agent = order[depth];
            let place = now[agent as usize];
            let around = graph.neighbours(place);
            let choices = around.len() as u64 + 1;
            let digit = (number % choices + turn + depth as u64) % choices;
            number /= choices;
            forced.push((agent, around.get(digit as usize).copied().unwrap_or(place)));
        }
    }
}
