//! Plays many episodes of many algorithms, and shows the results in tables and plots.
//!
//! A [`Suite`] is read from one YAML file. It holds algorithms, views, and environments with fields
//! that may be varied.

#![forbid(unsafe_code)]

pub mod bootstrap;
mod bounded;
mod built_in;
mod episode_configs;
#[cfg(feature = "views")]
mod fit;
pub mod groups;
mod library;
mod manifest;
mod play;
mod progress;
mod replay;
#[cfg(feature = "views")]
pub mod report;
pub mod results;
mod run;
pub mod six;
mod store;
mod suite;
mod tree;
mod variants;
#[cfg(feature = "views")]
pub mod views;

pub use built_in::BuiltIn;
pub use episode_configs::{EpisodeConfig, EpisodeConfigs};
#[cfg(feature = "views")]
pub use fit::fitted;
pub use manifest::{Manifest, RunRecord, machine};
pub use play::{Played, play, record};
pub use progress::{Done, Failed, Progress};
pub use replay::differences;
pub use results::{Episode, Pairs, Proof, Results, Row, short};
pub use run::{Event, RunOptions, Summary, built_in, run, run_one};
pub use store::{Begin, HasResults, REPORT, Store};
pub use suite::{Algorithm, Backend, Replacement, Suite};
pub use tree::{Content, Node};
pub use variants::{Variant, Variants};

/// The README, whose example the tests compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
