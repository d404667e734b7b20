//! The task of one SIPP search, and its result.

use crate::distances::CostToGo;
use crate::graph::Vertex;
use crate::reservations::Reservations;

/// The task of one search.
#[derive(Clone, Copy, Debug)]
pub struct Task<'a> {
    /// The start of the agent.
    pub start: Vertex,
    /// The goals of the agent in visiting order.
    pub legs: &'a [Leg],
    /// Hard constraints: reservations that the path must not conflict with.
    pub reserved: &'a Reservations,
    /// Soft constraints: reservations whose conflicts are counted and avoided.
    pub avoided: Option<&'a Reservations>,
    /// Forbidden moves: (from, to, step) forbids the move from one vertex to the other in that step, counted from 1.
    pub banned: &'a [(Vertex, Vertex, u32)],
    /// The condition that ends the path.
    pub horizon: Horizon,
    /// The objective of the search.
    pub order: Order,
    /// Seed of tie-breaking.
    pub salt: u32,
}

/// The way to one goal.
#[derive(Clone, Debug)]
pub struct Leg {
    /// The costs to go to the goal.
    pub to_go: CostToGo,
    /// The cost from this goal through all later ones.
    pub then: u32,
}

impl Leg {
    /// Creates the leg to the last goal.
    pub fn last(to_go: CostToGo) -> Self {
        Self { to_go, then: 0 }
    }
}

/// The condition that ends a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Horizon {
    /// At the only goal, where the agent can stay forever.
    Stay {
        /// The step limit.
        max_steps: u32,
    },
    /// After this many steps, wherever the agent is; later conflicts are ignored.
    Window(u32),
}

/// The objective of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// The cost, then the number of conflicts with soft constraints.
    Cost,
    /// The number of conflicts with soft constraints, then the cost.
    Conflicts {
        /// The cost limit.
        max_cost: u32,
    },
}

/// A path in time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TimedPath {
    /// The vertex at the start and after each step.
    pub path: Vec<Vertex>,
    /// Steps to the last goal. If the window ends before it, the steps of the window plus the costs to go.
    pub cost: u32,
    /// Number of conflicts with soft constraints.
    pub conflicts: u32,
}
