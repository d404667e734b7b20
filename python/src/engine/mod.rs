//! One environment behind POGEMA's Python classes.

mod drawn;
mod observe;
pub mod state;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use numpy::PyArray2;
use pogema_core::{
    Action, CollisionMeter, Config, DensityMeter, Environment, Episode, Error, Instance, LARGEST_STEP,
    Metrics, Observation, Occupancy, OnGoal, Outside, Trace,
};
use pogema_maps::{GridConfig, InstanceSource, foretold_from};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};

use self::drawn::Drawn;
use crate::fields::Fields;
use crate::guard::guarded;
use crate::lists::{Pairs, infos, pairs, read_actions};
use crate::{config, errors, interrupt, memory};

/// Row, column, goal's row and column, step, whether the agent is active, whether the goal was drawn.
type Change = (u16, u16, u16, u16, u64, bool, bool);
/// Observations, rewards, terminated, truncated and infos of a step.
type Stepped<'py> = (Bound<'py, PyList>, Vec<f64>, Vec<bool>, Vec<bool>, Bound<'py, PyList>);

/// An environment with its config.
#[pyclass(module = "pogema_rs._engine")]
pub struct Engine {
    pub(crate) source: InstanceSource,
    pub(crate) exact: bool,
    /// Steps after which an episode is truncated; a later config does not change this limit.
    pub(crate) time_limit: i64,
    pub(crate) episode: Episode<pogema_fast::Engine>,
    /// Whether the episodes from the next reset on are recorded.
    pub(crate) is_filmed: bool,
    /// Whether density and collisions are measured in the episodes from the next reset on.
    pub(crate) is_measured: bool,
    pub(crate) drawn: Drawn,
    actions: Vec<Action>,
}

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
        Self::of(source, exact, time_limit).map_err(|error| errors::config(py, &error))
    }

    /// Begins an episode and returns the warnings of the instance source.
    ///
    /// A new config replaces the old one only if the reset succeeds.
    #[pyo3(signature = (config=None, registered=None))]
    fn reset(
        this: &Bound<'_, Self>,
        config: Option<Fields>,
        registered: Option<&str>,
    ) -> PyResult<Vec<String>> {
        let py = this.py();
        let mut this = this.try_borrow_mut().map_err(|_| errors::busy(py))?;
        this.begin(py, config.as_ref(), registered)
    }

    /// Sets the seed for the episodes from the next reset on to the field `seed`.
    ///
    /// The pools stay in the order to which resets have shuffled them.
    fn reseed(&mut self, py: Python<'_>, fields: Fields) -> PyResult<()> {
        let config = GridConfig::from_value(&fields.0).map_err(|error| errors::config(py, &error))?;
        self.source.reseed(config.seed);
        Ok(())
    }

    /// Clears the counters of the metrics.
    fn clear_metrics(&mut self) -> PyResult<()> {
        self.episode.meters_mut().episode.reset();
        Ok(())
    }

    /// Plays one step and returns observations, rewards, terminated, truncated and infos.
    #[pyo3(signature = (actions, has_metrics=true))]
    fn step<'py>(
        this: &Bound<'py, Self>,
        actions: &Bound<'py, PyAny>,
        has_metrics: bool,
    ) -> PyResult<Stepped<'py>> {
        let py = this.py();
        let mut this = this.try_borrow_mut().map_err(|_| errors::busy(py))?;
        this.play(py, actions, has_metrics)
    }

    /// Returns the observations of all agents, in the type that the config names.
    fn observe<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        self.check_started(py)?;
        match self.episode.config().observation {
            Observation::Default => self.observe_default(py),
            Observation::Pomapf => self.observe_apart(py, false),
            Observation::Mapf => self.observe_apart(py, true),
        }
    }

    /// Returns a dictionary for each agent that says whether it is active.
    fn infos<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        infos(py, self.episode.state().active)
    }

    /// Takes the last step back and returns whether there was one.
    fn step_back(this: &Bound<'_, Self>) -> PyResult<bool> {
        let py = this.py();
        let mut this = this.try_borrow_mut().map_err(|_| errors::busy(py))?;
        let Self { episode, drawn, .. } = &mut *this;
        let last_two = episode.past().len().saturating_sub(2);
        let before = episode.past()[last_two..].to_vec();
        let went_back = episode.step_back().map_err(|error| errors::call(py, &error))?;
        if went_back {
            drawn.take_back(&before);
        }
        Ok(went_back)
    }

    /// Sets the number of steps that count towards the time limit so far.
    #[setter]
    fn set_elapsed(&mut self, py: Python<'_>, elapsed: u64) -> PyResult<()> {
        if self.episode.instance().is_err() {
            return Ok(());
        }
        let state = self.episode.snapshot();
        // No episode is longer, and the count must not overflow.
        let restored = self.episode.engine_mut().restore(elapsed.min(LARGEST_STEP), &state);
        restored.map_err(|error| errors::call(py, &error))
    }

    /// Returns for each agent whether it is active.
    #[getter]
    fn active(&self) -> PyResult<Vec<bool>> {
        Ok(self.episode.state().active.to_vec())
    }

    /// Returns for each agent whether it was active and on its goal after the last move, before goals changed.
    #[getter]
    fn on_goal(&self) -> PyResult<Vec<bool>> {
        Ok(self.episode.state().on_goal.to_vec())
    }

    /// Returns the number of steps since the reset.
    #[getter]
    fn num_steps(&self) -> PyResult<u64> {
        Ok(self.episode.num_steps())
    }

    /// Returns the size of the map without its border: rows, columns.
    #[getter]
    fn size(&self) -> PyResult<(usize, usize)> {
        Ok(self.episode.engine().size())
    }

    /// Returns the cell of each agent, with `shift` added to both coordinates.
    fn cells(&self, shift: i64) -> PyResult<Pairs> {
        Ok(pairs(self.episode.state().cells, shift))
    }

    /// Returns the start of each agent, with `shift` added to both coordinates.
    fn starts(&self, shift: i64) -> PyResult<Pairs> {
        Ok(self.episode.instance().map_or_else(|_| Vec::new(), |instance| pairs(instance.starts(), shift)))
    }

    /// Returns the goal of each agent, with `shift` added to both coordinates.
    fn goals(&self, shift: i64) -> PyResult<Pairs> {
        Ok(pairs(self.episode.state().goals, shift))
    }

    /// Returns for each agent whether its goal was drawn since the reset.
    #[getter]
    fn is_drawn(&self) -> PyResult<Vec<bool>> {
        Ok(self.drawn.now().to_vec())
    }

    /// Returns the map with its border, 1 for an obstacle.
    ///
    /// Shape: `(height + 2 * radius, width + 2 * radius)`, uint8
    fn obstacles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u8>>> {
        let (padded, _, _) = self.global(py)?;
        Ok(padded)
    }

    /// Returns the marked cells of the occupancy grid, in the coordinates of the map with its border.
    fn occupied(&self) -> PyResult<Pairs> {
        Ok(pairs(&self.episode.engine().occupied(), self.episode.config().radius as i64))
    }

    /// Returns whether the area beyond the wall is free.
    #[getter]
    fn is_free_outside(&self) -> PyResult<bool> {
        Ok(self.has_free_outside())
    }

    /// Returns the future goals of each agent as POGEMA predicts them, or `None` if the list would be infinite.
    fn foretold_goals(&self) -> PyResult<Option<Vec<Pairs>>> {
        let state = self.episode.state();
        let goals = self.episode.instance().ok().and_then(|instance| {
            foretold_from(self.source.config(), instance, state.cells, state.goals)
        });
        Ok(goals.map(|goals| goals.iter().map(|goals| pairs(goals, 0)).collect()))
    }

    /// Returns the pools in the order to which resets have shuffled them.
    fn pools(&self) -> PyResult<Option<(Pairs, Pairs)>> {
        Ok(self.source.pools().map(|(starts, goals)| (pairs(starts, 0), pairs(goals, 0))))
    }

    /// Returns for each agent its first state and each later state that differs from the one before.
    ///
    /// A state holds row, column, goal's row and column, step, whether the agent is active, and whether the goal was
    /// drawn.
    fn history(&self) -> PyResult<Vec<Vec<Change>>> {
        let changes = pogema_core::changes(self.episode.past());
        let of_agent = |(agent, changes): (usize, Vec<pogema_core::Change>)| {
            let is_drawn = self.drawn.kept(agent).iter().chain(std::iter::repeat(&false));
            let change = |(change, &is_drawn): (pogema_core::Change, &bool)| {
                let pogema_core::Change { cell, goal, step, active } = change;
                (cell.row, cell.col, goal.row, goal.col, step, active, is_drawn)
            };
            changes.into_iter().zip(is_drawn).map(change).collect()
        };
        Ok(changes.into_iter().enumerate().map(of_agent).collect())
    }

    /// Sets whether the episodes from the next reset on are recorded.
    fn film(&mut self, is_wanted: bool) -> PyResult<()> {
        self.is_filmed = is_wanted;
        Ok(())
    }

    /// Measures density and collisions, in addition to other metrics, in the episodes from the next reset on.
    fn measure(&mut self) -> PyResult<()> {
        self.is_measured = true;
        Ok(())
    }

    /// Draws the recorded episode as an animated SVG, or one frame of it.
    #[pyo3(signature = (egocentric=None, static_frame=None, show_agents=true, show_lines=true))]
    fn draw_svg(
        &self,
        py: Python<'_>,
        egocentric: Option<usize>,
        static_frame: Option<usize>,
        show_agents: bool,
        show_lines: bool,
    ) -> PyResult<String> {
        let style =
            pogema_render::Style { egocentric, static_frame, show_agents, show_lines, ..Default::default() };
        self.drawn_by(py, move |trace| pogema_render::svg::draw(trace, &style))
    }

    /// Supports pickling and copying: returns the restoring function and the bytes to pass to it.
    fn __reduce__<'py>(this: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let py = this.py();
        let engine = this.try_borrow().map_err(|_| errors::busy(py))?;
        Ok((py.import("pogema_rs._engine")?.getattr("restore_engine")?, (state::save(&engine, py)?,)))
    }

    /// Packs the recorded episode for a page with many replays.
    fn pack_film(&self, py: Python<'_>) -> PyResult<String> {
        self.drawn_by(py, pogema_render::html::pack)
    }

    /// Draws the recorded episode as a page that replays it.
    fn draw_html(&self, py: Python<'_>, title: &str) -> PyResult<String> {
        let title = title.to_owned();
        self.drawn_by(py, move |trace| pogema_render::html::replay(trace, &title))
    }
}
}

impl Engine {
    /// Makes an environment that needs a reset before its first step.
    pub(crate) fn of(source: InstanceSource, exact: bool, time_limit: i64) -> Result<Self, Error> {
        let rules = rules(&source, exact, time_limit);
        Ok(Self {
            source,
            exact,
            time_limit,
            episode: Episode::new(pogema_fast::Engine::new(rules)?),
            is_filmed: false,
            is_measured: false,
            drawn: Drawn::default(),
            actions: Vec::with_capacity(rules.num_agents),
        })
    }

    pub(crate) fn has_free_outside(&self) -> bool {
        self.episode.instance().map_or(true, |instance| *instance.outside() == Outside::Free)
    }

    /// Draws the recorded episode with `draw`.
    fn drawn_by(
        &self,
        py: Python<'_>,
        draw: impl FnOnce(&Trace) -> Result<String, Error> + Send + 'static,
    ) -> PyResult<String> {
        let trace = self.episode.trace().map_err(|error| errors::call(py, &error))?;
        interrupt::detach(py, move || draw(&trace))?.map_err(|error| errors::call(py, &error))
    }

    fn begin(
        &mut self,
        py: Python<'_>,
        config: Option<&Fields>,
        registered: Option<&str>,
    ) -> PyResult<Vec<String>> {
        let mut source = match config {
            Some(config) => config::source(config, registered).map_err(|error| errors::config(py, &error))?,
            None => self.source.clone(),
        };
        let bytes = memory::of_environments(source.config(), 1);
        memory::check("the environment", bytes).map_err(|error| errors::memory(&error))?;
        let stop = Arc::<AtomicBool>::default();
        source = source.cancelled_by(&stop);
        let num_cells = source.num_cells_drawn();
        let generate = move || source.generate().map(|generated| (source, generated));
        let generated = if num_cells < interrupt::LONG {
            py.detach(generate)
        } else {
            interrupt::detach(py, generate).inspect_err(|_| stop.store(true, Relaxed))?
        };
        let (source, generated) = generated.map_err(|error| errors::instance(py, &error))?;
        let rules = rules(&source, self.exact, self.time_limit);
        self.start(rules, generated.instance).map_err(|error| match error {
            Error::Config { .. } | Error::CellOutside { .. } => errors::config(py, &error),
            _ => errors::instance(py, &error),
        })?;
        self.episode.meters_mut().episode.measure_over(source.config().max_episode_steps);
        self.source = source;
        self.drawn.begin(rules.num_agents, rules.persistent);
        Ok(generated.warnings)
    }

    /// Starts an episode, on the same engine if the rules have not changed.
    ///
    /// POGEMA 1.4.0 does not clear its metrics at a reset, so the counters carry over.
    fn start(&mut self, rules: Config, instance: Instance) -> Result<(), Error> {
        let counted = self.episode.meters().episode.clone();
        let mut fresh = if rules == *self.episode.config() {
            None
        } else {
            Some(Episode::new(pogema_fast::Engine::new(rules)?))
        };
        let episode = fresh.as_mut().unwrap_or(&mut self.episode);
        episode.record(self.is_filmed);
        if self.is_measured {
            let meters = episode.meters_mut();
            meters.density.get_or_insert_with(DensityMeter::default);
            meters.collisions.get_or_insert_with(CollisionMeter::default);
        }
        episode.start(instance)?;
        if counted.num_agents() == rules.num_agents {
            episode.meters_mut().episode = counted;
        }
        if let Some(episode) = fresh {
            self.episode = episode;
        }
        Ok(())
    }

    fn play<'py>(
        &mut self,
        py: Python<'py>,
        actions: &Bound<'py, PyAny>,
        has_metrics: bool,
    ) -> PyResult<Stepped<'py>> {
        let (num_agents, got) = (self.episode.config().num_agents, actions.len()?);
        let fits = Error::check_length("actions", num_agents, got);
        fits.map_err(|error| errors::call(py, &error))?;
        self.check_started(py)?;
        let active = self.episode.state().active;
        if let Some((agent, number)) = read_actions(actions, active, &mut self.actions)? {
            let error = Error::Action { agent: Some(agent), number };
            return Err(errors::call(py, &error));
        }
        let (episode, actions) = (&mut self.episode, &self.actions);
        py.detach(|| episode.step(actions)).map_err(|error| errors::call(py, &error))?;
        self.note_goals();
        let infos = infos(py, self.episode.state().active)?;
        if let Some(metrics) = self.metrics(has_metrics) {
            infos.get_item(0)?.set_item("metrics", self.named(py, &metrics)?)?;
        }
        let rewards = self.episode.rewards().iter().map(|&reward| f64::from(reward)).collect();
        self.warn_of_turns(py)?;
        let (terminated, truncated) = (self.episode.terminated().to_vec(), self.episode.truncated().to_vec());
        Ok((self.observe(py)?, rewards, terminated, truncated, infos))
    }

    pub(crate) fn check_started(&self, py: Python<'_>) -> PyResult<()> {
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

fn rules(source: &InstanceSource, exact: bool, time_limit: i64) -> Config {
    let rules = source.config().rules();
    let occupancy = if exact { Occupancy::Exact } else { rules.occupancy };
    Config { max_steps: time_limit, occupancy, ..rules }
}
