//! CBS as a planner.

use crate::budget::Budget;
use crate::cbs::independence::Groups;
use crate::cbs::search::CbsParams;
use crate::outcome::Outcome;
use crate::planner::Planner;
use crate::problem::Problem;

/// The planner CBS, which is optimal. Its node budget counts nodes of the constraint tree.
///
/// If an impossible problem is small or has a step limit, the planner proves that it is impossible; otherwise it
/// searches until the budget is spent or the byte budget is exceeded.
#[derive(Clone, Debug, Default)]
pub struct Cbs {
    params: CbsParams,
}

impl Cbs {
    /// Creates a planner with these parameters.
    pub fn new(params: CbsParams) -> Self {
        Self { params }
    }
}

impl Planner for Cbs {
    fn plan(&mut self, problem: &Problem, budget: &Budget) -> Outcome {
        problem.solve(budget, |costs, mut clock| {
            if clock.count_node() {
                return clock.unsolved(None, problem.lower_bound(costs));
            }
            Groups::new(problem, costs, &self.params).plan(&mut clock)
        })
    }
}
