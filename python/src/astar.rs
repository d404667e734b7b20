//! POGEMA's A* agent.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex};

use numpy::{AllowTypeChange, PyArrayLike2, PyArrayMethods, PyUntypedArrayMethods};
use pogema_core::{Action, Error};
use pogema_numpy::Generator;
use pogema_planners::PomapfObservation;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors;
use crate::guard::guarded;
use crate::memory::check_aligned;

/// The largest absolute coordinate, far beyond every map and small enough for the sums of a search.
const FURTHEST: u32 = 1 << 20;

/// An agent that follows shortest paths around the obstacles it has seen, with the same actions as POGEMA's.
#[pyclass(module = "pogema_rs._engine")]
pub struct AStarAgent {
    /// Never locked: the mutex only makes the agent `Sync`, which its random generator is not.
    agent: Mutex<pogema_planners::AStarAgent>,
    was_random: Arc<AtomicBool>,
}

guarded! {
#[pymethods]
impl AStarAgent {
    #[new]
    fn new(seed: u64) -> PyResult<Self> {
        let was_random = Arc::new(AtomicBool::new(false));
        let (mut generator, flag) = (Generator::seeded(seed), Arc::clone(&was_random));
        let random_action = move || {
            flag.store(true, Relaxed);
            // INVARIANT: the range is not empty.
            let index = generator.integers(0, Action::ALL.len() as i64).unwrap_or_default();
            Action::ALL[index as usize]
        };
        let agent = pogema_planners::AStarAgent::new(Box::new(random_action));
        Ok(Self { agent: Mutex::new(agent), was_random })
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
        let obstacles = obstacles.to_vec()?;
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

impl AStarAgent {
    fn agent(&mut self) -> &mut pogema_planners::AStarAgent {
        self.agent.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}
