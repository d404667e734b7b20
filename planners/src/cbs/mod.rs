//! Conflict-based search (CBS): optimal plans for few agents, and bounded-suboptimal plans ([`Ecbs`]).
//!
//! Source: Sharon et al., "Conflict-based search for optimal multi-agent pathfinding", Artificial Intelligence 219,
//! 2015; prioritised conflicts and bypasses: Boyarski et al., "ICBS: Improved Conflict-Based Search Algorithm for
//! Multi-Agent Pathfinding", IJCAI 2015; the heuristic from cardinal conflicts: Felner et al., "Adding Heuristics to
//! Conflict-Based Search for Multi-Agent Path Finding", ICAPS 2018; independence detection: see [`independence`].
//!
//! | paper | here |
//! | --- | --- |
//! | N.constraints, N.solution | [`node::Node::constraints`], [`node::Node::paths`] |
//! | cardinal, semi-cardinal | `num_forced` in [`search`] is 2 or 1, counted with [`mdd::Mdd::is_forced`] |
//! | bypass | `Search::expand` in [`search`] |
//! | h | `num_disjoint` in [`search`] |

pub(crate) mod ecbs;
mod focal;
mod independence;
mod low_level;
mod mdd;
mod memory;
mod node;
mod planner;
mod search;
mod unsolvable;

pub use ecbs::{Ecbs, EcbsParams};
pub use planner::Cbs;
pub use search::CbsParams;
