//! One environment behind POGEMA's Python classes.

mod begin;
mod drawn;
mod entries;
mod generators;
mod history;
mod observe;
pub mod state;
mod step;

use std::sync::{Mutex, MutexGuard};

use pogema_core::{Action, Cell, Episode};
use pogema_maps::InstanceSource;
use pyo3::prelude::*;

use self::drawn::Drawn;
use crate::guard;

/// An environment with its config, as Python sees it.
///
/// No thread waits for the lock. While one thread makes a call, a call of another thread raises an error.
#[pyclass(frozen, module = "pogema_rs._engine")]
pub struct Engine {
    inner: Mutex<Inner>,
}

/// An environment with its config.
pub struct Inner {
    source: InstanceSource,
    exact: bool,
    /// Steps after which an episode is truncated; a later config does not change this limit.
    time_limit: i64,
    episode: Episode<pogema_fast::Engine>,
    /// Whether the episodes from the next reset on are recorded.
    is_filmed: bool,
    /// Whether density and collisions are measured in the episodes from the next reset on.
    is_measured: bool,
    drawn: Drawn,
    actions: Vec<Action>,
    /// What each agent did in the last step: nothing if it was not active, and `Stay` if its move was reverted.
    executed: Vec<Option<Action>>,
    /// The cells before the last step.
    before: Vec<Cell>,
}

impl Engine {
    fn of(inner: Inner) -> Self {
        Self { inner: Mutex::new(inner) }
    }

    /// Locks the environment.
    ///
    /// Errors: those of [`guard::lock`].
    fn lock(&self, py: Python<'_>) -> PyResult<MutexGuard<'_, Inner>> {
        guard::lock(py, &self.inner, "this environment")
    }
}
