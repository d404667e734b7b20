//! POGEMA in Rust: multi-agent pathfinding environments, bit for bit as POGEMA 1.4.0 plays them.
//!
//! [`GridConfig`] is POGEMA's config. [`start`] turns it into an [`Episode`]:
//!
//! ```
//! use pogema::{Action, GridConfig};
//!
//! let config = GridConfig::from_yaml("{size: 16, num_agents: 8, seed: 1}")?;
//! let mut episode = pogema::start(&config)?;
//! while !episode.is_over() {
//!     episode.step(&[Action::Right; 8])?;
//! }
//! println!("{:?}", episode.metrics());
//! # assert!(episode.metrics().isr.is_some());
//! # Ok::<(), pogema::Error>(())
//! ```
//!
//! [`batch`] turns a config into a [`Batch`], which steps and observes many environments with one call:
//!
//! ```
//! use pogema::{Action, GridConfig, Observations, StepResults};
//!
//! let config = GridConfig::from_yaml("{size: 16, num_agents: 8, on_target: restart}")?;
//! let mut batch = pogema::batch(&config, 64, 0)?;
//! let mut results = StepResults::new(64 * config.num_agents);
//! let mut seen = vec![0_u8; 64 * batch.config().num_observed()];
//! batch.reset()?;
//! for _ in 0..100 {
//!     batch.step(&[Action::Stay; 64 * 8], results.out(), Observations::U8(&mut seen))?;
//! }
//! # assert_eq!(batch.episode(63)?, Some(1));
//! # Ok::<(), pogema::Error>(())
//! ```
//!
//! | feature | adds |
//! | --- | --- |
//! | `planners` | [`planners`]: LaCAM*, CBS, ECBS, PBS, RHCR, PIBT and POGEMA's own policies |
//! | `policies` | [`policies`]: encoders, networks and learned policies |
//! | `render` | [`render`]: SVG, PNG, GIF, video and replay pages |
//! | `reference` | [`reference`](mod@reference): the rules as plain code, for comparison with other engines |
//! | `toolbox` | [`toolbox`]: evaluations of many algorithms on many episodes |

#![forbid(unsafe_code)]

mod batch;
mod episode;
mod seeds;

pub use batch::{ConfigWithMap, EnvSource, batch};
pub use episode::{start, start_on};
pub use pogema_core::{
    Action, Cell, Change, Collision, Config, Environment, Episode, Error, GoalStream, Instance, Map, Meters,
    Metrics, Observation, Occupancy, OnGoal, Outside, Recording, Reward, Seen, Snapshot, State, StepOut,
    StepResults, Trace, metrics,
};
pub use pogema_fast::{Autoreset, Batch, Engine, Instances, Observations, words_per_agent};
pub use pogema_maps::{
    GridConfig, InstanceSource, Integration, Library, Limits, MapText, Targets, named_map,
};
#[cfg(feature = "planners")]
pub use pogema_planners as planners;
#[cfg(feature = "policies")]
pub use pogema_policies as policies;
#[cfg(feature = "reference")]
pub use pogema_reference as reference;
#[cfg(feature = "render")]
pub use pogema_render as render;
#[cfg(feature = "toolbox")]
pub use pogema_toolbox as toolbox;
pub use seeds::Seed;

/// The Rust code of the README and the book, which the tests compile and run.
#[cfg(doctest)]
mod book {
    #[doc = include_str!("../../README.md")]
    struct Readme;
    #[doc = include_str!("../README.md")]
    struct Crate;
    #[doc = include_str!("../../docs/guide/rust.md")]
    struct Guide;
    #[doc = include_str!("../../docs/start/rust.md")]
    struct Start;
    #[doc = include_str!("../../docs/tutorials/policy.md")]
    struct Tutorial;
}
