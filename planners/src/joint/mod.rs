//! Searches through joint states: the vertices of all agents together.
//!
//! [`astar`] finds plans of least cost for a few agents, [`solvability`] uses it to decide whether a scenario is
//! solvable, and [`reachability`] decides whether a problem has a plan, without regard to costs.

pub(crate) mod astar;
pub(crate) mod reachability;
pub(crate) mod solvability;
