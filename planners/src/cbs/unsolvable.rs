//! The check for unsolvable problems, on which CBS alone would not terminate.

use crate::budget::Clock;
use crate::joint::reachability::{Reachability, reachability};
use crate::problem::Problem;

/// The proof of a search that has expanded every node.
pub(crate) const EXHAUSTED: &str = "the search exhausted the constraint tree";

/// Detects that a problem is unsolvable, if its joint states are few enough to be searched.
#[derive(Debug, Default)]
pub(crate) struct UnsolvabilityCheck {
    num_nodes: u64,
}

impl UnsolvabilityCheck {
    /// Number of counted nodes at which the check runs.
    const AFTER: u64 = 100;
    /// The limit on joint states.
    const MAX_STATES: usize = 100_000;

    /// Returns a check that never runs, for problems that are known to be solvable.
    pub(crate) fn done() -> Self {
        Self { num_nodes: Self::AFTER }
    }

    /// Counts a node, and runs the check at node [`Self::AFTER`]. Returns the reason if it proves that no plan exists.
    pub(crate) fn count(&mut self, problem: &Problem, clock: &mut Clock) -> Option<String> {
        self.num_nodes += 1;
        if self.num_nodes == Self::AFTER { Self::run(problem, clock) } else { None }
    }

    /// Runs the joint search. Returns the reason if it proves that no plan exists.
    pub(crate) fn run(problem: &Problem, clock: &mut Clock) -> Option<String> {
        let is_unsolvable = reachability(problem, Self::MAX_STATES, clock) == Reachability::Unreachable;
        is_unsolvable.then(|| "no sequence of moves leads all agents to their goals".to_owned())
    }
}
