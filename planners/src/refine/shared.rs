//! What refiners that work side by side on one plan tell each other.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::refine::reservations::Path;
use crate::stepper::Agent;

/// New paths of some agents.
#[derive(Debug)]
pub(crate) struct Change {
    pub agents: Vec<Agent>,
    pub paths: Vec<Path>,
}

/// All changes to a plan, in order; nothing is kept for one who works alone.
#[derive(Debug)]
pub(crate) struct Shared {
    is_alone: bool,
    num_changes: AtomicUsize,
    changes: Mutex<Vec<Arc<Change>>>,
}

impl Shared {
    /// No changes yet.
    pub fn new(is_alone: bool) -> Self {
        Self { is_alone, num_changes: AtomicUsize::new(0), changes: Mutex::new(Vec::new()) }
    }

    /// Enters a change made to the plan after so many; how many there are then, or none if there were more before.
    pub fn publish(&self, agents: &[Agent], paths: &[Path], seen: usize) -> Option<usize> {
        if self.is_alone {
            return Some(seen);
        }
        let mut changes = self.changes.lock().unwrap_or_else(PoisonError::into_inner);
        if changes.len() != seen {
            return None;
        }
        changes.push(Arc::new(Change { agents: agents.to_vec(), paths: paths.to_vec() }));
        self.num_changes.store(changes.len(), Ordering::Release);
        Some(changes.len())
    }

    /// The changes after so many.
    pub fn since(&self, seen: usize) -> Vec<Arc<Change>> {
        if self.is_alone || self.num_changes.load(Ordering::Acquire) == seen {
            return Vec::new();
        }
        let changes = self.changes.lock().unwrap_or_else(PoisonError::into_inner);
        changes[seen..].to_vec()
    }
}
