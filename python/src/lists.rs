//! Converts between buffers and POGEMA's lists, tuples and dictionaries.

use pogema_core::{Action, Cell, Error, one_line, shorten};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Reads actions as POGEMA does, and returns the first agent with an invalid number, if any.
///
/// Accepts any sequence of integers from 0 to 4 or, like Python's indices from the end of a list, from -5 to -1.
/// Ignores the actions of agents that are not active.
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
        let number: i64 = item
            .extract()
            .or_else(|error| clamp_large(&item, error))
            .map_err(|error| type_error(error, &item, &format!("action of agent {agent}"), Error::ACTIONS))?;
        let index = if number < 0 { number + Action::ALL.len() as i64 } else { number };
        match usize::try_from(index).ok().and_then(|index| Action::ALL.get(index)) {
            Some(&action) => out.push(action),
            None => return Ok(Some((agent, number))),
        }
    }
    Ok(None)
}

/// Maps an integer that does not fit in 64 bits to `i64::MAX`, which is not an action either.
fn clamp_large(item: &Bound<'_, PyAny>, error: PyErr) -> PyResult<i64> {
    if error.is_instance_of::<pyo3::exceptions::PyOverflowError>(item.py()) {
        Ok(i64::MAX)
    } else {
        Err(error)
    }
}

/// Returns the `TypeError` for a value of a wrong type; other errors, which the value itself raised, stay as they are.
pub fn type_error(error: PyErr, value: &Bound<'_, PyAny>, what: &str, expected: &str) -> PyErr {
    let py = value.py();
    if !error.is_instance_of::<PyTypeError>(py) {
        return error;
    }
    let Ok(found) = value.repr().map(|text| one_line(shorten(&text.to_string(), Error::LONGEST_QUOTE)))
    else {
        return error;
    };
    let named = PyTypeError::new_err(format!("{what} is `{found}`, expected {expected}"));
    named.set_cause(py, Some(error));
    named
}

/// One (row, col) pair per agent.
pub type Pairs = Vec<(i64, i64)>;

/// Returns cells as pairs, with `shift` added to both coordinates.
pub fn pairs(cells: &[Cell], shift: i64) -> Pairs {
    cells.iter().map(|cell| (i64::from(cell.row) + shift, i64::from(cell.col) + shift)).collect()
}

/// Converts an agent's cell from the coordinates of a map with a border to those of the map without it; `what` names
/// the cell.
///
/// # Errors
/// If the cell is not on the largest possible map.
pub fn cell(what: &str, agent: usize, [row, col]: [i64; 2], border: i64) -> Result<Cell, Error> {
    let number = |value: i64| value.checked_sub(border).and_then(|value| u16::try_from(value).ok());
    let found = number(row).zip(number(col)).map(|(row, col)| Cell::new(row, col));
    found.ok_or_else(|| Error::agent(agent, format!("cell ({row}, {col}) of `{what}` is not on the map")))
}

/// Returns pairs as a list of tuples.
pub fn tuples<'py>(py: Python<'py>, pairs: &[(i64, i64)]) -> PyResult<Bound<'py, PyList>> {
    PyList::new(py, pairs)
}

/// Returns one dictionary per agent, which says whether the agent is active.
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
