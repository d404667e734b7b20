//! Numbers of the paper and of its web page, from the results that were published with it.
//!
//! `POGEMA_PUBLISHED` names the folder with `results-mapf.tar.gz` and `meta_metrics_mapf.csv`; without it nothing is
//! checked, and each test says so.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod archive;
mod six;
mod tables;
