//! Planners and policies: who decides what the agents do.
//!
//! A [`Problem`] is agents on a map, each with a start and a goal; a [`Planner`] makes a [`Plan`] of it within a
//! [`Budget`] and says what it found out, its [`Outcome`]. [`validate`] checks anyone's plan.
//!
//! [`sipp`] finds the way of one agent past others, [`Pbs`], [`Cbs`] and [`Ecbs`] plan whole problems with it, and
//! [`Rhcr`] plans for agents that get a new goal whenever they reach one, as every [`Lifelong`] does.
//!
//! [`planner()`] and [`lifelong()`] make a planner by its name; [`PlannerPolicy`] and [`LifelongPolicy`] let one drive any
//! environment.
//!
//! [`AStarTeam`] is the A* policy that POGEMA ships, action for action; [`pogema_team`] and [`sample`] draw the numbers
//! that POGEMA draws.

#![forbid(unsafe_code)]

mod astar;
mod cbs;
mod conflict;
mod constraints;
mod discount;
mod distances;
mod drawn;
mod ecbs;
mod flood;
mod foresight;
mod graph;
mod groups;
mod guide;
mod heap;
mod joint;
mod lacam;
mod lifelong;
mod mdd;
mod named_policy;
mod names;
mod parts;
mod pbs;
mod pibt;
mod plan;
mod plan_text;
mod policy;
mod problem;
mod random;
mod refine;
mod reservations;
mod rhcr;
mod scatter;
mod search;
pub mod sipp;
mod stepper;
mod tree;
mod validate;
mod window;
mod windows;

pub use astar::{AStarAgent, AStarTeam, View};
pub use cbs::{Cbs, CbsParams};
pub use distances::{AllPairs, CostToGo, Distances, UNREACHABLE};
pub use drawn::{pogema_team, sample};
pub use ecbs::{Ecbs, EcbsParams};
pub use graph::{Graph, Vertex};
pub use guide::GuideParams;
pub use lacam::{Lacam, LacamParams};
pub use lifelong::Lifelong;
pub use named_policy::{NamedPolicy, PolicySettings, SIMPLE};
pub use names::{Choice, LIFELONG, PLANNERS, lifelong, planner};
pub use pbs::{Pbs, PbsParams};
pub use pibt::{Pibt, PibtLifelong, PibtParams};
pub use plan::Plan;
pub use plan_text::{PlanText, write_plan, write_result};
pub use policy::{LifelongPolicy, PlannerPolicy};
pub use problem::{Budget, Clock, Outcome, Planner, Problem};
pub use reservations::Reservations;
pub use rhcr::{Rhcr, RhcrParams, WindowSolver};
pub use stepper::PibtRules;
pub use validate::{Conflict, ConflictKind, validate};
pub use windows::Windows;
