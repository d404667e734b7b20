//! The figures of an episode for which every step has to be seen.

use pogema_core::Error;
use pyo3::prelude::*;

use crate::engine::Engine;
use crate::errors;
use crate::lists::read_actions;

/// Sees every step of an environment.
#[pyclass(module = "pogema_rs._engine")]
#[derive(Default)]
pub struct Witness(pogema_toolbox::Witness);

#[pymethods]
impl Witness {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Begins with an environment that was just reset.
    fn begin(&mut self, py: Python<'_>, engine: &Engine) -> PyResult<()> {
        self.0.begin(&engine.game).map_err(|error| errors::call(py, &error))
    }

    /// Looks at it before a step.
    fn before(&mut self, engine: &Engine) {
        self.0.before(&engine.game);
    }

    /// Looks at it after the step of some actions.
    fn after(&mut self, py: Python<'_>, engine: &Engine, actions: &Bound<'_, PyAny>) -> PyResult<()> {
        let no_episode = || Error::State { reason: "the environment was not reset yet".into() };
        let instance = engine.instance.as_ref().ok_or_else(|| errors::call(py, &no_episode()))?;
        let mut read = Vec::new();
        // INVARIANT: the step took these actions, so that all are some.
        read_actions(actions, self.0.active(), &mut read)?;
        self.0.after(&engine.game, instance.map(), &read).map_err(|error| errors::call(py, &error))
    }

    /// Agents per free cell of a window, the mean over agents and time; and moves that another agent, or an obstacle,
    /// prevented.
    fn figures(&self) -> (f64, u64, u64) {
        let collisions = self.0.collisions();
        (self.0.density(), collisions.with_agents, collisions.with_obstacles)
    }
}
