//! Searches through joint states: the vertices of all agents at once.
//!
//! [`astar`] finds plans of least cost for a few agents, [`solvability`] applies it to a map, and [`reachability`]
//! decides without costs whether a problem has a plan at all.

pub(crate) mod astar;
pub(crate) mod reachability;
pub(crate) mod solvability;
