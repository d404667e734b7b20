//! Centralised planners for POGEMA environments, and policies.
//!
//! A [`Problem`] is a set of agents on a map, each with a start and a goal. A [`Planner`] solves it within a [`Budget`]
//! and returns an [`Outcome`]. [`validate()`] checks any [`Plan`]. A [`Lifelong`] planner chooses moves for agents that
//! get a new goal whenever they reach one.
//!
//! | planner | module |
//! | --- | --- |
//! | [`Lacam`]: LaCAM* with large neighbourhood search | `lacam` |
//! | [`Pibt`], [`PibtLifelong`]: priority inheritance with backtracking | `pibt` |
//! | [`Cbs`], [`Ecbs`]: conflict-based search | `cbs` |
//! | [`Pbs`]: priority-based search | `pbs` |
//! | [`Rhcr`]: rolling-horizon collision resolution | `rhcr` |
//! | [`sipp`]: safe interval path planning for one agent | `sipp` |
//! | [`solvability`]: A* through joint states | `joint` |
//!
//! [`PlannerName`] and [`LifelongName`] create planners by name. [`PlannerPolicy`] and [`LifelongPolicy`] let a planner
//! control an environment.
//!
//! [`AStarTeam`] reproduces POGEMA's A* policy, action for action. [`pogema_team`] and [`sample`] draw the same random
//! numbers as POGEMA.

#![forbid(unsafe_code)]

mod bfs;
mod budget;
mod cbs;
mod conflicts;
mod distances;
mod graph;
mod heapq;
mod joint;
mod lacam;
mod lifelong;
mod outcome;
mod paths;
mod pbs;
mod pibt;
mod plan;
mod plan_text;
mod planner;
mod policies;
mod problem;
mod random;
mod registry;
mod reservations;
mod rhcr;
pub mod sipp;
mod team_task;
mod validate;

pub use bfs::{Bfs, UNREACHABLE};
pub use budget::Budget;
pub use cbs::{Cbs, CbsParams, Ecbs, EcbsParams};
pub use distances::{CostToGo, Distances};
pub use graph::{Graph, Vertex};
pub use heapq::{HeapQ, Precedes};
pub use joint::solvability::{Solvability, solvability};
pub use lacam::{Lacam, LacamParams};
pub use lifelong::Lifelong;
pub use outcome::Outcome;
pub use pbs::{Pbs, PbsParams};
pub use pibt::{GuidanceParams, Pibt, PibtLifelong, PibtParams, PibtRules};
pub use plan::Plan;
pub use plan_text::{PlanText, write_plan, write_result};
pub use planner::Planner;
pub use policies::{
    AStarAgent, AStarTeam, GoalForecast, LifelongPolicy, PlannerPolicy, PomapfObservation,
    PomapfObservations, pogema_team, sample,
};
pub use problem::Problem;
pub use registry::{LifelongName, PlannerName, PlannerSettings};
pub use reservations::Reservations;
pub use rhcr::{Rhcr, RhcrParams, WindowSolver};
pub use validate::{Conflict, ConflictKind, validate, validate_arrivals};

/// The README, whose example the tests compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
