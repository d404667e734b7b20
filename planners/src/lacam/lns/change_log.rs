//! The change log of a plan that several refiners work on.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::lacam::lns::time_table::Path;
use crate::problem::Agent;

/// New paths of some agents.
#[derive(Debug)]
pub(crate) struct PathChange {
    pub agents: Vec<Agent>,
    pub paths: Vec<Path>,
}

/// The changes to a plan that at least one worker has not seen yet, in order. A log with a single worker stays empty.
#[derive(Debug)]
pub(crate) struct ChangeLog {
    is_alone: bool,
    /// Number of changes, including those that the log no longer holds.
    num_changes: AtomicUsize,
    entries: Mutex<Entries>,
}

#[derive(Debug, Default)]
struct Entries {
    changes: VecDeque<Arc<PathChange>>,
    /// Number of dropped changes, which precede `changes` and which all workers have seen.
    num_dropped: usize,
    /// For each worker, the number of changes that it has seen; `usize::MAX` if it has ended.
    seen: Vec<usize>,
}

/// A worker of a log. The log drops a change when all workers have seen it.
#[derive(Debug)]
pub(crate) struct Worker<'a> {
    log: &'a ChangeLog,
    index: usize,
    /// Number of changes that it has seen.
    num_seen: usize,
}

impl ChangeLog {
    /// Creates an empty log.
    pub fn new(is_alone: bool) -> Self {
        Self { is_alone, num_changes: AtomicUsize::new(0), entries: Mutex::default() }
    }

    /// Adds a worker, which will see all changes. Add all workers before the first change.
    pub fn worker(&self) -> Worker<'_> {
        let mut entries = self.lock();
        entries.seen.push(0);
        Worker { log: self, index: entries.seen.len() - 1, num_seen: 0 }
    }

    fn lock(&self) -> MutexGuard<'_, Entries> {
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Entries {
    /// Notes how many changes a worker has seen, and drops those that all workers have seen.
    fn update(&mut self, worker: usize, num_seen: usize) {
        self.seen[worker] = num_seen;
        let least = self.seen.iter().copied().min().unwrap_or(usize::MAX);
        let num_unneeded = least.saturating_sub(self.num_dropped).min(self.changes.len());
        self.changes.drain(..num_unneeded);
        self.num_dropped += num_unneeded;
    }
}

impl Worker<'_> {
    /// Appends a change of the plan to the log. If the worker has not seen all changes, appends nothing and returns
    /// false.
    pub fn publish(&mut self, agents: &[Agent], paths: &[Path]) -> bool {
        if self.log.is_alone {
            return true;
        }
        let mut entries = self.log.lock();
        if entries.num_dropped + entries.changes.len() != self.num_seen {
            return false;
        }
        entries.changes.push_back(Arc::new(PathChange { agents: agents.to_vec(), paths: paths.to_vec() }));
        self.num_seen += 1;
        entries.update(self.index, self.num_seen);
        self.log.num_changes.store(self.num_seen, Ordering::Release);
        true
    }

    /// Returns the changes that the worker has not seen.
    pub fn unseen(&mut self) -> Vec<Arc<PathChange>> {
        if self.log.is_alone || self.log.num_changes.load(Ordering::Acquire) == self.num_seen {
            return Vec::new();
        }
        let mut entries = self.log.lock();
        let unseen: Vec<_> = entries.changes.range(self.num_seen - entries.num_dropped..).cloned().collect();
        self.num_seen += unseen.len();
        entries.update(self.index, self.num_seen);
        unseen
    }
}

impl Drop for Worker<'_> {
    fn drop(&mut self) {
        self.log.lock().update(self.index, usize::MAX);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_log_drops_what_all_workers_have_seen() {
        let log = ChangeLog::new(false);
        let [mut one, mut other, ended] = [log.worker(), log.worker(), log.worker()];
        let num_held = || log.lock().changes.len();
        let change = |number: Agent| (vec![number], vec![vec![number]]);
        for number in 0..5 {
            let (agents, paths) = change(number);
            assert!(one.publish(&agents, &paths));
        }
        assert!(!other.publish(&[9], &[vec![9]]), "the worker has not seen all changes");
        assert_eq!(other.unseen().iter().map(|change| change.agents[0]).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
        assert_eq!(num_held(), 5);
        drop(ended);
        assert_eq!(num_held(), 0);
        for number in 0..1000 {
            let (agents, paths) = change(number);
            let (writer, reader) =
                if number.is_multiple_of(2) { (&mut one, &mut other) } else { (&mut other, &mut one) };
            assert!(writer.publish(&agents, &paths));
            assert_eq!(num_held(), 1);
            let unseen = reader.unseen();
            assert_eq!((unseen.len(), &unseen[0].agents, &unseen[0].paths), (1, &agents, &paths));
            assert_eq!(num_held(), 0);
        }
    }
}
