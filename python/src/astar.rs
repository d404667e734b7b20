//! POGEMA's A* agent.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};

use numpy::{AllowTypeChange, PyArrayLike2, PyUntypedArrayMethods};
use pogema_core::{Action, Error};
use pogema_numpy::Generator;
use pogema_planners::PomapfObservation;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::errors;
use crate::guard::guarded;
use crate::memory::check_aligned;

/// The largest absolute value of a coordinate, far beyond every map and small enough for the sums of a search.
const FURTHEST: u32 = 1 << 20;

/// An agent that follows shortest paths around the obstacles it has seen, with the same actions as POGEMA's.
#[pyclass(module = "pogema_rs._engine")]
pub struct AStarAgent {
    /// Never locked: the mutex only makes the agent `Sync`, which its boxed closure for random actions is not.
    agent: Mutex<pogema_planners::AStarAgent>,
    /// The source of the agent's random actions.
    generator: Arc<Mutex<Generator>>,
    was_random: Arc<AtomicBool>,
}

/// The state of an agent that `copy` and `pickle` keep.
type Saved = (Generator, Vec<(i32, i32)>, Option<(i32, i32)>);

guarded! {
#[pymethods]
impl AStarAgent {
    #[new]
    fn new(seed: u64) -> PyResult<Self> {
        Ok(Self::drawing_from(Generator::seeded(seed)))
    }

    /// Supports copying and pickling: returns the function that makes an equal agent and the bytes to pass to it.
    fn __reduce__<'py>(&mut self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let generator = self.generator.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let (obstacles, last) = self.agent().memory();
        let saved: Saved = (generator, obstacles, last);
        let saved = serde_json::to_vec(&saved).map_err(|error| PyValueError::new_err(error.to_string()))?;
        let restore = py.import("pogema_rs._engine")?.getattr("restore_astar")?;
        Ok((restore, (PyBytes::new(py, &saved),)))
    }

    /// Returns the action for an observation of type `POMAPF`, and whether it was drawn at random.
    fn act(
        &mut self,
        py: Python<'_>,
        xy: (i32, i32),
        target_xy: (i32, i32),
        obstacles: PyArrayLike2<'_, f32, AllowTypeChange>,
    ) -> PyResult<(u8, bool)> {
        let [rows, side] = [obstacles.shape()[0], obstacles.shape()[1]];
        if rows != side || side % 2 == 0 {
            return Err(PyValueError::new_err(format!(
                "obstacles have shape ({rows}, {side}), expected a square with an odd side"
            )));
        }
        for (name, (row, col)) in [("xy", xy), ("target_xy", target_xy)] {
            if row.unsigned_abs().max(col.unsigned_abs()) > FURTHEST {
                return Err(PyValueError::new_err(format!(
                    "{name} is ({row}, {col}), expected coordinates from -{FURTHEST} to {FURTHEST}"
                )));
            }
        }
        check_aligned("obstacles", &obstacles).map_err(|error| errors::plan(&error))?;
        // Row by row, regardless of the array's strides.
        let obstacles: Vec<f32> = obstacles.as_array().iter().copied().collect();
        let view = PomapfObservation { cell: xy.into(), goal: target_xy.into(), obstacles: &obstacles, side };
        self.was_random.store(false, Relaxed);
        let action = self.agent().act(view).map_err(|error: Error| errors::astar(py, &error))?;
        Ok((action.into(), self.was_random.load(Relaxed)))
    }

    /// Forgets the seen map before a new episode; the random generator continues its stream.
    fn clear_state(&mut self) -> PyResult<()> {
        self.agent().forget();
        Ok(())
    }
}
}

guarded! {
/// Restores the agent that `AStarAgent.__reduce__` turned into these bytes.
///
/// # Errors
/// `ValueError` for any other bytes.
#[pyfunction]
pub fn restore_astar(saved: &[u8]) -> PyResult<AStarAgent> {
    let (generator, obstacles, last): Saved = serde_json::from_slice(saved)
        .map_err(|error| PyValueError::new_err(format!("saved A* agent: {error}")))?;
    let is_far = |(row, col): &(i32, i32)| row.unsigned_abs().max(col.unsigned_abs()) > 2 * FURTHEST;
    if obstacles.iter().chain(&last).any(is_far) {
        return Err(PyValueError::new_err(format!(
            "saved A* agent: a cell is too far away, expected coordinates from -{0} to {0}",
            2 * FURTHEST
        )));
    }
    let mut restored = AStarAgent::drawing_from(generator);
    restored.agent().remember(obstacles, last);
    Ok(restored)
}
}

impl AStarAgent {
    /// Returns an agent without memory that draws its random actions from a generator.
    fn drawing_from(generator: Generator) -> Self {
        let was_random = Arc::new(AtomicBool::new(false));
        let generator = Arc::new(Mutex::new(generator));
        let (source, flag) = (Arc::clone(&generator), Arc::clone(&was_random));
        let random_action = move || {
            flag.store(true, Relaxed);
            let mut source = source.lock().unwrap_or_else(PoisonError::into_inner);
            // INVARIANT: the range is not empty.
            let index = source.integers(0, Action::ALL.len() as i64).unwrap_or_default();
            Action::ALL[index as usize]
        };
        let agent = Mutex::new(pogema_planners::AStarAgent::new(Box::new(random_action)));
        Self { agent, generator, was_random }
    }

    fn agent(&mut self) -> &mut pogema_planners::AStarAgent {
        self.agent.get_mut().unwrap_or_else(PoisonError::into_inner)
    }
}
