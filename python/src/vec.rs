//! The batch of environments behind `VecEnv`.

use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};

use numpy::{
    Element, PyArrayDyn, PyArrayMethods, PyReadonlyArray2, PyReadwriteArray2, PyReadwriteArray3,
    PyReadwriteArrayDyn,
};
use pogema::{EnvSource, Seed};
use pogema_core::{Action, Config, Error, Occupancy, StepOut};
use pogema_fast::{Autoreset, Firsts, ObservationBuffers, Observations};
use pyo3::exceptions::{PyRuntimeError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::fields::Fields;
use crate::guard::guarded;
use crate::{config, errors, interrupt, memory};

/// Output arrays of a step: rewards, terminated, truncated.
///
/// Shape: `(envs, agents)` each
type Ends<'py> = (PyReadwriteArray2<'py, f32>, PyReadwriteArray2<'py, bool>, PyReadwriteArray2<'py, bool>);
/// Output arrays of a state: observations, flags of active agents, and optional action masks.
///
/// Shape: `(envs, agents, 3, side, side)`, `(envs, agents)`, `(envs, agents, 5)`
type State<'py> = (Bound<'py, PyAny>, PyReadwriteArray2<'py, bool>, Option<PyReadwriteArray3<'py, i8>>);

/// A batch of environments that writes into buffers of the caller.
///
/// No thread waits for the lock: a call during a call of another thread raises an error.
#[pyclass(frozen, module = "pogema_rs._engine")]
pub struct Batch {
    inner: Mutex<Option<Inner>>,
    /// Stops a reset.
    stop: AtomicBool,
    /// Id of the process that owns the threads.
    process: u32,
}

struct Inner {
    batch: pogema_fast::Batch,
    source: EnvSource,
    actions: Vec<Action>,
}

/// The next episodes of some environments, before they begin.
struct Next {
    chosen: Vec<bool>,
    /// The source with new seeds, if there are any, and its first instances.
    seeded: Option<(EnvSource, Firsts)>,
}

guarded! {
#[pymethods]
impl Batch {
    /// Makes environments from configs.
    ///
    /// Each config comes with the text of the map that its `map_name` names. `of_env` holds the index of each
    /// environment's config; without it, all have the first.
    #[new]
    fn new(
        py: Python<'_>,
        configs: Vec<(Fields, Option<String>)>,
        of_env: Option<Vec<usize>>,
        num_envs: usize,
        autoreset: &str,
        exact: bool,
        num_threads: usize,
    ) -> PyResult<Self> {
        let autoreset = read_autoreset(autoreset).map_err(|error| errors::config(py, &error))?;
        let make = move || Inner::new(&configs, of_env, num_envs, exact, num_threads);
        let mut inner = interrupt::detach(py, make)?.map_err(|error| errors::config(py, &error))?;
        inner.batch = inner.batch.with_autoreset(autoreset);
        Ok(Self { inner: Mutex::new(Some(inner)), stop: AtomicBool::new(false), process: std::process::id() })
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
        let mut guard = self.lock()?;
        let inner = Self::open(&mut guard)?;
        let fetched =
            interrupt::detach_scoped(py, &self.stop, || inner.fetch(chosen, seed, seeds, &self.stop))?;
        let reset = fetched.and_then(|next| py.detach(|| inner.begin(next)));
        reset.map_err(|error| errors::batch(py, &error))?;
        let (observations, active, mut masks) = state;
        let mut buffer = Buffer::new(&observations)?;
        let view =
            ObservationBuffers { observations: buffer.observations_mut()?, masks: masks_mut(&mut masks)? };
        let batch = &mut inner.batch;
        py.detach(|| batch.observe(view)).map_err(|error| errors::batch(py, &error))?;
        write_active(batch, None, active).map_err(|error| errors::batch(py, &error))
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
        let mut guard = self.lock()?;
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
        let mut buffer = Buffer::new(&observations)?;
        let view =
            ObservationBuffers { observations: buffer.observations_mut()?, masks: masks_mut(&mut masks)? };
        let (rewards, terminated) = (rewards.as_slice_mut()?, terminated.as_slice_mut()?);
        let out = StepOut { rewards, terminated, truncated: truncated.as_slice_mut()? };
        if inner.ends_take_long() {
            let fetched =
                interrupt::detach_scoped(py, &self.stop, || inner.batch.fetch_truncated(&self.stop))?;
            fetched.map_err(|error| errors::batch(py, &error))?;
        }
        let (batch, actions) = (&mut inner.batch, &inner.actions);
        let played = py.detach(|| batch.step(actions, out, view));
        let shown = played.and_then(|()| write_active(batch, None, active));
        shown.map_err(|error| errors::batch(py, &error))?;
        let has_ended = |&env: &usize| batch.has_just_ended(env).unwrap_or_default();
        Ok((0..batch.num_lanes()).filter(has_ended).collect())
    }

    /// Writes the final states of the last episodes of some environments.
    fn ended(&self, py: Python<'_>, envs: Vec<usize>, state: State<'_>) -> PyResult<()> {
        let mut guard = self.lock()?;
        let inner = Self::open(&mut guard)?;
        let (observations, active, mut masks) = state;
        let mut buffer = Buffer::new(&observations)?;
        let (batch, observed, masks) = (&inner.batch, buffer.observations_mut()?, masks_mut(&mut masks)?);
        let written = py.detach(|| {
            batch.observe_ended(&envs, observed)?;
            masks.map_or(Ok(()), |masks| write_ended_masks(batch, &envs, masks))
        });
        let written = written.and_then(|()| write_active(batch, Some(&envs), active));
        written.map_err(|error| errors::batch(py, &error))
    }

    /// Returns the metrics of the last episodes of some environments, by name.
    fn metrics<'py>(&self, py: Python<'py>, envs: Vec<usize>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let mut guard = self.lock()?;
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
        let mut guard = self.lock()?;
        let batch = &mut Self::open(&mut guard)?.batch;
        let mut masks = Some(masks);
        let view = ObservationBuffers { observations: Observations::None, masks: masks_mut(&mut masks)? };
        py.detach(|| batch.observe(view)).map_err(|error| errors::batch(py, &error))
    }

    /// Returns POGEMA's seed of each environment's current episode.
    fn episode_seeds(&self, py: Python<'_>) -> PyResult<Vec<u64>> {
        let mut guard = self.lock()?;
        let inner = Self::open(&mut guard)?;
        let seed = |(env, seed): (usize, &Seed)| {
            let episode = inner.batch.episode(env).map_err(|error| errors::batch(py, &error))?;
            let episode = episode.ok_or_else(|| errors::batch(py, &Error::NotReset))?;
            Ok(seed.of_episode(env, episode))
        };
        inner.source.seeds().iter().enumerate().map(seed).collect()
    }

    /// Returns the number of agents of each environment, and their radius.
    fn sizes(&self) -> PyResult<(usize, usize)> {
        let mut guard = self.lock()?;
        let config = Self::open(&mut guard)?.batch.config();
        Ok((config.num_agents, config.radius))
    }

    /// Frees the environments and their threads; does nothing in a forked child, since the parent owns both.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        if self.is_inherited() {
            return Ok(());
        }
        let inner = self.lock()?.take();
        py.detach(|| drop(inner));
        Ok(())
    }
}
}

impl Batch {
    fn is_inherited(&self) -> bool {
        std::process::id() != self.process
    }

    /// Locks the environments.
    ///
    /// Errors: `RuntimeError` in a forked child, and while another thread is inside a call.
    fn lock(&self) -> PyResult<MutexGuard<'_, Option<Inner>>> {
        if self.is_inherited() {
            return Err(PyRuntimeError::new_err(
                "this VecEnv was made before the process forked, and its threads stayed in the parent: make a new \
                 VecEnv in the child, or start the child with the method `spawn`",
            ));
        }
        self.inner.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => PyRuntimeError::new_err(
                "another thread is inside a call of this VecEnv: call it from one thread at a time",
            ),
            TryLockError::Poisoned(_) => {
                PyRuntimeError::new_err("an earlier call of this VecEnv failed: make a new VecEnv")
            }
        })
    }

    fn open<'a>(guard: &'a mut MutexGuard<'_, Option<Inner>>) -> PyResult<&'a mut Inner> {
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

impl Inner {
    fn new(
        configs: &[(Fields, Option<String>)],
        of_env: Option<Vec<usize>>,
        num_envs: usize,
        exact: bool,
        num_threads: usize,
    ) -> Result<Self, Error> {
        let read = |(config, map): &(Fields, Option<String>)| config::read(config, map.as_deref());
        let configs = configs.iter().map(read).collect::<Result<Vec<_>, _>>()?;
        // A batch of several configs holds a list of them, and is therefore small: the largest map counts for all.
        let largest = configs.iter().max_by_key(|(config, _)| config.height.saturating_mul(config.width));
        let bytes = largest.and_then(|(config, _)| memory::of_environments(config, num_envs));
        memory::check("the batch", bytes)?;
        let source = EnvSource::new(configs, of_env.unwrap_or_else(|| vec![0; num_envs]))?;
        let rules = source.config(0).rules();
        let occupancy = if exact { Occupancy::Exact } else { rules.occupancy };
        let rules = Config { occupancy, ..rules };
        let batch = pogema_fast::Batch::new(rules, num_envs, num_threads, source.clone())?;
        Ok(Self { batch, source, actions: Vec::with_capacity(num_envs * rules.num_agents) })
    }

    /// Fetches the instances of a reset, and changes no episode.
    fn fetch(
        &mut self,
        chosen: Option<Vec<bool>>,
        seed: Option<u64>,
        seeds: Option<Vec<u64>>,
        stop: &AtomicBool,
    ) -> Result<Next, Error> {
        let num_envs = self.batch.num_lanes();
        let chosen = chosen.unwrap_or_else(|| vec![true; num_envs]);
        Error::check_length("chosen environments", num_envs, chosen.len())?;
        let given: Vec<Seed> = match (seed, seeds) {
            (Some(seed), _) => vec![Seed::Shared(seed); num_envs],
            (None, Some(seeds)) => seeds.into_iter().map(Seed::Own).collect(),
            (None, None) => {
                self.batch.fetch(&chosen, stop)?;
                return Ok(Next { chosen, seeded: None });
            }
        };
        Error::check_length("seeds", num_envs, given.len())?;
        let mut source = self.source.clone();
        for ((seed, given), chosen) in source.seeds_mut().iter_mut().zip(given).zip(&chosen) {
            *seed = if *chosen { given } else { *seed };
        }
        let firsts = self.batch.fetch_with(source.clone(), &chosen, stop)?;
        Ok(Next { chosen, seeded: Some((source, firsts)) })
    }

    fn begin(&mut self, next: Next) -> Result<(), Error> {
        let Some((source, firsts)) = next.seeded else { return self.batch.reset_lanes(&next.chosen) };
        self.batch.begin_with(firsts)?;
        self.source = source;
        Ok(())
    }

    /// Returns whether the next step ends episodes whose next instances may take long.
    fn ends_take_long(&self) -> bool {
        let config = self.source.config(0);
        let num_cells = config.height.saturating_mul(config.width);
        let num_ends = || self.batch.num_truncated();
        num_cells.saturating_mul(self.batch.num_lanes()) >= interrupt::LONG
            && num_ends().saturating_mul(num_cells) >= interrupt::LONG
    }

    /// Stores actions, or returns the index and the number of the first invalid one.
    fn read_actions(&mut self, numbers: &[i64]) -> Result<(), (usize, i64)> {
        let is_action = |&number: &i64| (number as u64) < Action::ALL.len() as u64;
        // No early exit, so that the loop is vectorized.
        if !numbers.iter().fold(true, |all, number| all & is_action(number)) {
            let wrong = numbers.iter().position(|number| !is_action(number)).unwrap_or_default();
            return Err((wrong, numbers[wrong]));
        }
        self.actions.clear();
        self.actions.extend(numbers.iter().map(|&number| Action::ALL[number as usize]));
        Ok(())
    }
}

/// A caller's buffer for observations.
enum Buffer<'py> {
    F32(PyReadwriteArrayDyn<'py, f32>),
    U8(PyReadwriteArrayDyn<'py, u8>),
}

impl<'py> Buffer<'py> {
    fn new(array: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(array) = array.cast::<PyArrayDyn<f32>>() {
            return borrow(array).map(Self::F32);
        }
        let array = array.cast::<PyArrayDyn<u8>>();
        let array = array.map_err(|_| {
            PyTypeError::new_err("observations have the wrong type, expected float32 or uint8")
        })?;
        borrow(array).map(Self::U8)
    }

    fn observations_mut(&mut self) -> PyResult<Observations<'_>> {
        match self {
            Self::F32(array) => Ok(Observations::F32(array.as_slice_mut()?)),
            Self::U8(array) => Ok(Observations::U8(array.as_slice_mut()?)),
        }
    }
}

fn borrow<'py, T: Element>(array: &Bound<'py, PyArrayDyn<T>>) -> PyResult<PyReadwriteArrayDyn<'py, T>> {
    array.try_readwrite().map_err(|error| {
        PyRuntimeError::new_err(format!("the buffer for observations cannot be written: {error}"))
    })
}

fn masks_mut<'a>(masks: &'a mut Option<PyReadwriteArray3<'_, i8>>) -> PyResult<Option<&'a mut [i8]>> {
    Ok(masks.as_mut().map(|masks| masks.as_slice_mut()).transpose()?)
}

/// Writes which agents are active: now in all environments, or at the end of the episode in some.
fn write_active(
    batch: &pogema_fast::Batch,
    ended: Option<&[usize]>,
    mut active: PyReadwriteArray2<'_, bool>,
) -> Result<(), Error> {
    let not_contiguous =
        |_| Error::Corrupt { what: "active".into(), reason: "the array is not contiguous".into() };
    let active = active.as_slice_mut().map_err(not_contiguous)?;
    let num_agents = batch.config().num_agents;
    let expected = num_agents * ended.map_or(batch.num_lanes(), <[usize]>::len);
    Error::check_length("active", expected, active.len())?;
    for (index, part) in active.chunks_exact_mut(num_agents).enumerate() {
        let engine = match ended {
            Some(envs) => batch.ended(envs[index])?.map(|(engine, _)| engine),
            None => Some(batch.lane(index)?),
        };
        // INVARIANT: `observe_ended` has rejected environments without an ended episode.
        if let Some(engine) = engine {
            part.copy_from_slice(engine.active());
        }
    }
    Ok(())
}

fn write_ended_masks(batch: &pogema_fast::Batch, envs: &[usize], out: &mut [i8]) -> Result<(), Error> {
    let per_env = batch.config().num_agents * Action::ALL.len();
    Error::check_length("action masks", envs.len() * per_env, out.len())?;
    envs.iter()
        .zip(out.chunks_exact_mut(per_env))
        .try_for_each(|(&env, out)| batch.ended(env)?.map_or(Ok(()), |(engine, _)| engine.mask_actions(out)))
}

guarded! {
/// Returns the number of threads that this process can run in parallel.
#[pyfunction]
pub fn num_cores() -> PyResult<usize> {
    Ok(std::thread::available_parallelism().map_or(1, usize::from))
}
}

/// Reads Gymnasium's name of an autoreset mode.
fn read_autoreset(name: &str) -> Result<Autoreset, Error> {
    match name {
        "SameStep" => Ok(Autoreset::SameStep),
        "NextStep" => Ok(Autoreset::NextStep),
        "Disabled" => Ok(Autoreset::Off),
        _ => Err(Error::argument("autoreset_mode", name, "`SameStep`, `NextStep` or `Disabled`")),
    }
}
