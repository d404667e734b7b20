//! File formats of maps and scenarios.
//!
//! | Format | Content | Functions and types |
//! | --- | --- | --- |
//! | map text | one map, with letters or pools | [`crate::parse_map_text`], [`crate::MapText::to_text`] |
//! | map set | map texts by name, in pogema-toolbox's format | [`read_set`], [`write_set`] |
//! | MovingAI `.map` | one map | [`read_movingai`], [`write_movingai`] |
//! | MovingAI `.scen` | starts and goals | [`read_scen`], [`write_scen`], [`Task`] |
//! | zip | many `.map` files, as MovingAI distributes them | [`read_archive`], [`write_archive`] |
//! | scenario | starts and goals or goal sequences, as in configs | [`Scenario`] |

mod archive;
mod movingai;
mod scen;
mod scenario;
mod set;

pub use archive::{read_archive, write_archive};
pub use movingai::{Water, read_movingai, without_outermost_cells, write_movingai};
pub use scen::{Task, read_scen, write_scen};
pub use scenario::Scenario;
pub(crate) use scenario::check_equal_numbers;
pub use set::{NamedMap, read_set, set_entry, write_set};
