//! Planners and policies: who decides what the agents do.
//!
//! [`AStarTeam`] is the A* policy that POGEMA ships, action for action. Random numbers come in from outside, as
//! a function: this crate draws none.

mod astar;
mod heap;

pub use astar::{AStarAgent, AStarTeam, View};
