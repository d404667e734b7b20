//! Evaluations: many episodes of many algorithms, and the tables and plots of what came of them.
//!
//! A [`Suite`] is read from one YAML file: environments, of which fields may be varied, algorithms, and views.

mod suite;
mod tree;
mod variants;

pub use suite::{Algorithm, BACKENDS, Suite};
pub use tree::{Content, Node};
pub use variants::{Variant, Variants};
