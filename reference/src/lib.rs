//! The rules of POGEMA 1.4.0 as plain code.
//!
//! [`Reference`] plays one environment with plain vectors, one agent after another. It draws random numbers only
//! through the goal streams of its instance, starts no threads and is never optimized: it defines the semantics, and
//! every other engine is compared with it.
//! Functions that implement rules of the spec name these rules.
//!
//! | file | content |
//! | --- | --- |
//! | `grid` | the map with its border, and the occupancy grid |
//! | `step` | the order of the phases in a step |
//! | `collide` | conflicting moves |
//! | `goals` | the effects of reaching a goal: rewards, ends and next goals |
//! | `observe` | observations |
//! | `history` | the return to an earlier state |
//!
//! ```
//! use pogema_core::{Action, Cell, Config, Environment, GoalStream, Instance, Map, Outside, StepOut};
//! use pogema_reference::Reference;
//!
//! let map = Map::from_rows(&["..."])?;
//! let goals = vec![GoalStream::single(Cell::new(0, 1))];
//! let instance = Instance::new(map, Outside::Free, vec![Cell::new(0, 0)], goals)?;
//! let mut environment = Reference::new(Config { num_agents: 1, ..Config::default() })?;
//! environment.reset(&instance)?;
//! let (mut rewards, mut terminated, mut truncated) = ([0.0], [false], [false]);
//! let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
//! environment.step(&[Action::Right], out)?;
//! assert_eq!((rewards, terminated), ([1.0], [true]));
//! # Ok::<(), pogema_core::Error>(())
//! ```

#![forbid(unsafe_code)]

mod collide;
mod goals;
mod grid;
mod history;
mod observe;
mod step;

pub use step::Reference;

/// The README, whose example the tests compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
