//! LaCAM* as a planner.

use crate::budget::Budget;
use crate::lacam::params::LacamParams;
use crate::lacam::run::PlanCall;
use crate::outcome::Outcome;
use crate::planner::Planner;
use crate::problem::Problem;

/// The planner LaCAM*. Its node budget counts configurations and refinement attempts.
#[derive(Clone, Debug, Default)]
pub struct Lacam {
    params: LacamParams,
}

impl Lacam {
    /// Creates a planner with these parameters.
    pub fn new(params: LacamParams) -> Self {
        Self { params }
    }
}

impl Planner for Lacam {
    fn plan(&mut self, problem: &Problem, budget: &Budget) -> Outcome {
        problem.solve(budget, |costs, clock| PlanCall::new(&self.params, problem, costs, budget, clock).run())
    }
}
