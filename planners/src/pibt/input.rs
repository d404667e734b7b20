//! The input of a PIBT step.

use crate::graph::{Graph, Vertex};
use crate::problem::Agent;

/// No agent, or no vertex yet.
pub(super) const NONE: u32 = u32::MAX;

/// The costs to go of an agent.
pub(crate) trait Costs {
    fn cost(&self, vertex: Vertex) -> u32;
}

impl<T: AsRef<[u32]>> Costs for T {
    fn cost(&self, vertex: Vertex) -> u32 {
        self.as_ref()[vertex as usize]
    }
}

/// The input of a PIBT step.
#[derive(Debug)]
pub(crate) struct StepInput<'a, C> {
    pub graph: &'a Graph,
    pub now: &'a [Vertex],
    pub goals: &'a [Vertex],
    pub costs: &'a [C],
    /// All agents, highest priority first.
    pub order: &'a [Agent],
}

impl<C: Costs> StepInput<'_, C> {
    pub fn cost(&self, agent: Agent, vertex: Vertex) -> u32 {
        self.costs[agent as usize].cost(vertex)
    }

    pub fn place(&self, agent: Agent) -> Vertex {
        self.now[agent as usize]
    }
}
