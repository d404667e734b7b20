//! Estimates memory use, so that a request for too much memory is an error before any work and never ends the process.

use numpy::ndarray::{Dimension, IntoDimension};
use numpy::{Element, PyArray, PyArrayMethods, PyReadonlyArray, PyUntypedArrayMethods};
use pogema_core::{Error, Map};
use pogema_maps::GridConfig;
use pyo3::prelude::*;

use crate::errors;

/// Bytes of an environment and its source, without map and agents.
const ENVIRONMENT_BYTES: usize = 2048;
/// Bytes of an agent in the current and the next episode of an environment.
const AGENT_BYTES: usize = 256;
/// Bytes of a cell in the current and the next episode, without the bits of the windows.
const CELL_BYTES: usize = 20;
/// Bytes of a strip's row of bits, for obstacles and agents of the current and the next episode.
const STRIP_ROW_BYTES: usize = 32;
/// Bytes of a cell while a map is generated.
const GENERATED_BYTES: usize = 24;
/// Bytes of a cell in the graph of a search.
const VERTEX_BYTES: usize = 64;
/// Bytes of a goal in a Python list, as a tuple of two numbers, divided by the steps to a typical goal.
const GOAL_BYTES_PER_STEP: usize = 16;

/// Returns an upper bound on the bytes of `num_envs` environments of a config, without observations.
pub fn of_environments(config: &GridConfig, num_envs: usize) -> Option<usize> {
    let border = config.obs_radius.checked_mul(2)?;
    let (rows, cols) = (config.height.checked_add(border)?, config.width.checked_add(border)?);
    let num_cells = rows.checked_mul(cols)?;
    let strips = rows.checked_mul(cols / 32 + 3)?.checked_mul(STRIP_ROW_BYTES)?;
    let map = num_cells.checked_mul(CELL_BYTES)?.checked_add(strips)?;
    let agents = config.num_agents.checked_mul(AGENT_BYTES)?;
    let each = ENVIRONMENT_BYTES.checked_add(map)?.checked_add(agents)?;
    each.checked_mul(num_envs)?.checked_add(num_cells.checked_mul(GENERATED_BYTES)?)
}

/// Returns an upper bound on the bytes of a map while it is generated and written as text.
pub fn of_map(width: i64, height: i64) -> Option<usize> {
    let [width, height] = [width, height].map(|side| usize::try_from(side).unwrap_or(0));
    width.checked_mul(height)?.checked_mul(GENERATED_BYTES)
}

/// Returns an upper bound on the bytes of a search for `num_agents` agents, each of which needs its costs to go.
pub fn of_search(map: &Map, num_agents: usize) -> Option<usize> {
    let each = num_agents.checked_mul(size_of::<u32>())?.checked_add(VERTEX_BYTES)?;
    map.height().checked_mul(map.width())?.checked_mul(each)
}

/// Returns an estimate of the bytes of the goals that agents can reach in a number of steps, as a Python list.
pub fn of_goals(num_steps: usize, num_agents: usize) -> Option<usize> {
    num_steps.checked_mul(num_agents)?.checked_mul(GOAL_BYTES_PER_STEP)
}

/// Checks that the system provides a number of bytes; `None` means more bytes than can be counted.
///
/// # Errors
/// [`Error::Memory`] if it does not.
pub fn check(what: &str, bytes: Option<usize>) -> Result<(), Error> {
    let is_available = bytes.is_some_and(|bytes| Vec::<u8>::new().try_reserve_exact(bytes).is_ok());
    if is_available { Ok(()) } else { Err(Error::Memory { what: what.to_owned(), bytes }) }
}

/// Checks that each element of an array is aligned for its type, as references require.
///
/// # Errors
/// [`Error::Argument`] for any other array, such as a field of a packed record.
pub fn check_aligned<T: Element, D: Dimension>(
    name: &str,
    array: &PyReadonlyArray<'_, T, D>,
) -> Result<(), Error> {
    let align = align_of::<T>();
    let is_aligned = |stride: &isize| stride.unsigned_abs().is_multiple_of(align);
    if (array.data() as usize).is_multiple_of(align) && array.strides().iter().all(is_aligned) {
        return Ok(());
    }
    Err(Error::argument(name, "an unaligned array", "an aligned array, for example a copy of it"))
}

/// Returns a new NumPy array of zeros.
pub fn zeros<T: Element, I: IntoDimension>(
    py: Python<'_>,
    shape: I,
) -> PyResult<Bound<'_, PyArray<T, I::Dim>>> {
    let shape = shape.into_dimension();
    let bytes = shape.size_checked().and_then(|number| number.checked_mul(size_of::<T>()));
    check("an array", bytes).map_err(|error| errors::memory(&error))?;
    Ok(PyArray::zeros(py, shape, false))
}
