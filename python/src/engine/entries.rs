//! The methods of an environment for Python.

use std::sync::atomic::AtomicBool;

use numpy::PyArray2;
use pogema_core::{Environment, Error, Trace};
use pogema_maps::{GridConfig, Targets, foretold_from};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList};

use super::history::Change;
use super::step::Stepped;
use super::{Engine, Inner};
use crate::fields::Fields;
use crate::guard::guarded;
use crate::lists::{Pairs, infos, pairs};
use crate::{config, errors, interrupt, memory};

guarded! {
#[pymethods]
impl Engine {
    /// Makes an environment from the fields of a config.
    ///
    /// `registered` is the text of the map that `map_name` names, and `exact` selects exact occupancy. `num_retries`
    /// limits the further attempts to place the agents [default: POGEMA's].
    #[new]
    #[pyo3(signature = (config, registered=None, exact=false, num_retries=None))]
    fn new(
        py: Python<'_>,
        config: Fields,
        registered: Option<&str>,
        exact: bool,
        num_retries: Option<usize>,
    ) -> PyResult<Self> {
        let mut source = config::source(&config, registered).map_err(|error| errors::config(py, &error))?;
        if let Some(num_retries) = num_retries {
            source = source.with_retries(num_retries);
        }
        let time_limit = source.config().max_episode_steps;
        let inner = Inner::new(source, exact, time_limit).map_err(|error| errors::config(py, &error))?;
        Ok(Self::of(inner))
    }

    /// Begins an episode and returns the warnings of the instance source.
    ///
    /// A new config replaces the old one only if the reset succeeds.
    #[pyo3(signature = (config=None, registered=None))]
    fn reset(
        &self,
        py: Python<'_>,
        config: Option<Fields>,
        registered: Option<&str>,
    ) -> PyResult<Vec<String>> {
        self.lock(py)?.begin(py, config.as_ref(), registered)
    }

    /// Makes the field `seed` the seed of the episodes from the next reset on.
    ///
    /// The pools stay in the order into which resets have shuffled them.
    fn reseed(&self, py: Python<'_>, fields: Fields) -> PyResult<()> {
        let config = GridConfig::from_value(&fields.0).map_err(|error| errors::config(py, &error))?;
        self.lock(py)?.source.reseed(config.seed);
        Ok(())
    }

    /// Clears the counters of the metrics.
    fn clear_metrics(&self, py: Python<'_>) -> PyResult<()> {
        self.lock(py)?.episode.meters_mut().episode.reset();
        Ok(())
    }

    /// Plays one step and returns observations, rewards, terminated, truncated and infos.
    #[pyo3(signature = (actions, has_metrics=true))]
    fn step<'py>(
        &self,
        py: Python<'py>,
        actions: &Bound<'py, PyAny>,
        has_metrics: bool,
    ) -> PyResult<Stepped<'py>> {
        self.lock(py)?.play(py, actions, has_metrics)
    }

    /// Returns the observations of all agents, in the type that the config names.
    fn observe<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        self.lock(py)?.observe(py)
    }

    /// Returns a dictionary for each agent that says whether it is active.
    fn infos<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        infos(py, self.lock(py)?.episode.state().active)
    }

    /// Takes the last step back and returns whether there was one.
    fn step_back(&self, py: Python<'_>) -> PyResult<bool> {
        self.lock(py)?.step_back().map_err(|error| errors::call(py, &error))
    }

    /// Sets the number of steps that count towards the time limit so far.
    #[setter]
    fn set_elapsed(&self, py: Python<'_>, elapsed: u64) -> PyResult<()> {
        self.lock(py)?.set_elapsed(elapsed).map_err(|error| errors::call(py, &error))
    }

    /// Returns for each agent whether it is active.
    #[getter]
    fn active(&self, py: Python<'_>) -> PyResult<Vec<bool>> {
        Ok(self.lock(py)?.episode.state().active.to_vec())
    }

    /// Returns for each agent whether it was active and on its goal after the last move, before goals changed.
    #[getter]
    fn on_goal(&self, py: Python<'_>) -> PyResult<Vec<bool>> {
        Ok(self.lock(py)?.episode.state().on_goal.to_vec())
    }

    /// Returns what each agent did in the last step: `None` if it was not active, and 0 if its move was reverted.
    ///
    /// The list is empty before the first step of an episode, and after a step back.
    #[getter]
    fn executed(&self, py: Python<'_>) -> PyResult<Vec<Option<u8>>> {
        Ok(self.lock(py)?.executed.iter().map(|done| done.map(|action| action as u8)).collect())
    }

    /// Returns the state of each agent's generator of goals, or `None` if goals are not drawn.
    fn goal_generators(&self, py: Python<'_>) -> PyResult<Option<Vec<String>>> {
        self.lock(py)?.goal_generators().map_err(|error| errors::call(py, &error))
    }

    /// Sets the state of each agent's generator of goals.
    fn set_goal_generators(&self, py: Python<'_>, states: Vec<String>) -> PyResult<()> {
        self.lock(py)?.set_goal_generators(states).map_err(|error| errors::call(py, &error))
    }

    /// Returns the number of steps since the reset.
    #[getter]
    fn num_steps(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.lock(py)?.episode.num_steps())
    }

    /// Returns the size of the map without its border: rows, columns.
    #[getter]
    fn size(&self, py: Python<'_>) -> PyResult<(usize, usize)> {
        Ok(self.lock(py)?.episode.engine().size())
    }

    /// Returns the cell of each agent, with `shift` added to both coordinates.
    fn cells(&self, py: Python<'_>, shift: i64) -> PyResult<Pairs> {
        Ok(pairs(self.lock(py)?.episode.state().cells, shift))
    }

    /// Returns the start of each agent, with `shift` added to both coordinates.
    fn starts(&self, py: Python<'_>, shift: i64) -> PyResult<Pairs> {
        let inner = self.lock(py)?;
        Ok(inner.episode.instance().map_or_else(|_| Vec::new(), |instance| pairs(instance.starts(), shift)))
    }

    /// Returns the goal of each agent, with `shift` added to both coordinates.
    fn goals(&self, py: Python<'_>, shift: i64) -> PyResult<Pairs> {
        Ok(pairs(self.lock(py)?.episode.state().goals, shift))
    }

    /// Returns for each agent whether its goal was drawn since the reset.
    #[getter]
    fn is_drawn(&self, py: Python<'_>) -> PyResult<Vec<bool>> {
        Ok(self.lock(py)?.drawn.now().to_vec())
    }

    /// Returns the map with its border, 1 for an obstacle.
    ///
    /// Shape: `(height + 2 * radius, width + 2 * radius)`, uint8
    fn obstacles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u8>>> {
        let (padded, _, _) = self.lock(py)?.global(py)?;
        Ok(padded)
    }

    /// Returns the marked cells of the occupancy grid, in the coordinates of the map with its border.
    fn occupied(&self, py: Python<'_>) -> PyResult<Pairs> {
        let inner = self.lock(py)?;
        Ok(pairs(&inner.episode.engine().occupied(), inner.episode.config().radius as i64))
    }

    /// Returns whether the area beyond the wall is free.
    #[getter]
    fn is_free_outside(&self, py: Python<'_>) -> PyResult<bool> {
        Ok(self.lock(py)?.has_free_outside())
    }

    /// Returns the future goals of each agent as POGEMA foretells them.
    ///
    /// Returns `None` before the first reset, or if a list would never end.
    fn foretold_goals(&self, py: Python<'_>) -> PyResult<Option<Vec<Pairs>>> {
        let inner = self.lock(py)?;
        let (config, state, stop) = (inner.source.config(), inner.episode.state(), AtomicBool::new(false));
        let Ok(instance) = inner.episode.instance() else { return Ok(None) };
        let foretell = || foretold_from(config, instance, state.cells, state.goals, &stop);
        let num_steps = usize::try_from(config.max_episode_steps).unwrap_or(0);
        let num_goals = num_steps.saturating_mul(state.cells.len());
        if !matches!(config.targets_xy, Some(Targets::Sequences(_))) {
            let bytes = memory::of_goals(num_steps, state.cells.len());
            memory::check("the list of goals", bytes).map_err(|error| errors::memory(&error))?;
        }
        let goals = if num_goals < interrupt::LONG {
            foretell()
        } else {
            interrupt::detach_scoped(py, &stop, foretell)?
        };
        Ok(goals.map(|goals| goals.iter().map(|goals| pairs(goals, 0)).collect()))
    }

    /// Returns the pools in the order into which resets have shuffled them.
    fn pools(&self, py: Python<'_>) -> PyResult<Option<(Pairs, Pairs)>> {
        Ok(self.lock(py)?.source.pools().map(|(starts, goals)| (pairs(starts, 0), pairs(goals, 0))))
    }

    /// Returns for each agent its first state and each later state that differs from the one before.
    ///
    /// A state holds row, column, goal's row and column, step, whether the agent is active, and whether the goal was
    /// drawn.
    fn history(&self, py: Python<'_>) -> PyResult<Vec<Vec<Change>>> {
        Ok(self.lock(py)?.history())
    }

    /// Returns whether the episodes from the next reset on are recorded.
    #[getter]
    fn is_filmed(&self, py: Python<'_>) -> PyResult<bool> {
        Ok(self.lock(py)?.is_filmed)
    }

    /// Sets whether the episodes from the next reset on are recorded.
    fn film(&self, py: Python<'_>, is_wanted: bool) -> PyResult<()> {
        self.lock(py)?.is_filmed = is_wanted;
        Ok(())
    }

    /// Measures density and collisions, in addition to other metrics, in the episodes from the next reset on.
    fn measure(&self, py: Python<'_>) -> PyResult<()> {
        self.lock(py)?.is_measured = true;
        Ok(())
    }

    /// Draws the recorded episode as an animated SVG, or one frame of it.
    #[pyo3(signature = (egocentric=None, static_frame=None, show_agents=true, show_lines=true, show_numbers=false))]
    fn draw_svg(
        &self,
        py: Python<'_>,
        egocentric: Option<usize>,
        static_frame: Option<usize>,
        show_agents: bool,
        show_lines: bool,
        show_numbers: bool,
    ) -> PyResult<String> {
        let style = pogema_render::Style {
            egocentric,
            static_frame,
            show_agents,
            show_lines,
            show_numbers,
            ..Default::default()
        };
        let trace = self.trace(py)?;
        drawn_by(py, move || pogema_render::svg::draw(&trace, &style))
    }

    /// Supports pickling and copying: returns the restoring function and the bytes to pass to it.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let saved = self.lock(py)?.save(py)?;
        Ok((py.import("pogema_rs._engine")?.getattr("restore_engine")?, (saved,)))
    }

    /// Packs the recorded episode for a page with many replays.
    fn pack_film(&self, py: Python<'_>) -> PyResult<String> {
        let trace = self.trace(py)?;
        drawn_by(py, move || pogema_render::html::pack(&trace))
    }

    /// Draws the recorded episode as a page that replays it.
    fn draw_html(&self, py: Python<'_>, title: &str) -> PyResult<String> {
        let (trace, title) = (self.trace(py)?, title.to_owned());
        drawn_by(py, move || pogema_render::html::replay(&trace, &title))
    }
}
}

impl Engine {
    /// Returns the recorded episode; other threads may use the environment while the episode is drawn.
    fn trace(&self, py: Python<'_>) -> PyResult<Trace> {
        self.lock(py)?.episode.trace().map_err(|error| errors::call(py, &error))
    }
}

fn drawn_by(
    py: Python<'_>,
    draw: impl FnOnce() -> Result<String, Error> + Send + 'static,
) -> PyResult<String> {
    interrupt::detach(py, draw)?.map_err(|error| errors::call(py, &error))
}
