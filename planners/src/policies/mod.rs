//! Policies: planners that control an environment, and POGEMA's own policies.
//!
//! A policy knows the map and the current state. Future goals are hidden from it unless they are provided explicitly.

mod astar;
mod goal_forecast;
mod lifelong_policy;
mod observations;
mod planner_policy;
mod pogema;

pub use astar::{AStarAgent, AStarTeam, pogema_team};
pub use goal_forecast::GoalForecast;
pub use lifelong_policy::LifelongPolicy;
pub use observations::{PomapfObservation, PomapfObservations};
pub use planner_policy::PlannerPolicy;
pub use pogema::sample;
