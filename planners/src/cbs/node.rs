//! The nodes of the constraint tree.

use std::sync::Arc;

use crate::graph::Vertex;
use crate::paths::{PathConflict, Paths};

/// A vertex or edge constraint of one agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Constraint {
    pub(crate) agent: usize,
    pub(crate) step: usize,
    /// For an edge constraint, the vertex that the agent leaves.
    pub(crate) from: Option<Vertex>,
    pub(crate) at: Vertex,
}

/// The constraints of a node as a linked list; a child shares the list of its parent.
#[derive(Debug)]
pub(crate) struct ConstraintList {
    pub(crate) constraint: Constraint,
    pub(crate) rest: Option<Arc<ConstraintList>>,
}

/// A node of the constraint tree.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) constraints: Option<Arc<ConstraintList>>,
    pub(crate) paths: Paths,
    /// For each agent, the least cost of a path that satisfies the constraints.
    pub(crate) least: Vec<u32>,
}

impl Node {
    /// Returns the sum of the least costs of all agents.
    pub(crate) fn lower_bound(&self) -> u64 {
        self.least.iter().map(|&cost| u64::from(cost)).sum()
    }

    /// Returns the constraints of one agent.
    pub(crate) fn constraints_of(&self, agent: usize) -> impl Iterator<Item = Constraint> + '_ {
        let mut next = self.constraints.as_deref();
        let all = std::iter::from_fn(move || {
            let list = next?;
            next = list.rest.as_deref();
            Some(list.constraint)
        });
        all.filter(move |constraint| constraint.agent == agent)
    }
}

/// Returns the two constraints that resolve a conflict; every conflict-free plan satisfies one of them.
pub(crate) fn split(conflict: &PathConflict) -> [Constraint; 2] {
    let PathConflict { agents: (one, other), step, from, at } = *conflict;
    let there = from.unwrap_or(at);
    [
        Constraint { agent: one, step, from, at },
        Constraint { agent: other, step, from: from.map(|_| at), at: there },
    ]
}
