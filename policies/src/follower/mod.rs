//! Follower: a network follows the paths of a planner that avoids traffic.
//!
//! Source: Skrynnik et al., "Learn to Follow: Decentralized Lifelong Multi-agent Pathfinding via Planning and
//! Learning", AAAI 2024

mod entry;
mod planner;
mod search;
mod static_costs;
#[cfg(test)]
mod tests;

pub(crate) use planner::FollowerPlanner;
pub use planner::FollowerVersion;
