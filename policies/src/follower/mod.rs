//! Follower: a planner that avoids traffic, whose paths a network follows.
//!
//! Skrynnik et al., "Learn to Follow: Decentralized Lifelong Multi-agent Pathfinding via Planning and Learning", AAAI 2024

mod heap;
mod planner;
mod search;
mod static_costs;

pub(crate) use planner::FollowerPlanner;
pub use planner::FollowerVersion;
