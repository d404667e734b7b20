//! One path for each agent, and the conflicts of two of them.

use std::sync::Arc;

use crate::graph::Vertex;
use crate::outcome::Outcome;
use crate::problem::Problem;

/// One path for each agent; the nodes of a search tree share unchanged paths.
#[derive(Clone, Debug)]
pub(crate) struct Paths {
    each: Vec<Arc<Vec<Vertex>>>,
    costs: Vec<u32>,
    /// Whether agents stay at the ends of their paths.
    pub(crate) stays: bool,
}

/// A vertex or edge conflict of two agents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PathConflict {
    /// The two agents in ascending order.
    pub(crate) agents: (usize, usize),
    /// The step after which they share a vertex, or in which they swap.
    pub(crate) step: usize,
    /// For an edge conflict, the vertex that the first agent leaves.
    pub(crate) from: Option<Vertex>,
    /// The vertex of the first agent after the step.
    pub(crate) at: Vertex,
}

impl Paths {
    pub(crate) fn new(num_agents: usize, stays: bool) -> Self {
        Self { each: vec![Arc::default(); num_agents], costs: vec![0; num_agents], stays }
    }

    pub(crate) fn num_agents(&self) -> usize {
        self.each.len()
    }

    pub(crate) fn path(&self, agent: usize) -> &[Vertex] {
        &self.each[agent]
    }

    pub(crate) fn cost(&self, agent: usize) -> u32 {
        self.costs[agent]
    }

    pub(crate) fn set(&mut self, agent: usize, path: Arc<Vec<Vertex>>, cost: u32) {
        self.each[agent] = path;
        self.costs[agent] = cost;
    }

    /// Copies the path and the cost of agent `other` of `others` to an agent.
    pub(crate) fn copy_from(&mut self, others: &Self, other: usize, agent: usize) {
        self.set(agent, others.each[other].clone(), others.costs[other]);
    }

    pub(crate) fn total_cost(&self) -> u64 {
        self.costs.iter().map(|&cost| u64::from(cost)).sum()
    }

    /// Returns the number of steps of the longest path.
    pub(crate) fn num_steps(&self) -> usize {
        self.each.iter().map(|path| path.len().saturating_sub(1)).max().unwrap_or(0)
    }

    /// Returns the vertex of an agent after a step.
    pub(crate) fn at(&self, agent: usize, step: usize) -> Option<Vertex> {
        let path = &self.each[agent];
        let end = path.last().filter(|_| self.stays);
        path.get(step).or(end).copied()
    }

    /// Returns the first conflict of two agents.
    pub(crate) fn conflict(&self, one: usize, other: usize) -> Option<PathConflict> {
        let agents = (one.min(other), one.max(other));
        let last = self.each[one].len().max(self.each[other].len());
        (0..last).find_map(|step| self.conflict_at(agents, step))
    }

    /// Returns the conflict of two agents at a step.
    pub(crate) fn conflict_at(&self, agents: (usize, usize), step: usize) -> Option<PathConflict> {
        let at = self.at(agents.0, step)?;
        let there = self.at(agents.1, step)?;
        if at == there {
            return Some(PathConflict { agents, step, from: None, at });
        }
        let before = step.checked_sub(1)?;
        let (from, from_there) = (self.at(agents.0, before)?, self.at(agents.1, before)?);
        (at == from_there && there == from).then_some(PathConflict { agents, step, from: Some(from), at })
    }

    /// Returns whether two agents conflict.
    pub(crate) fn collide(&self, one: usize, other: usize) -> bool {
        self.conflict(one, other).is_some()
    }

    /// Converts the paths to a solution of a problem.
    pub(crate) fn outcome(&self, problem: &Problem, lower_bound: u64) -> Outcome {
        let place = |agent: usize, step: usize| self.at(agent, step).unwrap_or(problem.goals[agent]);
        let places = |step: usize| (0..self.num_agents()).map(|agent| place(agent, step)).collect();
        let steps: Vec<Vec<Vertex>> = (0..=self.num_steps()).map(places).collect();
        match problem.plan_of(&steps) {
            Ok(plan) => Outcome::Solved { plan, lower_bound },
            // INVARIANT: there is at least one state, and each state has a cell of each agent.
            Err(_) => Outcome::GaveUp { best: None, lower_bound },
        }
    }
}
