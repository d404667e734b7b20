//! A step of an episode, and its results.

use pogema_core::{Action, Error, Metrics, OnGoal, State, counted};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use super::Inner;
use crate::errors;
use crate::lists::{infos, read_actions, type_error};

/// Observations, rewards, terminated, truncated and infos of a step.
pub type Stepped<'py> = (Bound<'py, PyList>, Vec<f64>, Vec<bool>, Vec<bool>, Bound<'py, PyList>);

impl Inner {
    /// Plays one step.
    pub(super) fn play<'py>(
        &mut self,
        py: Python<'py>,
        actions: &Bound<'py, PyAny>,
        has_metrics: bool,
    ) -> PyResult<Stepped<'py>> {
        let num_agents = self.episode.config().num_agents;
        let got = actions.len().map_err(|error| {
            type_error(error, actions, "actions", &format!("a list of {}", counted(num_agents, "action")))
        })?;
        let fits = Error::check_length("actions", num_agents, got);
        fits.map_err(|error| errors::call(py, &error))?;
        self.check_started(py)?;
        let active = self.episode.state().active;
        if let Some((agent, number)) = read_actions(actions, active, &mut self.actions)? {
            let error = Error::Action { agent: Some(agent), number };
            return Err(errors::call(py, &error));
        }
        self.note_intended();
        // INVARIANT: after the checks above, the step cannot fail, so the notes are those of this step.
        let (episode, actions) = (&mut self.episode, &self.actions);
        py.detach(|| episode.step(actions)).map_err(|error| errors::call(py, &error))?;
        self.note_goals();
        self.note_reverted();
        let infos = infos(py, self.episode.state().active)?;
        if let Some(metrics) = self.metrics(has_metrics) {
            infos.get_item(0)?.set_item("metrics", self.named(py, &metrics)?)?;
        }
        let rewards = self.episode.rewards().iter().map(|&reward| f64::from(reward)).collect();
        self.warn_of_wraps(py)?;
        let (terminated, truncated) = (self.episode.terminated().to_vec(), self.episode.truncated().to_vec());
        Ok((self.observe(py)?, rewards, terminated, truncated, infos))
    }

    /// Records the intended action of each active agent, and the cells before the step.
    fn note_intended(&mut self) {
        let State { cells, active, .. } = self.episode.state();
        self.before.clear();
        self.before.extend_from_slice(cells);
        self.executed.clear();
        let intended =
            self.actions.iter().zip(active).map(|(&action, is_active)| is_active.then_some(action));
        self.executed.extend(intended);
    }

    /// Records which agents did not move.
    ///
    /// Rule: collide/soft/rewrite
    fn note_reverted(&mut self) {
        let cells = self.episode.state().cells.iter().zip(&self.before);
        for (done, (now, before)) in self.executed.iter_mut().zip(cells) {
            if now == before {
                *done = done.map(|_| Action::Stay);
            }
        }
    }

    pub(super) fn check_started(&self, py: Python<'_>) -> PyResult<()> {
        self.episode.instance().map(|_| ()).map_err(|error| errors::call(py, &error))
    }

    /// Returns the metrics if the last step ended the episode; without `has_metrics` only density and collisions.
    fn metrics(&self, has_metrics: bool) -> Option<Metrics> {
        let metrics = self.episode.is_over().then(|| self.episode.metrics())?;
        if has_metrics {
            return Some(metrics);
        }
        let Metrics { avg_agents_density, a_collisions, o_collisions, .. } = metrics;
        let measured = Metrics { avg_agents_density, a_collisions, o_collisions, ..Metrics::default() };
        (measured != Metrics::default()).then_some(measured)
    }

    /// Returns metrics under POGEMA's names, as integers where POGEMA's are integers.
    fn named<'py>(&self, py: Python<'py>, metrics: &Metrics) -> PyResult<Bound<'py, PyDict>> {
        let named = PyDict::new(py);
        let is_nothing = self.episode.config().on_goal == OnGoal::Nothing;
        for (name, value) in metrics.named() {
            let is_count = matches!(name, "a_collisions" | "o_collisions");
            if is_count || is_nothing && matches!(name, "ep_length" | "SoC" | "makespan") {
                named.set_item(name, value as u64)?;
            } else {
                named.set_item(name, value)?;
            }
        }
        Ok(named)
    }
}
