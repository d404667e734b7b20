//! The objectives of LaCAM*.

use crate::distances::CostToGo;
use crate::graph::Vertex;

/// The objective of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Objective {
    /// The sum of loss: in each step, the number of agents that are off their goals before it, after it, or both. The
    /// sum of loss of a plan is at most its sum of costs.
    SumOfLoss,
    /// The number of steps.
    Makespan,
}

impl Objective {
    /// Returns the cost of a step.
    pub fn step_cost(self, from: &[Vertex], to: &[Vertex], goals: &[Vertex]) -> u64 {
        match self {
            Self::Makespan => u64::from(from != to),
            Self::SumOfLoss => {
                let is_lost = |((from, to), goal): ((_, _), _)| u64::from(from != goal || to != goal);
                from.iter().zip(to).zip(goals).map(is_lost).sum()
            }
        }
    }

    /// Returns a lower bound on the cost from a configuration to the goals.
    pub fn cost_to_go(self, costs: &[CostToGo], configuration: &[Vertex]) -> u64 {
        let each = costs.iter().zip(configuration).map(|(costs, &vertex)| u64::from(costs[vertex as usize]));
        match self {
            Self::SumOfLoss => each.sum(),
            Self::Makespan => each.max().unwrap_or(0),
        }
    }
}
