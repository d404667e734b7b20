//! Safe interval path planning (SIPP): the best path of one agent among the known paths of others.
//!
//! Reservations divide the time at a vertex into safe intervals. Within a safe interval only the earliest arrival
//! matters, because the agent can wait. The search therefore expands intervals instead of steps.
//!
//! Source: Phillips and Likhachev, "SIPP: Safe Interval Path Planning for Dynamic Environments", ICRA 2011; for soft
//! constraints: Li et al., "MAPF-LNS2: Fast Repairing for Multi-Agent Path Finding via Large Neighborhood Search",
//! AAAI 2022
//!
//! | paper | here |
//! | --- | --- |
//! | configuration | `vertex` |
//! | safe interval | the interval that ends with `until` |
//! | g, h, f | `cost`, `to_go` + `then`, their sum |
//! | soft obstacle, c-value | [`Task::avoided`], `conflicts` |
//!
//! This SIPP supports soft constraints, several goals and windows. The large neighbourhood search of LaCAM* needs none
//! of them and has its own search, which is 1.9 to 2.5 times as fast on its tasks (measured in one run on five
//! instances).

mod node;
mod search;
mod task;

pub use search::Sipp;
pub use task::{Horizon, Leg, Order, Task, TimedPath};
