//! The outcome of planning.

use std::fmt;

use crate::plan::Plan;

/// The result of one call of a planner.
///
/// `lower_bound` is a lower bound on the sum of costs of any plan. Units: steps, summed over all agents. `best` is the
/// plan that came closest, if any; it is valid, but does not bring all agents to their goals.
#[derive(Clone, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the fields are described above")]
pub enum Outcome {
    /// A valid plan that brings all agents to their goals. If its sum of costs equals the lower bound, it is optimal.
    Solved { plan: Plan, lower_bound: u64 },
    /// The budget ran out.
    TimedOut { best: Option<Plan>, lower_bound: u64 },
    /// The planner gave up within the budget; another planner may find a plan.
    GaveUp { best: Option<Plan>, lower_bound: u64 },
    /// The planner proved that no plan exists. The reason states the proof in words.
    Impossible { reason: String },
}

impl Outcome {
    /// Returns the plan that solves the problem.
    pub fn solution(&self) -> Option<&Plan> {
        match self {
            Self::Solved { plan, .. } => Some(plan),
            _ => None,
        }
    }

    /// Returns the lower bound on the sum of costs, unless the problem is impossible.
    pub fn lower_bound(&self) -> Option<u64> {
        match *self {
            Self::Solved { lower_bound, .. }
            | Self::TimedOut { lower_bound, .. }
            | Self::GaveUp { lower_bound, .. } => Some(lower_bound),
            Self::Impossible { .. } => None,
        }
    }

    /// Returns the plan that solves the problem, or else the one that came closest.
    pub fn best(&self) -> Option<&Plan> {
        match self {
            Self::Solved { plan, .. } => Some(plan),
            Self::TimedOut { best, .. } | Self::GaveUp { best, .. } => best.as_ref(),
            Self::Impossible { .. } => None,
        }
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Solved { plan, lower_bound } => {
                let (cost, makespan) = (plan.sum_of_costs(), plan.makespan());
                write!(f, "solved: sum of costs {cost} (lower bound {lower_bound}), makespan {makespan}")
            }
            Self::TimedOut { lower_bound, .. } => write!(f, "timed out; sum of costs at least {lower_bound}"),
            Self::GaveUp { lower_bound, .. } => write!(f, "gave up; sum of costs at least {lower_bound}"),
            Self::Impossible { reason } => write!(f, "impossible: {reason}"),
        }
    }
}
