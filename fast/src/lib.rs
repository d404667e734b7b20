//! A fast engine for the rules of POGEMA 1.4.0.
//!
//! It plays the same episodes as the reference, hundreds of times faster than POGEMA.
//!
//! [`Engine`] plays one environment, from a handful of agents to millions. It has the same phases and file names as the
//! reference, so that you can compare them side by side. Tests play both in lockstep, and check the fast engine against
//! every recording of POGEMA.
//!
//! [`Batch`] plays many environments with one call, each with its own episodes, on a given number of threads.
//!
//! | file | phase |
//! | --- | --- |
//! | `grid` | the map with its border as bits, and the board for moves |
//! | `step` | the order of the phases in a step |
//! | `collide` | conflicting moves |
//! | `goals` | the effects of reaching a goal: rewards, ends and next goals |
//! | `observe` | observations |
//! | `history` | the return to an earlier or saved state |
//! | `masks` | action masks |
//! | `buffers` | the buffers for observations, action masks and global states |
//! | `batch` | many environments |
//! | `bits` | a writer for packed bits |
//! | `simd` | conversion of windows to bits and of bits to values, without intrinsics or with AVX2 or AVX-512 |
//!
//! ```
//! use pogema_core::{Action, Cell, Config, Environment, GoalStream, Instance, Map, Outside, StepOut};
//! use pogema_fast::Engine;
//!
//! let map = Map::from_rows(&["..."])?;
//! let goals = vec![GoalStream::single(Cell::new(0, 1))];
//! let instance = Instance::new(map, Outside::Free, vec![Cell::new(0, 0)], goals)?;
//! let mut engine = Engine::new(Config { num_agents: 1, radius: 1, ..Config::default() })?;
//! engine.start(instance)?;
//! let (mut rewards, mut terminated, mut truncated) = ([0.0], [false], [false]);
//! let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
//! engine.step(&[Action::Right], out)?;
//! assert_eq!((rewards, terminated), ([1.0], [true]));
//! let mut seen = [0u8; 27];
//! engine.observe_agents(0..1, &mut seen)?;
//! assert_eq!(seen[..9], [1, 1, 1, 0, 0, 0, 1, 1, 1]);
//! # Ok::<(), pogema_core::Error>(())
//! ```

mod batch;
mod bits;
mod buffers;
mod collide;
mod goals;
mod grid;
mod history;
mod masks;
mod observe;
mod simd;
mod step;

pub use batch::{Autoreset, Batch, FirstInstances, Instances, suited_threads};
pub use buffers::{ApartBuffers, GlobalBuffers, ObservationBuffers, Observations, Windows};
pub use observe::words_per_agent;
pub use pogema_core::SimdPath;
pub use simd::Value;
pub use step::Engine;

/// The README, whose example the tests compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
