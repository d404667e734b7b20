//! Planners and policies: who decides what the agents do.
//!
//! A [`Problem`] is agents on a map, each with a start and a goal; a [`Planner`] makes a [`Plan`] of it within a
//! [`Budget`] and says what it found out, its [`Outcome`]. [`validate`] checks anyone's plan.
//!
//! [`AStarTeam`] is the A* policy that POGEMA ships, action for action; its random numbers come in from outside.

mod astar;
mod distances;
mod graph;
mod heap;
mod plan;
mod plan_text;
mod problem;
mod validate;

pub use astar::{AStarAgent, AStarTeam, View};
pub use distances::{AllPairs, CostToGo, Distances, UNREACHABLE};
pub use graph::{Graph, Vertex};
pub use plan::Plan;
pub use plan_text::{PlanText, write_plan, write_result};
pub use problem::{Budget, Clock, Outcome, Planner, Problem};
pub use validate::{Conflict, ConflictKind, validate};
