//! Observations as the arrays, tuples and dictionaries that POGEMA returns.

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pogema_core::{Environment, Instance, Observation, from_border, from_starts};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use super::Inner;
use crate::errors;
use crate::lists::{Pairs, tuples};
use crate::memory::zeros;

impl Inner {
    /// Returns the observations of all agents, in the type that the config names.
    pub(super) fn observe<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        self.check_started(py)?;
        match self.episode.config().observation {
            Observation::Default => self.observe_default(py),
            Observation::Pomapf => self.observe_apart(py, false),
            Observation::Mapf => self.observe_apart(py, true),
        }
    }

    fn observe_default<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let config = self.episode.config();
        let (num_agents, side) = (config.num_agents, config.side());
        let array = zeros::<f32, _>(py, [num_agents, 3, side, side])?;
        {
            let mut values = array.readwrite();
            let values = values.as_slice_mut()?;
            py.detach(|| self.episode.engine().observe(values)).map_err(|error| errors::call(py, &error))?;
        }
        split(py, array.as_any(), num_agents)
    }

    fn observe_apart<'py>(&self, py: Python<'py>, has_global: bool) -> PyResult<Bound<'py, PyList>> {
        let config = self.episode.config();
        let (num_agents, side) = (config.num_agents, config.side());
        let obstacles = zeros::<f32, _>(py, [num_agents, side, side])?;
        let agents = zeros::<f32, _>(py, [num_agents, side, side])?;
        {
            let (mut obstacles, mut agents) = (obstacles.readwrite(), agents.readwrite());
            let (obstacles, agents) = (obstacles.as_slice_mut()?, agents.as_slice_mut()?);
            let seen = self.episode.engine().observe_windows(obstacles, agents);
            seen.map_err(|error| errors::call(py, &error))?;
        }
        let (state, starts) = (self.episode.state(), self.episode.instance().map(Instance::starts));
        let starts = starts.map_err(|error| errors::call(py, &error))?;
        let (obstacles, agents) =
            (split(py, obstacles.as_any(), num_agents)?, split(py, agents.as_any(), num_agents)?);
        let xy = tuples(py, &wide(from_starts(state.cells, starts)))?;
        let target_xy = self.goal_tuples(py, &wide(from_starts(state.goals, starts)))?;
        let global = if has_global { Some(self.global_lists(py)?) } else { None };
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

    /// Returns goals as tuples; drawn goals consist of NumPy integers.
    fn goal_tuples<'py>(&self, py: Python<'py>, pairs: &[(i64, i64)]) -> PyResult<Bound<'py, PyList>> {
        let list = tuples(py, pairs)?;
        for agent in (0..pairs.len()).filter(|&agent| self.drawn.now()[agent]) {
            let (row, col) = pairs[agent];
            let numbers = PyArray1::from_slice(py, &[row, col]);
            list.set_item(agent, (numbers.as_any().get_item(0)?, numbers.as_any().get_item(1)?))?;
        }
        Ok(list)
    }

    /// Returns the grid (the map with its border), and the cells and goals of all agents in coordinates of the grid.
    pub(super) fn global<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyArray2<u8>>, Pairs, Pairs)> {
        self.check_started(py)?;
        let config = self.episode.config();
        let (height, width) = self.episode.engine().size();
        let padded = zeros::<u8, _>(py, [height + 2 * config.radius, width + 2 * config.radius])?;
        {
            let mut obstacles = padded.readwrite();
            let written = self.episode.engine().observe_map(obstacles.as_slice_mut()?);
            written.map_err(|error| errors::call(py, &error))?;
        }
        let (state, radius) = (self.episode.state(), config.radius);
        Ok((padded, wide(from_border(state.cells, radius)), wide(from_border(state.goals, radius))))
    }

    fn global_lists<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyList>, Bound<'py, PyList>)> {
        let (padded, cells, goals) = self.global(py)?;
        let dtype = if self.has_free_outside() { "float64" } else { "int64" };
        let padded = padded.call_method1("astype", (dtype,))?;
        Ok((padded, tuples(py, &cells)?, self.goal_tuples(py, &goals)?))
    }
}

/// Splits an array into one part per agent.
fn split<'py>(py: Python<'py>, array: &Bound<'py, PyAny>, num_agents: usize) -> PyResult<Bound<'py, PyList>> {
    let parts = PyList::empty(py);
    for agent in 0..num_agents {
        parts.append(array.get_item(agent)?)?;
    }
    Ok(parts)
}

fn wide(pairs: impl Iterator<Item = [i32; 2]>) -> Pairs {
    pairs.map(|[row, col]| (i64::from(row), i64::from(col))).collect()
}
