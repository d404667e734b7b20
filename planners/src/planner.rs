//! The interface of one-shot planners.

use crate::budget::Budget;
use crate::outcome::Outcome;
use crate::problem::Problem;

/// A planner of one-shot problems.
pub trait Planner: Send {
    /// Plans within a budget. Never panics, and stops soon after the budget is spent.
    fn plan(&mut self, problem: &Problem, budget: &Budget) -> Outcome;
}
