//! Plans for whole problems.

mod make;
mod planner_args;
mod validate;

pub use make::MakePlan;
pub use planner_args::PlannerArgs;
pub use validate::Validate;
