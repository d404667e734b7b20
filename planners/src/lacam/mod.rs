//! LaCAM*: finds a first plan quickly, and refines it until the budget is spent.
//!
//! Papers: Okumura, "Engineering LaCAM*: Towards Real-Time, Large-Scale, and Near-Optimal Multi-Agent Pathfinding",
//! AAMAS 2024, which runs search and refinement side by side; the papers of [`search`], which finds plans or proves
//! that none exists, and of [`lns`], which refines plans.

mod components;
mod constraint_tree;
mod lns;
mod objective;
mod params;
mod planner;
mod run;
mod search;
mod search_graph;

pub use params::LacamParams;
pub use planner::Lacam;
