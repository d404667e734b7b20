//! The rules of POGEMA 1.4.0 on bits: the same episodes as the reference's, hundreds of times faster than POGEMA's.
//!
//! [`Engine`] plays one environment, from a handful of agents to millions. It has the reference's phases, under the
//! same file names, so that the two open side by side; that they do the same is proven by tests which play them in
//! lockstep, and by every recording of POGEMA.
//!
//! [`Batch`] plays many environments by one call, each with its own episodes, on as many threads as it is given.
//!
//! | file | phase |
//! | --- | --- |
//! | `grid` | the map with its border as bits, and the board that moves are made on |
//! | `step` | one step, as a table of contents |
//! | `collide` | who may move |
//! | `goals` | what reaching a goal does; rewards and ends |
//! | `observe` | what agents see |
//! | `history` | steps kept and taken back |
//! | `masks` | which actions make sense |
//! | `batch` | many environments |
//! | `simd` | windows to bits to values, plainly and with AVX2 or AVX-512 |
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
mod collide;
mod goals;
mod grid;
mod history;
mod masks;
mod observe;
mod simd;
mod step;

pub use batch::{Autoreset, Batch, Instances, ObservationBuffers, Observations};
pub use observe::words_per_agent;
pub use simd::{SimdPath, Value};
pub use step::Engine;
