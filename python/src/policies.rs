//! Learned policies that play environments of Python.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard};

use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadonlyArrayDyn, PyReadwriteArray2,
    PyUntypedArrayMethods,
};
use pogema_core::{Action, Cell, Config, Environment, Error, GoalStream, Instance, Occupancy, State, Words};
use pogema_fast::Engine;
use pogema_policies::{
    Inputs, Learned, LearnedName, LearnedPolicy, Network, NetworkConfig, RecurrentState, Sampling,
};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::guard::{self, guarded};
use crate::vec::{Batch, surroundings, surroundings_of};
use crate::{errors, interrupt, lists};

/// A learned policy, which plays one `VecEnv` or one environment at a time.
///
/// No thread waits for the lock. A call raises an error while another thread makes a call.
#[pyclass(frozen, module = "pogema_rs._engine")]
pub struct Policy {
    learned: Learned,
    seed: u64,
    threads: usize,
    /// Stops the work of a call.
    stop: Arc<AtomicBool>,
    players: Mutex<Players>,
}

/// The players of one environment, or of all environments of a batch.
#[derive(Default)]
struct Players {
    /// The number of the batch, or 0.
    batch: u64,
    lanes: Vec<Option<Player>>,
    /// The number of steps that one environment has played.
    step: u64,
    /// The grid and the number of agents of this environment.
    plays: (Vec<u8>, usize),
}

/// A policy in one episode.
struct Player {
    /// Number of the episode that the policy plays in its environment, counted from 1.
    begun: u64,
    policy: LearnedPolicy,
    /// The last step for which it chose actions, and these actions.
    step: Option<u64>,
    actions: Vec<Action>,
}

guarded! {
#[pymethods]
impl Policy {
    /// Reads a policy: its name, the file of its weights, and the settings of a suite.
    ///
    /// `search` holds two settings of MATS-LP: the number of expansions, and whether the search is faithful.
    #[new]
    fn new(
        name: &str,
        weights: Option<PathBuf>,
        sampling: Option<&str>,
        mask_actions: Option<bool>,
        seed: u64,
        threads: usize,
        search: (Option<u32>, Option<bool>),
    ) -> PyResult<Self> {
        let read = || {
            let name = <LearnedName as Words>::read("name", name)?;
            let mut learned = match &weights {
                Some(file) => name.read(file)?,
                None => name.with_shipped_weights()?,
            };
            if let Some(sampling) = sampling {
                learned = learned.with_sampling(Sampling::read("sampling", sampling)?)?;
            }
            learned = with_search(learned, search)?;
            if let Some(masks_actions) = mask_actions {
                learned = learned.with_masks(masks_actions)?;
            }
            learned.check_threads(threads).map(|()| learned)
        };
        let learned = read().map_err(|error| errors::file(&error))?;
        Ok(Self { learned, seed, threads, stop: Arc::default(), players: Mutex::default() })
    }

    /// Returns the JSON of the encoder, if the policy has one.
    fn encoder(&self) -> PyResult<Option<String>> {
        Ok(self.learned.encoder().and_then(|encoder| serde_json::to_string(encoder).ok()))
    }

    /// Returns the rule that chooses actions from logits, if the policy has one.
    fn sampling(&self) -> PyResult<Option<&'static str>> {
        Ok(self.learned.sampling().map(Sampling::word))
    }

    /// Writes the actions of all agents of a batch.
    ///
    /// Shape: `actions` is `(envs, agents)`
    fn act_batch(&self, py: Python<'_>, batch: &Batch, mut actions: PyReadwriteArray2<'_, i64>) -> PyResult<()> {
        let mut players = self.lock(py)?;
        let mut guard = batch.lock(py)?;
        if players.batch != batch.number() {
            if !players.lanes.is_empty() {
                return Err(other_environment());
            }
            *players = Players { batch: batch.number(), ..Players::default() };
        }
        let batch = &mut Batch::open(&mut guard)?.batch;
        let (players, out) = (&mut *players, actions.as_slice_mut()?);
        let act = || self.act_all(batch, players, out);
        interrupt::detach_scoped(py, &self.stop, act)?.map_err(|error| errors::policy(py, &error))
    }

    /// Returns the actions of all agents of one environment.
    ///
    /// `obstacles` is its grid, the map with a border of `border` cells. `cells` and `goals` use the coordinates of
    /// the grid. `active` holds a flag for each agent. `exact` says whether the occupancy grid marks every agent.
    #[expect(clippy::too_many_arguments, reason = "these are the parts of an observation")]
    fn act(
        &self,
        py: Python<'_>,
        obstacles: PyReadonlyArray2<'_, u8>,
        border: usize,
        cells: Vec<(i64, i64)>,
        goals: Vec<(i64, i64)>,
        active: Vec<bool>,
        exact: bool,
    ) -> PyResult<Vec<i64>> {
        let mut players = self.lock(py)?;
        if players.batch != 0 {
            return Err(other_environment());
        }
        if self.learned.network().is_none() {
            return Err(PyValueError::new_err(
                "`mats-lp` needs future goals, which observations do not hold; expected a VecEnv",
            ));
        }
        let shape = (obstacles.shape()[0], obstacles.shape()[1]);
        let grid = Grid { padded: obstacles.as_slice()?, shape, border, exact };
        let (map, num_agents) = &players.plays;
        if !players.lanes.is_empty() && (map != grid.padded || *num_agents != cells.len()) {
            return Err(other_environment());
        }
        let playing = &mut *players;
        let act = || {
            let cells = grid.cells("global_xy", &cells)?;
            let goals = grid.cells("global_target_xy", &goals)?;
            self.act_in_one(playing, &grid, (&cells, &goals, &active))
        };
        let acted = interrupt::detach_scoped(py, &self.stop, act)?;
        let actions = acted.map_err(|error| PyValueError::new_err(error.to_string()))?;
        // An interrupted call does not count as a step, so that the next call returns the actions that the interrupted
        // call did not return.
        players.step += 1;
        Ok(actions)
    }

    /// Returns the outputs of the network for a batch of agents at the beginning of an episode.
    ///
    /// Shape: `windows` and `scalars` are `(agents, values)`, the result is `(agents, outputs)`
    fn logits<'py>(
        &self,
        py: Python<'py>,
        windows: PyReadonlyArray2<'_, f32>,
        scalars: PyReadonlyArray2<'_, f32>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let Some(network) = self.learned.network() else {
            return Err(PyValueError::new_err("`mats-lp` has no logits of single agents"));
        };
        let batch = windows.shape()[0];
        let inputs = Inputs { windows: windows.as_slice()?, scalars: scalars.as_slice()?, batch };
        let forward = || {
            let (mut state, mut workspace) = (RecurrentState::new(network, batch), network.workspace());
            network.forward(inputs, &mut state, &mut workspace).map(|outputs| outputs.logits.to_vec())
        };
        let logits = py.detach(forward).map_err(|error| PyValueError::new_err(error.to_string()))?;
        PyArray1::from_vec(py, logits).reshape([batch, network.num_actions()])
    }

    /// Forgets all episodes and the environment.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        *self.lock(py)? = Players::default();
        Ok(())
    }
}
}

impl Policy {
    fn lock(&self, py: Python<'_>) -> PyResult<MutexGuard<'_, Players>> {
        guard::lock(py, &self.players, "this policy")
    }

    fn begin(&self, instance: &Instance, config: &Config, begun: u64) -> Result<Player, Error> {
        let stop = Some(Arc::clone(&self.stop));
        let policy = self.learned.begin(instance, config, self.seed, self.threads, stop)?;
        Ok(Player { begun, policy, step: None, actions: Vec::new() })
    }

    fn act_in_one(
        &self,
        players: &mut Players,
        grid: &Grid<'_>,
        (cells, goals, active): (&[Cell], &[Cell], &[bool]),
    ) -> Result<Vec<i64>, Error> {
        if players.lanes.is_empty() {
            let (instance, config) = grid.instance(cells, goals)?;
            *players = Players {
                lanes: vec![Some(self.begin(&instance, &config, 1)?)],
                plays: (grid.padded.to_vec(), cells.len()),
                ..Players::default()
            };
        }
        let on_goal = vec![false; cells.len()];
        let Players { lanes, step, .. } = players;
        // INVARIANT: the list has one player now.
        let player = lanes[0].as_mut().ok_or(Error::NotReset)?;
        let actions = player.act(State { step: *step, cells, goals, active, on_goal: &on_goal })?;
        Ok(actions.iter().map(|&action| i64::from(u8::from(action))).collect())
    }

    fn act_all(
        &self,
        batch: &mut pogema_fast::Batch,
        players: &mut Players,
        out: &mut [i64],
    ) -> Result<(), Error> {
        let num_agents = batch.config().num_agents;
        Error::check_length("actions", batch.num_lanes() * num_agents, out.len())?;
        players.lanes.resize_with(batch.num_lanes(), || None);
        let lanes = players.lanes.iter_mut().zip(out.chunks_exact_mut(num_agents)).enumerate();
        let done = batch.share(lanes.collect(), |batch, (env, (player, out))| {
            out.fill(i64::from(u8::from(Action::Stay)));
            if batch.is_over(env)? {
                return Ok(());
            }
            if self.stop.load(Relaxed) {
                return Err(Error::Cancelled);
            }
            let (engine, begun) = (batch.lane(env)?, batch.num_begun(env)?);
            if player.as_ref().is_none_or(|player| player.begun != begun) {
                *player = Some(self.begin(&instance(engine)?, engine.config(), begun)?);
            }
            // INVARIANT: the player has begun.
            let Some(playing) = player else { return Ok(()) };
            match playing.act(engine.state()) {
                Ok(actions) => {
                    out.iter_mut().zip(actions).for_each(|(out, &action)| *out = u8::from(action).into());
                    Ok(())
                }
                Err(error) => {
                    *player = None;
                    Err(in_environment(env, error))
                }
            }
        });
        done.into_iter().collect()
    }
}

impl Player {
    /// Returns the actions in a state. A second call in this state returns the same actions.
    fn act(&mut self, state: State<'_>) -> Result<&[Action], Error> {
        if self.step != Some(state.step) {
            self.actions = self.policy.act(state)?;
            self.step = Some(state.step);
        }
        Ok(&self.actions)
    }
}

/// Returns the instance of an environment's episode. After a step, the instance lacks goals that agents have
/// already received.
fn instance(engine: &Engine) -> Result<Instance, Error> {
    let (map, outside) = surroundings_of(engine)?;
    Instance::new(map, outside, engine.starts().to_vec(), engine.streams().to_vec())
}

/// The map of an observation, with its border.
struct Grid<'a> {
    padded: &'a [u8],
    shape: (usize, usize),
    border: usize,
    /// Whether every agent is marked in the occupancy grid.
    exact: bool,
}

impl Grid<'_> {
    /// Returns cells in the coordinates of the map without its border; `what` names them in the error.
    fn cells(&self, what: &str, places: &[(i64, i64)]) -> Result<Vec<Cell>, Error> {
        let border = self.border as i64;
        let places = places.iter().map(|&(row, col)| [row, col]).enumerate();
        places.map(|(agent, place)| lists::cell(what, agent, place, border)).collect()
    }

    /// Returns an instance that begins in a state, and its rules.
    fn instance(&self, cells: &[Cell], goals: &[Cell]) -> Result<(Instance, Config), Error> {
        let (map, outside) = surroundings(self.padded, self.shape, self.border)?;
        let streams = goals.iter().map(|&goal| GoalStream::single(goal)).collect();
        let occupancy = if self.exact { Occupancy::Exact } else { Occupancy::default() };
        let config = Config { occupancy, num_agents: cells.len(), radius: self.border, ..Config::default() };
        Ok((Instance::new(map, outside, cells.to_vec(), streams)?, config))
    }
}

fn with_search(
    mut learned: Learned,
    (expansions, faithful): (Option<u32>, Option<bool>),
) -> Result<Learned, Error> {
    let given = expansions.map(|_| "expansions").or(faithful.map(|_| "faithful"));
    if let (Some(name), Some(_)) = (given, learned.network()) {
        return Err(Error::request(format!(
            "`{name}` is given, but the policy has no tree search; only `mats-lp` has"
        )));
    }
    if let Some(expansions) = expansions {
        learned = learned.with_expansions(expansions)?;
    }
    match faithful {
        Some(faithful) => learned.with_faithful(faithful),
        None => Ok(learned),
    }
}

fn in_environment(env: usize, error: Error) -> Error {
    match error {
        Error::Corrupt { what, reason } => {
            Error::Corrupt { what, reason: format!("environment {env}: {reason}") }
        }
        other => other,
    }
}

fn other_environment() -> PyErr {
    PyRuntimeError::new_err(
        "this policy plays another environment: call `reset_states`, or load a policy for each",
    )
}

guarded! {
/// Writes a network with its encoder as a `.safetensors` file and the JSON beside it.
///
/// `config` is the content of the JSON file, and `name` the name of the policy that plays the network. An error leaves
/// both files unchanged.
#[pyfunction]
pub fn write_network(
    path: PathBuf,
    config: &str,
    name: &str,
    tensors: Vec<(String, PyReadonlyArrayDyn<'_, f32>)>,
) -> PyResult<()> {
    let read = |(name, array): (String, PyReadonlyArrayDyn<'_, f32>)| {
        (name, array.shape().to_vec(), array.as_array().iter().copied().collect::<Vec<f32>>())
    };
    let tensors: Vec<_> = tensors.into_iter().map(read).collect();
    let write = || {
        let wrong = |error: serde_json::Error| Error::Corrupt { what: "network".into(), reason: error.to_string() };
        let config: NetworkConfig = serde_json::from_str(config).map_err(wrong)?;
        let network = Network::from_tensors(config.clone(), tensors.iter().cloned())?;
        <LearnedName as Words>::read("name", name)?.of_network(network)?;
        Network::write(&path, config, tensors)
    };
    write().map_err(|error| errors::file(&error))
}
}
