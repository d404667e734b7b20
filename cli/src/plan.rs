//! Plans for whole problems.

mod make;
mod thinking;
mod validate;

pub use make::MakePlan;
pub use thinking::Thinking;
pub use validate::Validate;
