//! MATS-LP: Monte Carlo tree search over the joint actions of nearby agents, with a learned prior.
//!
//! Each agent searches alone. Its *group* consists of itself and the agents within a few steps; other agents do not
//! exist for its search. The search grows a tree over the joint actions of the group for a fixed number of
//! *expansions*. The network gives the prior of each action, and a simulation of the group gives the rewards. The agent
//! plays its own action in the most visited joint action. Nothing is random, so the same states always give the same
//! actions.
//!
//! Three things make MATS-LP fast, and none of them changes a result. The searches of many agents advance in lockstep,
//! so that one call of the network evaluates a leaf of each search. A cache keeps the outputs of the network, because
//! agents near each other reach the same states. A simulation returns to its root by restoring a few numbers per agent.
//!
//! [`MatsLpParams::faithful`] selects between the published program and the search that the paper describes.
//!
//! Source: Skrynnik, Andreychuk, Yakovlev, Panov: Decentralized Monte Carlo Tree Search for Partially Observable
//! Multi-Agent Pathfinding, AAAI 2024; the program published with it

mod cache;
mod evaluator;
mod group;
mod network_prior;
mod params;
mod policy;
mod prior;
mod search;
mod simulation;
mod soft;
mod tree;
mod workers;
mod world;

pub use evaluator::MatsLpStats;
pub use network_prior::NetworkPrior;
pub use params::MatsLpParams;
pub use policy::MatsLp;
pub use prior::{Evaluate, Evaluation, Prior};
pub use tree::RootChild;
