//! Planners and policies: who decides what the agents do.
//!
//! A [`Problem`] is agents on a map, each with a start and a goal; a [`Planner`] makes a [`Plan`] of it within a
//! [`Budget`] and says what it found out, its [`Outcome`]. [`validate`] checks anyone's plan.
//!
//! [`AStarTeam`] is the A* policy that POGEMA ships, action for action; its random numbers come in from outside.

mod astar;
mod constraints;
mod distances;
mod graph;
mod guide;
mod heap;
mod lacam;
mod parts;
mod pibt;
mod plan;
mod problem;
mod refine;
mod search;
mod stepper;
mod validate;

pub use astar::{AStarAgent, AStarTeam, View};
pub use distances::{AllPairs, CostToGo, Distances, UNREACHABLE};
pub use graph::{Graph, Vertex};
pub use guide::GuideParams;
pub use lacam::{Lacam, LacamParams};
pub use pibt::{Pibt, PibtLifelong, PibtParams};
pub use plan::Plan;
pub use problem::{Budget, Clock, Outcome, Planner, Problem};
pub use stepper::PibtRules;
pub use validate::{Conflict, ConflictKind, validate};
