//! Maps and scenarios in the formats that people keep them in.
//!
//! | Format | What it holds | Here |
//! | --- | --- | --- |
//! | map text | one map, with letters or pools | [`crate::parse_map_text`], [`crate::MapText::to_text`] |
//! | map set | map texts by name, as the toolbox keeps them | [`read_set`], [`write_set`] |
//! | MovingAI `.map` | one map | [`read_movingai`], [`write_movingai`] |
//! | MovingAI `.scen` | starts and goals | [`read_scen`], [`write_scen`], [`Task`] |
//! | zip | many `.map` files, as they are downloaded | [`read_archive`], [`write_archive`] |
//! | scenario | starts and goals or sequences of them, as configs have them | [`Scenario`] |

mod archive;
mod movingai;
mod scen;
mod scenario;
mod set;

pub use archive::{read_archive, write_archive};
pub use movingai::{Water, read_movingai, without_ring, write_movingai};
pub use scen::{Task, read_scen, write_scen};
pub use scenario::Scenario;
pub use set::{NamedMap, read_set, write_set};
