//! The commands `plan` and `validate`, and the flags of planners.

mod make;
mod planner_args;
mod validate;

pub use make::MakePlan;
pub use planner_args::PlannerArgs;
pub use validate::Validate;
