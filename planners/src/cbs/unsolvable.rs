//! The check for unsolvable problems, on which CBS alone would not terminate.

use crate::budget::Clock;
use crate::joint::reachability::{Reachability, reachability};
use crate::problem::Problem;

/// Stops searches of unsolvable problems, where joint states are few enough to prove it.
#[derive(Debug, Default)]
pub(crate) struct UnsolvabilityCheck {
    num_nodes: u64,
}

impl UnsolvabilityCheck {
    /// Nodes of the constraint tree before the check.
    const AFTER: u64 = 100;
    /// The limit on joint states.
    const MAX_STATES: usize = 100_000;

    /// Counts a node, and runs the check once. Returns why there is no plan, if it is proved.
    pub(crate) fn count(&mut self, problem: &Problem, clock: &mut Clock) -> Option<String> {
        self.num_nodes += 1;
        if self.num_nodes == Self::AFTER { Self::run(problem, clock) } else { None }
    }

    /// Returns why there is no plan, if the joint search proves it.
    pub(crate) fn run(problem: &Problem, clock: &mut Clock) -> Option<String> {
        let has_none = reachability(problem, Self::MAX_STATES, clock) == Reachability::Unreachable;
        has_none.then(|| "the agents cannot pass each other, whatever they do".to_owned())
    }
}
