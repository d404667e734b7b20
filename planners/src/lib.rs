//! Planners and policies: who decides what the agents do.
//!
//! A [`Problem`] is agents on a map, each with a start and a goal; a [`Planner`] makes a [`Plan`] of it within a
//! [`Budget`] and says what it found out, its [`Outcome`]. [`validate`] checks anyone's plan.
//!
//! [`sipp`] finds the way of one agent past others, [`Pbs`], [`Cbs`] and [`Ecbs`] plan whole problems with it, and
//! [`Rhcr`] plans for agents that get a new goal whenever they reach one, as every [`Lifelong`] does.
//!
//! [`AStarTeam`] is the A* policy that POGEMA ships, action for action; its random numbers come in from outside.

mod astar;
mod cbs;
mod conflict;
mod distances;
mod ecbs;
mod graph;
mod heap;
mod joint;
mod lifelong;
mod mdd;
mod pbs;
mod plan;
mod problem;
mod push;
mod reservations;
mod rhcr;
pub mod sipp;
mod tree;
mod validate;
mod window;

pub use astar::{AStarAgent, AStarTeam, View};
pub use cbs::{Cbs, CbsParams};
pub use distances::{AllPairs, CostToGo, Distances, UNREACHABLE};
pub use ecbs::{Ecbs, EcbsParams};
pub use graph::{Graph, Vertex};
pub use lifelong::Lifelong;
pub use pbs::{Pbs, PbsParams};
pub use plan::Plan;
pub use problem::{Budget, Clock, Outcome, Planner, Problem};
pub use reservations::Reservations;
pub use rhcr::{Rhcr, RhcrParams, WindowSolver};
pub use validate::{Conflict, ConflictKind, validate};
