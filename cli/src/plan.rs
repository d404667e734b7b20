//! Plans for whole problems.

mod validate;

pub use validate::Validate;
