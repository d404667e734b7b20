//! RePlan: in every step, each agent searches for a path through cells in which it has seen no obstacle.
//!
//! Source: Skrynnik et al., "When to switch: planning and learning for partially observable multi-agent pathfinding",
//! 2023; when-to-switch, `planning/replan_algo.py`, `planning/planner.cpp`

mod place;
mod planner;
mod policy;
mod reached;
mod search;
#[cfg(test)]
mod tests;

pub(crate) use planner::{Plan, ReplanVersion, Replanner};
pub(crate) use policy::ReplanPolicy;
