//! From buffers to the lists, tuples and dictionaries that POGEMA returns.

use pogema_core::{Action, Cell};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Actions as POGEMA reads them: whatever has a length and gives whole numbers, from 0 to 4 or, as Python counts
/// from the end of a list, from -5 to -1. Those of agents that are gone are not looked at.
///
/// Rule: move/actions, move/inactive
pub fn read_actions(
    actions: &Bound<'_, PyAny>,
    active: &[bool],
    out: &mut Vec<Action>,
) -> PyResult<Option<(usize, i64)>> {
    out.clear();
    for (agent, &is_active) in active.iter().enumerate() {
        if !is_active {
            out.push(Action::Stay);
            continue;
        }
        let item = actions.get_item(agent)?;
        let number: i64 = item.extract().or_else(|error| clamp_large(&item, error))?;
        let index = if number < 0 { number + Action::ALL.len() as i64 } else { number };
        match usize::try_from(index).ok().and_then(|index| Action::ALL.get(index)) {
            Some(&action) => out.push(action),
            None => return Ok(Some((agent, number))),
        }
    }
    Ok(None)
}

/// Whole numbers too large for 64 bits are no actions either.
fn clamp_large(item: &Bound<'_, PyAny>, error: PyErr) -> PyResult<i64> {
    if error.is_instance_of::<pyo3::exceptions::PyOverflowError>(item.py()) {
        Ok(i64::MAX)
    } else {
        Err(error)
    }
}

/// One place of every agent, (row, col).
pub type Pairs = Vec<(i64, i64)>;

/// The cells of agents, shifted by the border.
pub fn pairs(cells: &[Cell], shift: i64) -> Pairs {
    cells.iter().map(|cell| (i64::from(cell.row) + shift, i64::from(cell.col) + shift)).collect()
}

/// A list of tuples.
pub fn tuples<'py>(py: Python<'py>, pairs: &[(i64, i64)]) -> PyResult<Bound<'py, PyList>> {
    PyList::new(py, pairs)
}

/// A dictionary for each agent that says whether it takes part.
pub fn infos<'py>(py: Python<'py>, active: &[bool]) -> PyResult<Bound<'py, PyList>> {
    let key = pyo3::intern!(py, "is_active");
    let infos = PyList::empty(py);
    for &is_active in active {
        let info = PyDict::new(py);
        info.set_item(key, is_active)?;
        infos.append(info)?;
    }
    Ok(infos)
}
