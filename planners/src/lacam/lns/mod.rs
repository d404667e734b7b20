//! The large neighbourhood search (LNS) of LaCAM*: replans a few agents of a valid plan at a time, and keeps the new
//! paths unless the total delay grows.
//!
//! Papers: Li, Chen, Harabor, Stuckey, Koenig, "Anytime Multi-Agent Path Finding via Large Neighborhood Search", IJCAI
//! 2021, and "MAPF-LNS2", AAAI 2022; parallel workers: Chan, Chen, Harabor, Stuckey, "Anytime Multi-Agent Path Finding
//! with Operation Parallelism in Large Neighborhood Search", AAMAS 2024.
//!
//! | paper | here |
//! | --- | --- |
//! | P, the paths | [`solution::Solution`] |
//! | destroy heuristics and their weights | [`neighbourhood::NeighbourhoodSelector`] |
//! | repair: prioritised planning in random order | `Refiner::repair` |
//!
//! The LNS has its own SIPP ([`earliest_arrival`]) and reservation table ([`time_table`]), because the general ones
//! ([`crate::sipp`], [`crate::Reservations`]) are slower. Both pairs were run side by side on five crowds (32 to 192
//! agents on random, maze, warehouse and city maps; 20,000 nodes each). They found the same arrivals in all 236,307
//! searches. The general search took 1.9 to 2.5 times as long, the general table 4.3 to 7.5 times, and both together
//! 2.0 to 2.6 times.

mod change_log;
mod earliest_arrival;
mod neighbourhood;
mod refiner;
mod solution;
mod time_table;

pub(crate) use change_log::ChangeLog;
pub(crate) use refiner::{Refiner, num_bytes, supports};
