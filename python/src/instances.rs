//! Instances of many seeds as flat arrays, for environments on devices.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use numpy::PyArray1;
use pogema_core::{Cell, Error, GoalStream, Instance, OnGoal, Outside};
use pogema_maps::InstanceSource;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::fields::Fields;
use crate::guard::guarded;
use crate::{config, errors, interrupt, memory};

/// The parts of all instances, each as one flat list.
#[derive(Default)]
struct Parts {
    sizes: Vec<u16>,
    maps: Vec<u8>,
    noise: Vec<u8>,
    starts: Vec<u16>,
    goals: Vec<u16>,
    num_goals: Vec<u32>,
}

/// Bytes of a goal.
const GOAL_BYTES: u64 = 2 * size_of::<u16>() as u64;
/// The largest number of goals of all instances together: JAX counts them in 32 bits.
const MAX_GOALS: u64 = i32::MAX as u64;

/// The number of steps for which goals are stored, and the flag that ends the work.
struct Horizon<'a> {
    num_steps: u64,
    stop: &'a AtomicBool,
}

impl Horizon<'_> {
    /// Returns an error if the instances have too many drawn goals, or if those of one instance may need too much
    /// memory.
    ///
    /// `num_left` counts this instance and those after it, which have the same size.
    fn check(&self, instance: &Instance, num_left: u64) -> Result<(), Error> {
        let map = instance.map();
        // A lower bound: a stream of drawn goals never ends, and each goal counts as its Manhattan distance in
        // steps, which is less than height + width.
        let num_drawn =
            instance.goals().iter().filter(|goals| goals.sequence_position().is_none()).count() as u64;
        let least = (self.num_steps / (map.height() + map.width()) as u64).saturating_mul(num_drawn);
        if least.saturating_mul(num_left) > MAX_GOALS {
            return Err(self.error());
        }
        // At most one goal for each step.
        let bytes = self.num_steps.checked_mul(GOAL_BYTES).and_then(|bytes| bytes.checked_mul(num_drawn));
        memory::check("goals", bytes.and_then(|bytes| usize::try_from(bytes).ok()))
    }

    fn error(&self) -> Error {
        Error::argument(
            "num_steps",
            self.num_steps,
            format!("fewer steps: all instances together can hold at most {MAX_GOALS} goals"),
        )
    }
}

guarded! {
/// Makes one instance for each seed, and returns their parts as flat arrays.
///
/// `sizes` holds rows and columns per instance. `maps` holds the cells, row by row. `noise` holds the cells of the maps
/// with their borders, or nothing. `starts` and `goals` hold rows and columns. `num_goals` holds the number of goals of
/// each agent. With `on_target: restart`, no agent can reach its last goal within `num_steps` steps, unless its
/// sequence is shorter. With any other `on_target`, each agent has one goal.
///
/// # Errors
/// Those of the config and of its instances; `InstanceError` for a `num_steps` that needs too many goals.
#[pyfunction]
pub fn make_instances(
    py: Python<'_>,
    fields: Fields,
    registered: Option<String>,
    seeds: Vec<u64>,
    num_steps: u64,
) -> PyResult<Bound<'_, PyDict>> {
    let source = config::source(&fields, registered.as_deref()).map_err(|error| errors::config(py, &error))?;
    let stop = Arc::<AtomicBool>::default();
    let source = source.cancelled_by(&stop);
    let flag = Arc::clone(&stop);
    let make = move || make_parts(&source, &seeds, num_steps, &flag);
    let parts = interrupt::detach(py, make).inspect_err(|_| stop.store(true, Relaxed))?;
    let parts = parts.map_err(|error| errors::instance(py, &error))?;
    let arrays = PyDict::new(py);
    arrays.set_item("sizes", PyArray1::from_vec(py, parts.sizes))?;
    arrays.set_item("maps", PyArray1::from_vec(py, parts.maps))?;
    arrays.set_item("noise", PyArray1::from_vec(py, parts.noise))?;
    arrays.set_item("starts", PyArray1::from_vec(py, parts.starts))?;
    arrays.set_item("goals", PyArray1::from_vec(py, parts.goals))?;
    arrays.set_item("num_goals", PyArray1::from_vec(py, parts.num_goals))?;
    Ok(arrays)
}
}

/// Makes for each seed the instance that the first episode of a new environment has.
fn make_parts(
    source: &InstanceSource,
    seeds: &[u64],
    num_steps: u64,
    stop: &AtomicBool,
) -> Result<Parts, Error> {
    let mut parts = Parts::default();
    let is_lifelong = source.config().on_target == OnGoal::Restart;
    let horizon = Horizon { num_steps, stop };
    for (index, &seed) in seeds.iter().enumerate() {
        if stop.load(Relaxed) {
            return Err(Error::Cancelled);
        }
        let mut source = source.clone();
        source.reseed(Some(seed));
        let num_left = (seeds.len() - index) as u64;
        parts.push(&source.generate()?.instance, is_lifelong.then_some(&horizon), num_left)?;
    }
    Ok(parts)
}

impl Parts {
    /// Adds an instance; `num_left` counts it and those after it. Lifelong agents need goals up to the horizon.
    fn push(
        &mut self,
        instance: &Instance,
        horizon: Option<&Horizon<'_>>,
        num_left: u64,
    ) -> Result<(), Error> {
        let map = instance.map();
        if let Some(horizon) = horizon {
            horizon.check(instance, num_left)?;
        }
        self.sizes.extend([map.height() as u16, map.width() as u16]);
        self.maps.extend(map.obstacles().iter().map(|&obstacle| u8::from(obstacle)));
        if let Outside::Noise(noise) = instance.outside() {
            self.noise.extend(noise.obstacles().iter().map(|&obstacle| u8::from(obstacle)));
        }
        for (&start, goals) in instance.starts().iter().zip(instance.goals()) {
            push_cell(&mut self.starts, start);
            let count = if let Some(horizon) = horizon {
                self.push_goals(start, goals.clone(), horizon)?
            } else {
                push_cell(&mut self.goals, goals.first());
                1
            };
            self.num_goals.push(count);
        }
        Ok(())
    }

    /// Adds the goals that an agent can reach within a number of steps, and the one after them. Returns their number.
    ///
    /// A sequence that is shorter is added once, because it repeats by the rules.
    ///
    /// # Errors
    /// If all instances together have too many goals, or if the work is cancelled.
    fn push_goals(
        &mut self,
        start: Cell,
        mut stream: GoalStream,
        horizon: &Horizon<'_>,
    ) -> Result<u32, Error> {
        let (mut at, mut goal) = (start, stream.first());
        let (mut count, mut steps) = (0, 0);
        loop {
            if self.goals.len() as u64 / 2 >= MAX_GOALS {
                return Err(horizon.error());
            }
            if horizon.stop.load(Relaxed) {
                return Err(Error::Cancelled);
            }
            push_cell(&mut self.goals, goal);
            count += 1;
            // An agent reaches at most one goal per step, and moves by at most one cell.
            steps += u64::from(at.distance(goal).max(1));
            at = goal;
            goal = stream.advance(at);
            let has_wrapped = matches!(stream.sequence_position(), Some((_, 0)));
            if steps > horizon.num_steps || has_wrapped {
                return Ok(count);
            }
        }
    }
}

fn push_cell(cells: &mut Vec<u16>, cell: Cell) {
    cells.extend([cell.row, cell.col]);
}
