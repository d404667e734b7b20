//! The change log of a plan that several refiners work on.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::lacam::lns::time_table::Path;
use crate::problem::Agent;

/// New paths of some agents.
#[derive(Debug)]
pub(crate) struct PathChange {
    pub agents: Vec<Agent>,
    pub paths: Vec<Path>,
}

/// All changes to a plan, in order. A log with a single worker stays empty.
#[derive(Debug)]
pub(crate) struct ChangeLog {
    is_alone: bool,
    num_changes: AtomicUsize,
    changes: Mutex<Vec<Arc<PathChange>>>,
}

impl ChangeLog {
    /// Creates an empty log.
    pub fn new(is_alone: bool) -> Self {
        Self { is_alone, num_changes: AtomicUsize::new(0), changes: Mutex::new(Vec::new()) }
    }

    /// Appends a change to the plan after `seen` changes. Returns the new number of changes, or `None` if the log holds
    /// changes that the worker has not seen.
    pub fn publish(&self, agents: &[Agent], paths: &[Path], seen: usize) -> Option<usize> {
        if self.is_alone {
            return Some(seen);
        }
        let mut changes = self.changes.lock().unwrap_or_else(PoisonError::into_inner);
        if changes.len() != seen {
            return None;
        }
        changes.push(Arc::new(PathChange { agents: agents.to_vec(), paths: paths.to_vec() }));
        self.num_changes.store(changes.len(), Ordering::Release);
        Some(changes.len())
    }

    /// Returns the changes after the first `seen`.
    pub fn since(&self, seen: usize) -> Vec<Arc<PathChange>> {
        if self.is_alone || self.num_changes.load(Ordering::Acquire) == seen {
            return Vec::new();
        }
        let changes = self.changes.lock().unwrap_or_else(PoisonError::into_inner);
        changes[seen..].to_vec()
    }
}
