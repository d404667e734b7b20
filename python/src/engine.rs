//! One environment behind POGEMA's Python classes.

use numpy::PyArray2;
use pogema_core::{
    Action, Cell, Config, Environment, EpisodeMeter, Error, Instance, Metrics, Observation, Occupancy,
    OnGoal, Outside, StepOut,
};
use pogema_maps::{InstanceSource, foretold_from};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};

use crate::drawn::Drawn;
use crate::film::Recorder;
use crate::lists::{Pairs, infos, read_actions};
use crate::{config, errors, state};

/// Row, column, goal's row and column, step, whether the agent takes part, whether the goal was drawn.
type Change = (u16, u16, u16, u16, u64, bool, bool);
/// What a step returns.
type Stepped<'py> = (Bound<'py, PyList>, Vec<f64>, Vec<bool>, Vec<bool>, Bound<'py, PyList>);

/// One environment with its config, its metrics and, if wanted, its film.
#[pyclass(module = "pogema_rs._engine")]
pub struct Engine {
    pub(crate) source: InstanceSource,
    pub(crate) exact: bool,
    /// Steps after which an episode is cut off, whatever a later config says.
    pub(crate) time_limit: i64,
    /// Steps that count towards the time limit.
    pub(crate) elapsed: u64,
    pub(crate) game: pogema_fast::Engine,
    pub(crate) instance: Option<Instance>,
    pub(crate) meter: EpisodeMeter,
    pub(crate) recorder: Recorder,
    pub(crate) drawn: Drawn,
    actions: Vec<Action>,
    rewards: Vec<f32>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
}

#[pymethods]
impl Engine {
    /// An environment for a config in JSON; `registered` is the text of the map that its `map_name` names, and
    /// `exact` chooses exact occupancy.
    #[new]
    #[pyo3(signature = (config, registered=None, exact=false))]
    fn new(py: Python<'_>, config: &str, registered: Option<&str>, exact: bool) -> PyResult<Self> {
        let source = config::source(config, registered).map_err(|error| errors::config(py, &error))?;
        let time_limit = source.config().max_episode_steps;
        Self::of(source, exact, time_limit).map_err(|error| errors::config(py, &error))
    }

    /// Begins an episode; returns what the maker of the instance warns of. A new config takes the place of the old
    /// one with it, or not at all.
    #[pyo3(signature = (config=None, registered=None))]
    fn reset(
        this: &Bound<'_, Self>,
        config: Option<&str>,
        registered: Option<&str>,
    ) -> PyResult<Vec<String>> {
        let py = this.py();
        let mut this = this.try_borrow_mut().map_err(|_| errors::busy(py))?;
        this.begin(py, config, registered)
    }

    /// Chooses the seed of the episodes from the next reset on; what resets did to pools stays.
    fn reseed(&mut self, seed: Option<u64>) {
        self.source.reseed(seed);
    }

    /// Forgets what the metrics counted so far.
    fn clear_metrics(&mut self) {
        self.meter.reset();
    }

    /// Plays one step: observations, rewards, terminated, truncated, infos.
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

    /// The observations of all agents, of the type that the config names.
    fn observe<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        self.check_started(py)?;
        match self.game.config().observation {
            Observation::Default => self.observe_default(py),
            Observation::Pomapf => self.observe_apart(py, false),
            Observation::Mapf => self.observe_apart(py, true),
        }
    }

    /// A dictionary for each agent that says whether it takes part.
    fn infos<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        infos(py, self.game.active())
    }

    /// Takes the last step back; says whether there was one.
    fn step_back(this: &Bound<'_, Self>) -> PyResult<bool> {
        let py = this.py();
        let mut this = this.try_borrow_mut().map_err(|_| errors::busy(py))?;
        let Self { game, drawn, elapsed, .. } = &mut *this;
        let last_two = game.past().len().saturating_sub(2);
        let before = game.past()[last_two..].to_vec();
        let went_back = game.step_back().map_err(|error| errors::call(py, &error))?;
        if went_back {
            drawn.take_back(&before);
            *elapsed = game.num_steps();
        }
        Ok(went_back)
    }

    /// Chooses how many steps count towards the time limit so far.
    #[setter]
    fn set_elapsed(&mut self, elapsed: u64) {
        self.elapsed = elapsed;
    }

    /// Whether agents take part.
    #[getter]
    fn active(&self) -> Vec<bool> {
        self.game.active().to_vec()
    }

    /// Which active agents stood on their goals after the last move, before goals changed.
    #[getter]
    fn on_goal(&self) -> Vec<bool> {
        self.game.on_goal().to_vec()
    }

    /// Steps since the reset.
    #[getter]
    fn num_steps(&self) -> u64 {
        self.game.num_steps()
    }

    /// Size of the map without its border: rows, columns.
    #[getter]
    fn size(&self) -> (usize, usize) {
        self.game.size()
    }

    /// Where each agent is, so many rows and columns further down and right.
    fn cells(&self, shift: i64) -> Pairs {
        pairs(self.game.cells(), shift)
    }

    /// Where each agent started.
    fn starts(&self, shift: i64) -> Pairs {
        self.instance.as_ref().map_or_else(Vec::new, |instance| pairs(instance.starts(), shift))
    }

    /// Where each agent wants to go.
    fn goals(&self, shift: i64) -> Pairs {
        pairs(self.game.goals(), shift)
    }

    /// Whether each agent's goal was drawn since the reset.
    #[getter]
    fn is_drawn(&self) -> Vec<bool> {
        self.drawn.now().to_vec()
    }

    /// The map with its border, 1 for an obstacle.
    ///
    /// Shape: `(height + 2 * radius, width + 2 * radius)`, uint8
    fn obstacles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u8>>> {
        let (padded, _, _) = self.global(py)?;
        Ok(padded)
    }

    /// The cells that are marked as occupied, in the coordinates of the map with its border.
    fn occupied(&self) -> Pairs {
        pairs(&self.game.snapshot().occupied, self.game.config().radius as i64)
    }

    /// Whether what lies beyond the wall is free.
    #[getter]
    pub(crate) fn is_free_outside(&self) -> bool {
        self.instance.as_ref().is_none_or(|instance| *instance.outside() == Outside::Free)
    }

    /// The goals that each agent is going to get, as POGEMA foretells them; none if the list would never end.
    fn foretold_goals(&self) -> Option<Vec<Pairs>> {
        let goals = foretold_from(
            self.source.config(),
            self.instance.as_ref()?,
            self.game.cells(),
            self.game.goals(),
        )?;
        Some(goals.iter().map(|goals| pairs(goals, 0)).collect())
    }

    /// The pools in the order to which resets have shuffled them.
    fn pools(&self) -> Option<(Pairs, Pairs)> {
        self.source.pools().map(|(starts, goals)| (pairs(starts, 0), pairs(goals, 0)))
    }

    /// For each agent its first state and each later one that differs: row, column, goal's row and column, step,
    /// whether it takes part, whether the goal was drawn.
    fn history(&self) -> Vec<Vec<Change>> {
        let changes = pogema_core::changes(self.game.past());
        let of_agent = |(agent, changes): (usize, Vec<pogema_core::Change>)| {
            let is_drawn = self.drawn.kept(agent).iter().chain(std::iter::repeat(&false));
            let change = |(change, &is_drawn): (pogema_core::Change, &bool)| {
                let pogema_core::Change { cell, goal, step, active } = change;
                (cell.row, cell.col, goal.row, goal.col, step, active, is_drawn)
            };
            changes.into_iter().zip(is_drawn).map(change).collect()
        };
        changes.into_iter().enumerate().map(of_agent).collect()
    }

    /// Whether the episodes from the next reset on are filmed.
    fn film(&mut self, is_wanted: bool) {
        self.recorder.is_wanted = is_wanted;
    }

    /// The film as an animated SVG, or one frame of it.
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
        self.recorder.svg(&style).map_err(|error| errors::call(py, &error))
    }

    /// What pickles and copies it: a function, and the bytes for it.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        Ok((py.import("pogema_rs._engine")?.getattr("restore_engine")?, (state::save(self, py)?,)))
    }

    /// The film as a page with many replays wants it.
    fn pack_film(&self, py: Python<'_>) -> PyResult<String> {
        self.recorder.pack().map_err(|error| errors::call(py, &error))
    }

    /// The film as a page that replays it.
    fn draw_html(&self, py: Python<'_>, title: &str) -> PyResult<String> {
        self.recorder.html(title).map_err(|error| errors::call(py, &error))
    }
}

impl Engine {
    /// An environment that wants a reset.
    pub(crate) fn of(source: InstanceSource, exact: bool, time_limit: i64) -> Result<Self, Error> {
        let rules = rules(&source, exact, time_limit);
        let num_agents = rules.num_agents;
        Ok(Self {
            source,
            exact,
            time_limit,
            elapsed: 0,
            game: pogema_fast::Engine::new(rules)?,
            instance: None,
            meter: EpisodeMeter::new(&rules),
            recorder: Recorder::default(),
            drawn: Drawn::default(),
            actions: Vec::with_capacity(num_agents),
            rewards: vec![0.0; num_agents],
            terminated: vec![false; num_agents],
            truncated: vec![false; num_agents],
        })
    }

    fn begin(
        &mut self,
        py: Python<'_>,
        config: Option<&str>,
        registered: Option<&str>,
    ) -> PyResult<Vec<String>> {
        let mut source = match config {
            Some(config) => config::source(config, registered).map_err(|error| errors::config(py, &error))?,
            None => self.source.clone(),
        };
        let generated = py.detach(|| source.generate()).map_err(|error| errors::instance(py, &error))?;
        let rules = rules(&source, self.exact, self.time_limit);
        if rules == *self.game.config() {
            self.game.reset(&generated.instance).map_err(|error| errors::instance(py, &error))?;
        } else {
            let mut game = pogema_fast::Engine::new(rules).map_err(|error| errors::config(py, &error))?;
            game.reset(&generated.instance).map_err(|error| errors::instance(py, &error))?;
            self.game = game;
            self.rewards = vec![0.0; rules.num_agents];
            self.terminated = vec![false; rules.num_agents];
            self.truncated = vec![false; rules.num_agents];
        }
        if self.meter.num_agents() != rules.num_agents {
            self.meter = EpisodeMeter::new(&rules);
        }
        self.meter.measure_over(source.config().max_episode_steps);
        self.source = source;
        self.elapsed = 0;
        self.drawn.begin(rules.num_agents, rules.persistent);
        self.recorder.begin(&rules, &generated.instance, &self.game);
        self.instance = Some(generated.instance);
        Ok(generated.warnings)
    }

    fn play<'py>(
        &mut self,
        py: Python<'py>,
        actions: &Bound<'py, PyAny>,
        has_metrics: bool,
    ) -> PyResult<Stepped<'py>> {
        let (num_agents, got) = (self.game.config().num_agents, actions.len()?);
        let fits = Error::check_length("actions", num_agents, got);
        fits.map_err(|error| errors::call(py, &error))?;
        self.check_started(py)?;
        if let Some((agent, number)) = read_actions(actions, self.game.active(), &mut self.actions)? {
            let error = Error::Action { agent: Some(agent), number };
            return Err(errors::call(py, &error));
        }
        let out = StepOut {
            rewards: &mut self.rewards,
            terminated: &mut self.terminated,
            truncated: &mut self.truncated,
        };
        let (game, actions) = (&mut self.game, &self.actions);
        py.detach(|| game.step(actions, out)).map_err(|error| errors::call(py, &error))?;
        self.elapsed += 1;
        let is_over = i64::try_from(self.elapsed).is_ok_and(|elapsed| elapsed >= self.time_limit);
        self.truncated.fill(is_over);
        self.note_goals();
        self.recorder.step(&self.actions, &self.game, (&self.rewards, &self.terminated, &self.truncated));
        let infos = infos(py, self.game.active())?;
        let metrics =
            has_metrics.then(|| self.meter.feed(self.game.on_goal(), &self.terminated, &self.truncated));
        if let Some(metrics) = metrics.flatten() {
            infos.get_item(0)?.set_item("metrics", self.named(py, &metrics)?)?;
        }
        let rewards = self.rewards.iter().map(|&reward| f64::from(reward)).collect();
        self.warn_of_turns(py)?;
        Ok((self.observe(py)?, rewards, self.terminated.clone(), self.truncated.clone(), infos))
    }

    pub(crate) fn check_started(&self, py: Python<'_>) -> PyResult<()> {
        if self.instance.is_some() {
            return Ok(());
        }
        let reason = "the environment was not reset yet".to_owned();
        Err(errors::call(py, &Error::State { reason }))
    }

    /// POGEMA's figures; whole numbers where its are.
    fn named<'py>(&self, py: Python<'py>, metrics: &Metrics) -> PyResult<Bound<'py, PyDict>> {
        let named = PyDict::new(py);
        let is_whole = self.game.config().on_goal == OnGoal::Nothing;
        for (name, value) in metrics.named() {
            if is_whole && matches!(name, "ep_length" | "SoC" | "makespan") {
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
    Config {
        max_steps: time_limit,
        occupancy: if exact { Occupancy::Exact } else { rules.occupancy },
        ..rules
    }
}

fn pairs(cells: &[Cell], shift: i64) -> Pairs {
    cells.iter().map(|cell| (i64::from(cell.row) + shift, i64::from(cell.col) + shift)).collect()
}
