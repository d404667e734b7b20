//! Plans for whole problems.

mod make;
mod validate;
mod who;

pub use make::MakePlan;
pub use validate::Validate;
pub use who::Thinking;
