//! Generates instances from a config and a seed, bit for bit as POGEMA 1.4.0 does.
//!
//! [`GridConfig`] is POGEMA's config. [`InstanceSource`] turns it into one [`pogema_core::Instance`] per
//! reset. It draws the same random numbers as POGEMA, which uses NumPy ([`pogema_numpy`]).
//!
//! ```
//! use pogema_maps::{GridConfig, InstanceSource};
//!
//! let config = GridConfig::from_yaml("{size: 8, num_agents: 2, seed: 0}")?;
//! let mut source = InstanceSource::new(config, None)?;
//! let instance = source.generate()?.instance;
//! assert_eq!(instance.starts()[0], pogema_core::Cell::new(0, 2));
//! # Ok::<(), pogema_core::Error>(())
//! ```

#![forbid(unsafe_code)]

mod catalogue;
mod components;
mod config;
mod distance;
mod drawn_goals;
mod file_name;
pub mod files;
mod foretell;
pub mod formats;
pub mod generators;
mod library;
mod on_map;
mod place;
mod source;
mod stats;
mod text;
mod tiles;

pub use catalogue::{PUZZLES, Puzzle, map_names, named_map};
pub use components::{ComponentCells, Components};
pub use config::{
    FIELDS, GridConfig, Integration, Limits, Targets, did_you_mean, value_from_json, value_from_yaml,
    yaml_document,
};
pub use distance::{distances_to, free_neighbours};
pub use foretell::{foretold_from, foretold_goals};
pub use library::Library;
pub use place::{capacity, place_at_random};
pub use source::{Generated, InstanceSource, SavedInstance, random_sequence};
pub use stats::{Infeasibility, MapStats, ScenarioPart, ScenarioStats};
pub use text::{MapText, parse_map_text};
pub use tiles::{PUBLISHED_TILE, tiles};

/// The README, whose example the tests compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
