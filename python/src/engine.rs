//! One environment behind POGEMA's Python classes.

use numpy::{PyArray1, PyArray2, PyArray3, PyArray4, PyArrayMethods};
use pogema_core::{
    Action, Cell, Config, Environment, EpisodeMeter, Instance, MapfOut, Metrics, Observation, Occupancy,
    OnGoal, Outside, PomapfOut, StepOut,
};
use pogema_maps::{InstanceSource, Targets, foretold_from};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::film::Recorder;
use crate::lists::{Pairs, infos, read_actions, tuples};
use crate::{config, errors};

/// Row, column, goal's row and column, step, whether the agent takes part.
type Change = (u16, u16, u16, u16, u64, bool);
/// What a step returns.
type Stepped<'py> = (Bound<'py, PyList>, Vec<f64>, Vec<bool>, Vec<bool>, Bound<'py, PyList>);

/// One environment with its config, its metrics and, if wanted, its film.
#[pyclass(module = "pogema_rs._engine")]
pub struct Engine {
    source: InstanceSource,
    exact: bool,
    game: pogema_fast::Engine,
    instance: Option<Instance>,
    meter: EpisodeMeter,
    recorder: Recorder,
    /// Whether each agent's goal was drawn since the reset.
    is_drawn: Vec<bool>,
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
        let rules = rules(&source, exact);
        let game = pogema_fast::Engine::new(rules).map_err(|error| errors::config(py, &error))?;
        let num_agents = rules.num_agents;
        Ok(Self {
            source,
            exact,
            game,
            instance: None,
            meter: EpisodeMeter::new(&rules),
            recorder: Recorder::default(),
            is_drawn: vec![false; num_agents],
            actions: Vec::with_capacity(num_agents),
            rewards: vec![0.0; num_agents],
            terminated: vec![false; num_agents],
            truncated: vec![false; num_agents],
        })
    }

    /// Begins an episode; returns what the maker of the instance warns of. A new config takes the place of the old
    /// one with it, or not at all.
    #[pyo3(signature = (config=None, registered=None))]
    fn reset(
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
        let rules = rules(&source, self.exact);
        if rules == *self.game.config() {
            self.game.reset(&generated.instance).map_err(|error| errors::instance(py, &error))?;
        } else {
            let mut game = pogema_fast::Engine::new(rules).map_err(|error| errors::config(py, &error))?;
            game.reset(&generated.instance).map_err(|error| errors::instance(py, &error))?;
            self.game = game;
            self.meter = EpisodeMeter::new(&rules);
            self.rewards = vec![0.0; rules.num_agents];
            self.terminated = vec![false; rules.num_agents];
            self.truncated = vec![false; rules.num_agents];
        }
        self.source = source;
        self.is_drawn.clear();
        self.is_drawn.resize(rules.num_agents, false);
        self.recorder.begin(&rules, &generated.instance, &self.game);
        self.instance = Some(generated.instance);
        Ok(generated.warnings)
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
        &mut self,
        py: Python<'py>,
        actions: &Bound<'py, PyAny>,
        has_metrics: bool,
    ) -> PyResult<Stepped<'py>> {
        self.check_started(py)?;
        let (num_agents, got) = (self.game.config().num_agents, actions.len()?);
        let fits = pogema_core::Error::check_length("actions", num_agents, got);
        fits.map_err(|error| errors::call(py, &error))?;
        if let Some((agent, number)) = read_actions(actions, self.game.active(), &mut self.actions)? {
            let error = pogema_core::Error::Action { agent: Some(agent), number };
            return Err(errors::call(py, &error));
        }
        let out = StepOut {
            rewards: &mut self.rewards,
            terminated: &mut self.terminated,
            truncated: &mut self.truncated,
        };
        let (game, actions) = (&mut self.game, &self.actions);
        py.detach(|| game.step(actions, out)).map_err(|error| errors::call(py, &error))?;
        self.note_drawn();
        self.recorder.step(&self.actions, &self.game, (&self.rewards, &self.terminated, &self.truncated));
        let infos = infos(py, self.game.active())?;
        let metrics =
            has_metrics.then(|| self.meter.feed(self.game.on_goal(), &self.terminated, &self.truncated));
        if let Some(metrics) = metrics.flatten() {
            infos.get_item(0)?.set_item("metrics", self.named(py, &metrics)?)?;
        }
        let rewards = self.rewards.iter().map(|&reward| f64::from(reward)).collect();
        Ok((self.observe(py)?, rewards, self.terminated.clone(), self.truncated.clone(), infos))
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
    fn step_back(&mut self, py: Python<'_>) -> PyResult<bool> {
        self.game.step_back().map_err(|error| errors::call(py, &error))
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
        self.is_drawn.clone()
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
    fn is_free_outside(&self) -> bool {
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
    /// whether it takes part.
    fn history(&self) -> Vec<Vec<Change>> {
        let changes = pogema_core::changes(self.game.past());
        changes.into_iter().map(|agent| agent.into_iter().map(Into::into).collect()).collect()
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

    /// The film as a page that replays it.
    fn draw_html(&self, py: Python<'_>, title: &str) -> PyResult<String> {
        self.recorder.html(title).map_err(|error| errors::call(py, &error))
    }
}

impl Engine {
    fn check_started(&self, py: Python<'_>) -> PyResult<()> {
        if self.instance.is_some() {
            return Ok(());
        }
        let reason = "the environment was not reset yet".to_owned();
        Err(errors::call(py, &pogema_core::Error::State { reason }))
    }

    /// POGEMA's goals are of NumPy's type once they were drawn, and not if they were given.
    fn note_drawn(&mut self) {
        let config = self.source.config();
        if config.on_target != OnGoal::Restart || matches!(config.targets_xy, Some(Targets::Sequences(_))) {
            return;
        }
        for (is_drawn, &on_goal) in self.is_drawn.iter_mut().zip(self.game.on_goal()) {
            *is_drawn |= on_goal;
        }
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

    fn observe_default<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let config = self.game.config();
        let (num_agents, side) = (config.num_agents, config.side());
        let array = PyArray4::<f32>::zeros(py, [num_agents, 3, side, side], false);
        {
            let mut values = array.readwrite();
            let values = values.as_slice_mut()?;
            py.detach(|| self.game.observe(values)).map_err(|error| errors::call(py, &error))?;
        }
        split(py, array.as_any(), num_agents)
    }

    fn observe_apart<'py>(&self, py: Python<'py>, is_global: bool) -> PyResult<Bound<'py, PyList>> {
        let config = self.game.config();
        let (num_agents, side) = (config.num_agents, config.side());
        let obstacles = PyArray3::<f32>::zeros(py, [num_agents, side, side], false);
        let agents = PyArray3::<f32>::zeros(py, [num_agents, side, side], false);
        let (mut cells, mut goals) = (vec![0; 2 * num_agents], vec![0; 2 * num_agents]);
        {
            let (mut obstacles, mut agents) = (obstacles.readwrite(), agents.readwrite());
            let (obstacles, agents) = (obstacles.as_slice_mut()?, agents.as_slice_mut()?);
            let out = PomapfOut { obstacles, agents, cells: &mut cells, goals: &mut goals };
            self.game.observe_pomapf(out).map_err(|error| errors::call(py, &error))?;
        }
        let (obstacles, agents) =
            (split(py, obstacles.as_any(), num_agents)?, split(py, agents.as_any(), num_agents)?);
        let xy = tuples(py, &chunks(&cells))?;
        let target_xy = self.goal_tuples(py, &chunks(&goals))?;
        let global = if is_global { Some(self.global_lists(py)?) } else { None };
        let all = PyList::empty(py);
        for agent in 0..num_agents {
            let seen = PyDict::new(py);
            seen.set_item(pyo3::intern!(py, "obstacles"), obstacles.get_item(agent)?)?;
            seen.set_item(pyo3::intern!(py, "agents"), agents.get_item(agent)?)?;
            seen.set_item(pyo3::intern!(py, "xy"), xy.get_item(agent)?)?;
            seen.set_item(pyo3::intern!(py, "target_xy"), target_xy.get_item(agent)?)?;
            if let Some((obstacles, cells, goals)) = &global {
                seen.set_item(pyo3::intern!(py, "global_obstacles"), obstacles)?;
                seen.set_item(pyo3::intern!(py, "global_xy"), cells.get_item(agent)?)?;
                seen.set_item(pyo3::intern!(py, "global_target_xy"), goals.get_item(agent)?)?;
            }
            all.append(seen)?;
        }
        Ok(all)
    }

    /// Tuples of goals, of NumPy's integers where they were drawn.
    fn goal_tuples<'py>(&self, py: Python<'py>, pairs: &[(i64, i64)]) -> PyResult<Bound<'py, PyList>> {
        let list = tuples(py, pairs)?;
        for agent in (0..pairs.len()).filter(|&agent| self.is_drawn[agent]) {
            let (row, col) = pairs[agent];
            let numbers = PyArray1::from_slice(py, &[row, col]);
            list.set_item(agent, (numbers.as_any().get_item(0)?, numbers.as_any().get_item(1)?))?;
        }
        Ok(list)
    }

    /// The map with its border, and all cells and goals in its coordinates.
    fn global<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyArray2<u8>>, Pairs, Pairs)> {
        self.check_started(py)?;
        let config = self.game.config();
        let (height, width) = self.game.size();
        let padded =
            PyArray2::<u8>::zeros(py, [height + 2 * config.radius, width + 2 * config.radius], false);
        let (mut cells, mut goals) = (vec![0; 2 * config.num_agents], vec![0; 2 * config.num_agents]);
        {
            let mut obstacles = padded.readwrite();
            let out = MapfOut { obstacles: obstacles.as_slice_mut()?, cells: &mut cells, goals: &mut goals };
            self.game.observe_mapf(out).map_err(|error| errors::call(py, &error))?;
        }
        Ok((padded, chunks(&cells), chunks(&goals)))
    }

    fn global_lists<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyList>, Bound<'py, PyList>)> {
        let (padded, cells, goals) = self.global(py)?;
        let dtype = if self.is_free_outside() { "float64" } else { "int64" };
        let padded = padded.call_method1("astype", (dtype,))?;
        Ok((padded, tuples(py, &cells)?, self.goal_tuples(py, &goals)?))
    }
}

fn rules(source: &InstanceSource, exact: bool) -> Config {
    let rules = source.config().rules();
    Config { occupancy: if exact { Occupancy::Exact } else { rules.occupancy }, ..rules }
}

/// The parts of an array, one per agent.
fn split<'py>(py: Python<'py>, array: &Bound<'py, PyAny>, num_agents: usize) -> PyResult<Bound<'py, PyList>> {
    let parts = PyList::empty(py);
    for agent in 0..num_agents {
        parts.append(array.get_item(agent)?)?;
    }
    Ok(parts)
}

fn pairs(cells: &[Cell], shift: i64) -> Pairs {
    cells.iter().map(|cell| (i64::from(cell.row) + shift, i64::from(cell.col) + shift)).collect()
}

fn chunks(numbers: &[i32]) -> Pairs {
    numbers.chunks_exact(2).map(|pair| (i64::from(pair[0]), i64::from(pair[1]))).collect()
}
