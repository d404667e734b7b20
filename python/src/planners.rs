//! Plans for all agents, and policies that follow these plans.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use numpy::{
    AllowTypeChange, PyArray1, PyArray2, PyArrayLike2, PyArrayLike3, PyArrayMethods, PyUntypedArrayMethods,
};
use pogema_core::{Action, Cell, Error, Map, State, Words, check_threads, counted};
use pogema_planners::{
    Budget, Distances, Graph, LifelongName, LifelongPolicy, Outcome, Plan, PlannerName, PlannerPolicy,
    PlannerSettings, Problem,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::guard::{self, guarded};
use crate::lists::cell;
use crate::memory::{self, check_aligned};
use crate::{errors, interrupt};

type Cells<'py> = PyArrayLike2<'py, i64, AllowTypeChange>;
type Obstacles<'py> = PyArrayLike2<'py, f32, AllowTypeChange>;

/// A flag that cancels calls of planners; any thread may set it.
#[pyclass(frozen, module = "pogema_rs._engine")]
#[derive(Default)]
pub struct Stop(Arc<AtomicBool>);

guarded! {
#[pymethods]
impl Stop {
    #[new]
    fn new() -> PyResult<Self> {
        Ok(Self::default())
    }

    /// Whether the flag is set; the outcome of a cancelled call is `timed_out`.
    #[getter]
    fn is_set(&self) -> PyResult<bool> {
        Ok(self.0.load(Relaxed))
    }

    fn set(&self) -> PyResult<()> {
        self.0.store(true, Relaxed);
        Ok(())
    }
}
}

guarded! {
/// Runs a planner and returns its outcome as a dictionary. `stop` cancels the planner.
#[pyfunction]
#[pyo3(signature = (obstacles, starts, goals, planner, budget, max_steps, num_threads, seed, stop = None))]
#[expect(clippy::too_many_arguments, reason = "these are the arguments of the Python function")]
pub fn make_plan<'py>(
    py: Python<'py>,
    obstacles: Obstacles<'_>,
    starts: Cells<'_>,
    goals: Cells<'_>,
    planner: &str,
    budget: (Option<f64>, Option<u64>),
    max_steps: Option<usize>,
    num_threads: usize,
    seed: u64,
    stop: Option<&Stop>,
) -> PyResult<Bound<'py, PyDict>> {
    let stop = stop.map(|stop| stop.0.clone()).unwrap_or_default();
    let arguments = || {
        let places = (map(&obstacles)?, cells("starts", &starts)?, cells("goals", &goals)?);
        let settings = PlannerSettings { seed, threads: check_threads("num_threads", num_threads)? };
        Ok((places, PlannerName::read("planner", planner)?.make(settings), read_budget(budget, &stop)?))
    };
    let ((map, starts, goals), mut planner, budget) =
        arguments().map_err(|error: Error| errors::plan(&error))?;
    memory::check("the plan", memory::of_search(&map, starts.len())).map_err(|error| errors::memory(&error))?;
    let plan = move || {
        let problem = Problem { max_steps, ..Problem::new(&map, &starts, &goals)? };
        let began = Instant::now();
        let outcome = planner.plan(&problem, &budget);
        Ok((outcome, began.elapsed()))
    };
    // An interrupted call does not leave the planner running.
    let finished = interrupt::detach(py, plan).inspect_err(|_| stop.store(true, Relaxed))?;
    let (outcome, seconds) = finished.map_err(|error: Error| errors::plan(&error))?;
    let result = PyDict::new(py);
    result.set_item("seconds", seconds.as_secs_f64())?;
    if let Some(lower_bound) = outcome.lower_bound() {
        result.set_item("lower_bound", lower_bound)?;
    }
    match &outcome {
        Outcome::Solved { plan, .. } => {
            result.set_item("outcome", "solved")?;
            add_plan(&result, plan)?;
        }
        Outcome::TimedOut { best, .. } | Outcome::GaveUp { best, .. } => {
            let is_late = matches!(&outcome, Outcome::TimedOut { .. });
            result.set_item("outcome", if is_late { "timed_out" } else { "gave_up" })?;
            best.as_ref().map_or(Ok(()), |plan| add_plan(&result, plan))?;
        }
        Outcome::Impossible { reason } => {
            result.set_item("outcome", "impossible")?;
            result.set_item("reason", reason)?;
        }
    }
    Ok(result)
}
}

/// Adds a plan's cells, actions and costs.
fn add_plan(result: &Bound<'_, PyDict>, plan: &Plan) -> PyResult<()> {
    let py = result.py();
    let (num_steps, num_agents) = (plan.num_steps(), plan.num_agents());
    let places: Vec<i32> =
        plan.cells().iter().flatten().flat_map(|cell| [cell.row.into(), cell.col.into()]).collect();
    let places = PyArray1::from_vec(py, places).reshape([num_steps + 1, num_agents, 2])?;
    let mut actions: Vec<i64> = Vec::with_capacity(num_steps * num_agents);
    for step in 0..num_steps {
        let step = plan.actions(step).map_err(|error| errors::plan(&error))?;
        actions.extend(step.into_iter().map(|action| i64::from(u8::from(action))));
    }
    result.set_item("cells", places)?;
    result.set_item("actions", PyArray1::from_vec(py, actions).reshape([num_steps, num_agents])?)?;
    result.set_item("sum_of_costs", plan.sum_of_costs())?;
    result.set_item("makespan", plan.makespan())
}

guarded! {
/// Returns the first conflict of a plan, or `None` if it is valid.
#[pyfunction]
pub fn check_plan(
    py: Python<'_>,
    obstacles: Obstacles<'_>,
    starts: Cells<'_>,
    goals: Option<Cells<'_>>,
    steps: PyArrayLike3<'_, i64, AllowTypeChange>,
) -> PyResult<Option<String>> {
    let arguments = || {
        let goals = goals.as_ref().map(|goals| cells("goals", goals)).transpose()?;
        Ok((map(&obstacles)?, cells("starts", &starts)?, goals, read_plan(&steps)?))
    };
    let (map, starts, goals, plan) = arguments().map_err(|error: Error| errors::plan(&error))?;
    let validate = move || pogema_planners::validate(&map, &starts, goals.as_deref(), &plan);
    let verdict = interrupt::detach(py, validate)?;
    Ok(verdict.err().map(|conflict| conflict.to_string()))
}
}

guarded! {
/// Returns the number of steps from every cell to a goal, or -1 if no path leads from the cell to the goal.
#[pyfunction]
pub fn cost_to_go<'py>(
    py: Python<'py>,
    obstacles: Obstacles<'_>,
    goal: (i64, i64),
) -> PyResult<Bound<'py, PyArray2<i32>>> {
    let map = map(&obstacles).map_err(|error| errors::plan(&error))?;
    memory::check("the search", memory::of_search(&map, 1)).map_err(|error| errors::memory(&error))?;
    let search = move || {
        let graph = std::sync::Arc::new(Graph::new(&map));
        let goal = graph.vertices_of("goal", &[cell("goal", 0, [goal.0, goal.1], 0)?])?[0];
        let costs = Distances::new(graph.clone(), 0).to(goal);
        let mut grid = vec![-1; map.height() * map.width()];
        for (vertex, &cost) in (0..).zip(costs.iter()) {
            grid[map.index(graph.cell(vertex))] = i32::try_from(cost).unwrap_or(-1);
        }
        Ok((map, grid))
    };
    let (map, grid) = interrupt::detach(py, search)?.map_err(|error: Error| errors::plan(&error))?;
    PyArray1::from_vec(py, grid).reshape([map.height(), map.width()])
}
}

/// A planner that drives an environment.
///
/// No thread waits for the lock. While one thread makes a call, a call of another thread raises an error.
#[pyclass(frozen, module = "pogema_rs._engine")]
pub struct PlanFollower {
    inner: Mutex<Follower>,
    /// Cancels the planner.
    stop: Arc<AtomicBool>,
}

struct Follower {
    policy: Policy,
    step: u64,
}

enum Policy {
    /// One goal for each agent.
    Once(PlannerPolicy),
    /// A new goal after each goal reached.
    Lifelong(LifelongPolicy),
}

impl Policy {
    fn act(&mut self, map: &Map, now: State<'_>) -> Result<Vec<Action>, Error> {
        match self {
            Self::Once(policy) => policy.act(map, now),
            Self::Lifelong(policy) => policy.act(map, now),
        }
    }

    fn reset(&mut self) {
        match self {
            Self::Once(policy) => policy.reset(),
            Self::Lifelong(policy) => policy.reset(),
        }
    }
}

guarded! {
#[pymethods]
impl PlanFollower {
    #[new]
    fn new(
        planner: &str,
        budget: (Option<f64>, Option<u64>),
        max_steps: Option<u64>,
        num_threads: usize,
        seed: u64,
        lifelong: bool,
    ) -> PyResult<Self> {
        let stop = Arc::default();
        let made = || {
            let (settings, budget) = (
                PlannerSettings { seed, threads: check_threads("num_threads", num_threads)? },
                read_budget(budget, &stop)?,
            );
            Ok(if lifelong {
                Policy::Lifelong(LifelongPolicy::new(
                    LifelongName::read("planner", planner)?,
                    settings,
                    budget,
                ))
            } else {
                Policy::Once(PlannerPolicy::new(
                    PlannerName::read("planner", planner)?.make(settings),
                    budget,
                    max_steps,
                ))
            })
        };
        let policy = made().map_err(|error: Error| errors::plan(&error))?;
        Ok(Self { inner: Mutex::new(Follower { policy, step: 0 }), stop })
    }

    /// Chooses the actions of all agents for one step.
    ///
    /// If a signal handler raises, a lifelong planner forgets its plan; no other state changes.
    fn act(
        &self,
        py: Python<'_>,
        obstacles: Obstacles<'_>,
        positions: Cells<'_>,
        goals: Cells<'_>,
    ) -> PyResult<Vec<i64>> {
        let arguments = || Ok((map(&obstacles)?, cells("positions", &positions)?, cells("goals", &goals)?));
        let (map, cells, goals) = arguments().map_err(|error: Error| errors::plan(&error))?;
        let mut inner = guard::lock(py, &self.inner, "this planner")?;
        let active = vec![true; cells.len()];
        let follower = &mut *inner;
        let step = follower.step;
        let now = State { step, cells: &cells, goals: &goals, active: &active, on_goal: &[] };
        let actions = interrupt::detach_scoped(py, &self.stop, || follower.policy.act(&map, now))?;
        let actions = actions.map_err(|error| errors::plan(&error))?;
        follower.step += 1;
        Ok(actions.into_iter().map(|action| i64::from(u8::from(action))).collect())
    }

    /// Forgets the last episode.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        let mut inner = guard::lock(py, &self.inner, "this planner")?;
        inner.policy.reset();
        inner.step = 0;
        Ok(())
    }
}
}

fn read_budget(
    (seconds, nodes): (Option<f64>, Option<u64>),
    stop: &Arc<AtomicBool>,
) -> Result<Budget, Error> {
    let time = |seconds: f64| {
        Budget::time_from(seconds).ok_or_else(|| Error::argument("seconds", seconds, Budget::SECONDS))
    };
    Ok(Budget { time: seconds.map(time).transpose()?, nodes, cancelled: Some(Arc::clone(stop)) })
}

fn map(obstacles: &Obstacles<'_>) -> Result<Map, Error> {
    check_aligned("obstacles", obstacles)?;
    let [height, width] = [obstacles.shape()[0], obstacles.shape()[1]];
    Map::new(height, width, obstacles.as_array().iter().map(|&value| value != 0.0).collect())
}

fn cells(what: &str, places: &Cells<'_>) -> Result<Vec<Cell>, Error> {
    check_aligned(what, places)?;
    let numbers = places.shape()[1];
    if numbers != 2 {
        let found = format!("an array of {}", counted(numbers, "column"));
        return Err(Error::argument(what, found, "an array of shape (agents, 2)"));
    }
    let rows = places.as_array();
    (0..).zip(rows.outer_iter()).map(|(agent, place)| cell(what, agent, [place[0], place[1]], 0)).collect()
}

fn read_plan(steps: &PyArrayLike3<'_, i64, AllowTypeChange>) -> Result<Plan, Error> {
    check_aligned("cells", steps)?;
    let shape = steps.shape();
    if shape[2] != 2 {
        let found = format!("an array of shape ({}, {}, {})", shape[0], shape[1], shape[2]);
        return Err(Error::argument("cells", found, "an array of shape (steps + 1, agents, 2)"));
    }
    let steps = steps.as_array();
    let step = |places: numpy::ndarray::ArrayView2<'_, i64>| {
        (0..)
            .zip(places.outer_iter())
            .map(|(agent, place)| cell("cells", agent, [place[0], place[1]], 0))
            .collect()
    };
    Plan::new(steps.outer_iter().map(step).collect::<Result<_, Error>>()?)
}
