//! The budget of a planner: time, nodes, cancellation.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::outcome::Outcome;
use crate::plan::Plan;

/// The budget of one call of a planner; by default unlimited.
#[derive(Clone, Debug, Default)]
pub struct Budget {
    /// Wall-clock time.
    pub time: Option<Duration>,
    /// Nodes of the search; each planner documents what a node is. On one thread, the same number gives the same plan.
    pub nodes: Option<u64>,
    /// A flag that makes the planner stop soon after any thread sets it.
    pub cancelled: Option<Arc<AtomicBool>>,
}

impl Budget {
    /// The range of [`Budget::time_from`], for messages.
    pub const SECONDS: &str = "0 to 1e19 seconds";

    /// Returns a number of seconds as a wall-clock time, or `None` if it is out of range.
    pub fn time_from(seconds: f64) -> Option<Duration> {
        Duration::try_from_secs_f64(seconds).ok().filter(|_| seconds <= 1e19)
    }

    /// Creates a budget of wall-clock time.
    pub fn of_time(time: Duration) -> Self {
        Self { time: Some(time), ..Self::default() }
    }

    /// Creates a budget of nodes.
    pub fn of_nodes(nodes: u64) -> Self {
        Self { nodes: Some(nodes), ..Self::default() }
    }

    /// Returns whether a thread has cancelled the work.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    /// Starts the clock of this budget.
    pub(crate) fn start(&self) -> Clock {
        Clock { budget: self.clone(), started: Instant::now(), num_nodes: 0, is_spent: false }
    }
}

/// A running budget.
#[derive(Debug)]
pub(crate) struct Clock {
    budget: Budget,
    started: Instant,
    num_nodes: u64,
    is_spent: bool,
}

impl Clock {
    /// Nodes between two reads of the time.
    const STRIDE: u64 = 16;

    /// Counts a node; returns whether the budget is spent, in which case this node must not be expanded.
    pub fn count_node(&mut self) -> bool {
        if self.budget.nodes.is_some_and(|nodes| self.num_nodes >= nodes) {
            self.is_spent = true;
        }
        let reads_time = self.num_nodes.is_multiple_of(Self::STRIDE);
        self.num_nodes += 1;
        self.is_spent || (reads_time && self.is_spent())
    }

    /// Reads the time; returns whether the budget is spent.
    pub fn is_spent(&mut self) -> bool {
        let is_late = self.budget.time.is_some_and(|time| self.started.elapsed() >= time);
        self.is_spent |= is_late || self.budget.is_cancelled();
        self.is_spent
    }

    /// Returns the outcome of a planner that found no solution.
    pub fn unsolved(&mut self, best: Option<Plan>, lower_bound: u64) -> Outcome {
        if self.is_spent() {
            Outcome::TimedOut { best, lower_bound }
        } else {
            Outcome::GaveUp { best, lower_bound }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_report_spent_budgets() {
        let mut clock = Budget::of_nodes(2).start();
        assert_eq!([clock.count_node(), clock.count_node(), clock.count_node()], [false, false, true]);
        assert!(Budget::of_nodes(0).start().count_node());
        assert!(Budget::of_time(Duration::ZERO).start().count_node());
        let flag = Arc::new(AtomicBool::new(true));
        let mut clock = Budget { cancelled: Some(flag), ..Budget::default() }.start();
        assert!(clock.count_node());
        assert!(!Budget::default().start().count_node());
    }
}
