//! The batch of environments behind `VecEnv`.

mod buffers;
mod dense;
mod encoders;
mod film;
mod inner;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Mutex, MutexGuard, PoisonError};

use numpy::{PyReadonlyArray2, PyReadwriteArray2, PyReadwriteArray3};
use pogema_core::{Error, StepOut, Words};
use pogema_fast::{ObservationBuffers, Observations};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::guard::{self, guarded};
use crate::{errors, interrupt};

pub use encoders::{surroundings, surroundings_of};

use buffers::{Global, masks_mut, write_active, write_agents};
use dense::DenseRewards;
use encoders::Prepared;
use film::{Film, Format, Plan};
use inner::{Configs, Inner, Room, read_autoreset};

/// Output arrays of a step: rewards, terminated, truncated.
///
/// Shape: `(envs, agents)` each
type Ends<'py> = (PyReadwriteArray2<'py, f32>, PyReadwriteArray2<'py, bool>, PyReadwriteArray2<'py, bool>);
/// Output arrays of a state: observations (an array, or a dictionary of arrays), flags of active agents, and optional
/// action masks.
///
/// Shape: `(envs, agents, ...)`, `(envs, agents)`, `(envs, agents, 5)`
type State<'py> = (Bound<'py, PyAny>, PyReadwriteArray2<'py, bool>, Option<PyReadwriteArray3<'py, i8>>);

/// The number of the batch that was made last.
static LAST_NUMBER: AtomicU64 = AtomicU64::new(0);

/// A batch of environments that writes into buffers of the caller.
///
/// No thread waits for the lock. While one thread makes a call, a call of another thread raises an error.
#[pyclass(frozen, module = "pogema_rs._engine")]
pub struct Batch {
    inner: Mutex<Option<Inner>>,
    /// Stops the work of a call.
    stop: AtomicBool,
    /// Id of the process that owns the threads.
    process: u32,
    /// A number that no other batch of the process has.
    number: u64,
}

guarded! {
#[pymethods]
impl Batch {
    /// Makes environments from configs.
    ///
    /// Each config comes with the text of the map that its `map_name` names. `rules` are the autoreset mode, whether
    /// the occupancy is exact, and whether rewards include steps towards the goal. `threads` are the number of threads
    /// and the bits of an observed cell, which determine the default number. `room` are the numbers of agents, and of
    /// rows and columns, for which the arrays have room. `encoder` is the JSON of an encoder, whose windows are then
    /// the observations.
    #[new]
    #[pyo3(signature = (configs, num_envs, rules, threads, room, encoder=None))]
    fn new(
        py: Python<'_>,
        configs: Configs,
        num_envs: usize,
        rules: (String, bool, bool),
        threads: (Option<usize>, usize),
        room: Room,
        encoder: Option<String>,
    ) -> PyResult<Self> {
        let (autoreset, exact, dense) = rules;
        let autoreset = read_autoreset(&autoreset).map_err(|error| errors::config(py, &error))?;
        let encoder = encoder.map(|json| serde_json::from_str(&json)).transpose();
        let encoder = encoder.map_err(|error| PyValueError::new_err(format!("encoder: {error}")))?;
        let make = move || Inner::new(&configs, room, num_envs, exact, threads, encoder);
        let mut inner = interrupt::detach(py, make)?.map_err(|error| errors::config(py, &error))?;
        inner.batch = inner.batch.with_autoreset(autoreset);
        inner.dense = dense.then(|| DenseRewards::new(num_envs));
        let (process, number) = (std::process::id(), LAST_NUMBER.fetch_add(1, Relaxed) + 1);
        Ok(Self { inner: Mutex::new(Some(inner)), stop: AtomicBool::new(false), process, number })
    }

    /// Films every N-th episode of an environment, from the next reset on.
    fn film(&self, py: Python<'_>, env: usize, every: u64, prefix: PathBuf, format: &str) -> PyResult<()> {
        let mut guard = self.lock(py)?;
        let inner = Self::open(&mut guard)?;
        let format = Format::read("format", format).map_err(|error| errors::film(py, &error))?;
        let film = Film::new(Plan { env, every, prefix, format });
        inner.film = Some(film.map_err(|error| errors::film(py, &error))?);
        Ok(())
    }

    /// Returns the paths of the finished films.
    fn films(&self, py: Python<'_>) -> PyResult<Vec<PathBuf>> {
        let mut guard = self.lock(py)?;
        let film = Self::open(&mut guard)?.film.as_ref();
        Ok(film.map(|film| film.results().files.clone()).unwrap_or_default())
    }

    /// Returns the reasons why films are missing, and forgets them.
    fn take_film_failures(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let mut guard = self.lock(py)?;
        let film = Self::open(&mut guard)?.film.as_ref();
        Ok(film.map(|film| std::mem::take(&mut film.results().failures)).unwrap_or_default())
    }

    /// Finishes the current film, waits until all films are drawn, and stops filming. Returns what [`Batch::films`] and
    /// [`Batch::take_film_failures`] return. In a forked child, does nothing and returns empty lists, because the
    /// parent draws the films.
    fn finish_films(&self, py: Python<'_>) -> PyResult<(Vec<PathBuf>, Vec<String>)> {
        if self.is_inherited() {
            return Ok(Default::default());
        }
        let film = Self::open(&mut self.lock(py)?)?.film.take();
        interrupt::detach(py, move || {
            let Some(mut film) = film else { return Default::default() };
            film.close();
            let results = film.results();
            (results.files.clone(), results.failures.clone())
        })
    }

    /// Changes the configs of some environments from their next episodes on; without `envs`, those of all.
    fn set_configs(&self, py: Python<'_>, configs: Configs, envs: Option<Vec<usize>>) -> PyResult<()> {
        let mut guard = self.lock(py)?;
        let inner = Self::open(&mut guard)?;
        let set =
            interrupt::detach_scoped(py, &self.stop, || inner.set_configs(&configs, envs, &self.stop))?;
        set.map_err(|error| match error {
            Error::Instance { .. } => errors::instance(py, &error),
            _ => errors::config(py, &error),
        })
    }

    /// Begins the next episode in all environments, or in the chosen ones.
    ///
    /// With `seed`, or with one of `seeds` for each environment, begins their first episodes.
    #[pyo3(signature = (state, chosen=None, seed=None, seeds=None))]
    fn reset(
        &self,
        py: Python<'_>,
        state: State<'_>,
        chosen: Option<Vec<bool>>,
        seed: Option<u64>,
        seeds: Option<Vec<u64>>,
    ) -> PyResult<()> {
        let mut guard = self.lock(py)?;
        let inner = Self::open(&mut guard)?;
        let fetched =
            interrupt::detach_scoped(py, &self.stop, || inner.fetch(chosen, seed, seeds, &self.stop))?;
        let reset = fetched.and_then(|next| py.detach(|| inner.begin(next)));
        let prepared = reset.map_err(|error| errors::batch(py, &error))?;
        let (observations, active, mut masks) = state;
        let (mut buffer, radius) = (inner.buffer(&observations)?, inner.batch.config().radius);
        let (observations, encoded) = buffer.parts_mut(radius)?;
        let view = ObservationBuffers { observations, masks: masks_mut(&mut masks)? };
        let observed = py.detach(|| inner.observe(view, encoded, prepared));
        observed.map_err(|error| errors::batch(py, &error))?;
        write_active(&inner.batch, None, active).map_err(|error| errors::batch(py, &error))
    }

    /// Plays one step and returns the indices of the environments whose episode ended.
    ///
    /// Shape: `actions` is `(envs, agents)`
    fn step(
        &self,
        py: Python<'_>,
        actions: PyReadonlyArray2<'_, i64>,
        ends: Ends<'_>,
        state: State<'_>,
    ) -> PyResult<Vec<usize>> {
        let mut guard = self.lock(py)?;
        let inner = Self::open(&mut guard)?;
        inner.read_actions(actions.as_slice()?).map_err(|(index, number)| {
            let num_agents = inner.batch.config().num_agents;
            let (env, agent) = (index / num_agents, index % num_agents);
            let text = Error::Action { agent: Some(agent), number }.to_string();
            let text = text.replacen(" of agent", &format!(" of environment {env}, agent"), 1);
            errors::action(py, text)
        })?;
        let (mut rewards, mut terminated, mut truncated) = ends;
        let (observations, active, mut masks) = state;
        let (mut buffer, radius) = (inner.buffer(&observations)?, inner.batch.config().radius);
        let (observations, encoded) = buffer.parts_mut(radius)?;
        let view = ObservationBuffers { observations, masks: masks_mut(&mut masks)? };
        let (rewards, terminated) = (rewards.as_slice_mut()?, terminated.as_slice_mut()?);
        let out = StepOut { rewards, terminated, truncated: truncated.as_slice_mut()? };
        if inner.goals_take_long() {
            let found = interrupt::detach_scoped(py, &self.stop, || inner.prepare_goals(&self.stop))?;
            found.map_err(|error| errors::batch(py, &error))?;
        }
        let prepared = if inner.ends_take_long() {
            let fetched =
                interrupt::detach_scoped(py, &self.stop, || inner.fetch_at_limit(&self.stop))?;
            fetched.map_err(|error| errors::batch(py, &error))?
        } else {
            Prepared::new()
        };
        let played = py.detach(|| inner.step(out, view, encoded, prepared));
        let batch = &inner.batch;
        let shown = played.and_then(|()| write_active(batch, None, active));
        shown.map_err(|error| errors::batch(py, &error))?;
        let has_ended = |&env: &usize| batch.has_just_ended(env).unwrap_or_default();
        Ok((0..batch.num_lanes()).filter(has_ended).collect())
    }

    /// Writes the final states of the last episodes of some environments.
    fn ended(&self, py: Python<'_>, envs: Vec<usize>, state: State<'_>) -> PyResult<()> {
        let mut guard = self.lock(py)?;
        let inner = Self::open(&mut guard)?;
        let (observations, active, mut masks) = state;
        let (mut buffer, radius) = (inner.buffer(&observations)?, inner.batch.config().radius);
        let (observations, encoded) = buffer.parts_mut(radius)?;
        let view = ObservationBuffers { observations, masks: masks_mut(&mut masks)? };
        let written = py.detach(|| inner.observe_ended(&envs, view, encoded));
        let written = written.and_then(|()| write_active(&inner.batch, Some(&envs), active));
        written.map_err(|error| errors::batch(py, &error))
    }

    /// Writes global states: the current ones of all environments, or those at the ends of the last episodes of some.
    fn global_state(
        &self,
        py: Python<'_>,
        arrays: Bound<'_, PyDict>,
        active: PyReadwriteArray2<'_, bool>,
        ended: Option<Vec<usize>>,
    ) -> PyResult<()> {
        let mut guard = self.lock(py)?;
        let batch = &mut Self::open(&mut guard)?.batch;
        let mut global = Global::new(&arrays, ["obstacles", "positions", "goals"])?;
        let buffers = Observations::Global(global.buffers_mut(0)?);
        let written = py.detach(|| match &ended {
            Some(envs) => batch.observe_ended(envs, buffers),
            None => batch.observe(buffers),
        });
        let written = written.and_then(|()| write_active(batch, ended.as_deref(), active));
        written.map_err(|error| errors::batch(py, &error))
    }

    /// Writes which rows are agents, and not padding: in the current episodes of all environments, or in the last
    /// episodes of some.
    fn mask_agents(
        &self,
        py: Python<'_>,
        mask: PyReadwriteArray2<'_, bool>,
        ended: Option<Vec<usize>>,
    ) -> PyResult<()> {
        let mut guard = self.lock(py)?;
        let batch = &Self::open(&mut guard)?.batch;
        write_agents(batch, ended.as_deref(), mask).map_err(|error| errors::batch(py, &error))
    }

    /// Returns the metrics of the last episodes of some environments, by name.
    fn metrics<'py>(&self, py: Python<'py>, envs: Vec<usize>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let mut guard = self.lock(py)?;
        let inner = Self::open(&mut guard)?;
        let named = |env| {
            let dict = PyDict::new(py);
            let ended = inner.batch.ended(env).map_err(|error| errors::batch(py, &error))?;
            for (name, value) in ended.iter().flat_map(|(_, metrics)| metrics.named()) {
                dict.set_item(name, value)?;
            }
            Ok(dict)
        };
        envs.into_iter().map(named).collect()
    }

    /// Writes the current action masks.
    fn mask_actions(&self, py: Python<'_>, masks: PyReadwriteArray3<'_, i8>) -> PyResult<()> {
        let mut guard = self.lock(py)?;
        let batch = &mut Self::open(&mut guard)?.batch;
        let mut masks = Some(masks);
        let view = ObservationBuffers { observations: Observations::None, masks: masks_mut(&mut masks)? };
        py.detach(|| batch.observe(view)).map_err(|error| errors::batch(py, &error))
    }

    /// Returns POGEMA's seed of each environment's current episode.
    fn episode_seeds(&self, py: Python<'_>) -> PyResult<Vec<u64>> {
        let mut guard = self.lock(py)?;
        let inner = Self::open(&mut guard)?;
        let seeds = interrupt::detach_scoped(py, &self.stop, || inner.episode_seeds(&self.stop))?;
        seeds.map_err(|error| errors::batch(py, &error))
    }

    /// Returns the number of agents for which each environment has room, their radius, and the size that holds every
    /// map.
    fn sizes(&self, py: Python<'_>) -> PyResult<(usize, usize, (usize, usize))> {
        let mut guard = self.lock(py)?;
        let inner = Self::open(&mut guard)?;
        let config = inner.batch.config();
        Ok((config.num_agents, config.radius, inner.map_size))
    }

    /// Returns the type of observations that the configs request.
    fn observation_type(&self, py: Python<'_>) -> PyResult<String> {
        let mut guard = self.lock(py)?;
        Ok(Self::open(&mut guard)?.batch.config().observation.to_string())
    }

    /// Returns the largest number of threads that play.
    fn num_threads(&self, py: Python<'_>) -> PyResult<usize> {
        let mut guard = self.lock(py)?;
        Ok(Self::open(&mut guard)?.batch.num_threads())
    }

    /// Frees the environments and their threads; does nothing in a forked child, since the parent owns both.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        if self.is_inherited() {
            return Ok(());
        }
        let inner = self.lock(py)?.take();
        interrupt::detach(py, move || drop(inner))
    }
}
}

impl Batch {
    /// Returns a number from 1 that no other batch of the process has.
    pub fn number(&self) -> u64 {
        self.number
    }

    fn is_inherited(&self) -> bool {
        std::process::id() != self.process
    }

    /// Locks the environments.
    ///
    /// Errors: `RuntimeError` in a forked child, and those of [`guard::lock`].
    pub fn lock(&self, py: Python<'_>) -> PyResult<MutexGuard<'_, Option<Inner>>> {
        if self.is_inherited() {
            return Err(PyRuntimeError::new_err(
                "this VecEnv was made before the process forked, and its threads stayed in the parent: make a new \
                 VecEnv in the child, or start the child with the method `spawn`",
            ));
        }
        guard::lock(py, &self.inner, "this VecEnv")
    }

    pub fn open<'a>(guard: &'a mut MutexGuard<'_, Option<Inner>>) -> PyResult<&'a mut Inner> {
        guard.as_mut().ok_or_else(|| PyRuntimeError::new_err("this VecEnv is closed: make a new one"))
    }
}

impl Drop for Batch {
    fn drop(&mut self) {
        if self.is_inherited() {
            // The threads exist in the parent alone, so the child must not wait for them.
            std::mem::forget(self.inner.get_mut().unwrap_or_else(PoisonError::into_inner).take());
        }
    }
}

guarded! {
/// Returns the number of threads that this process can run in parallel.
#[pyfunction]
pub fn num_cores() -> PyResult<usize> {
    Ok(std::thread::available_parallelism().map_or(1, usize::from))
}
}
