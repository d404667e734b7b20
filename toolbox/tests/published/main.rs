//! Reproduces numbers of the paper and of its web page from the published results.
//!
//! `POGEMA_PUBLISHED` names the folder with `results-mapf.tar.gz`, `meta_metrics_mapf.csv` and `published.csv`. If it
//! is not set, each test is skipped with a message.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod archive;
mod six;
mod tables;
