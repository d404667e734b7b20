//! Errors as the Python classes that POGEMA's users catch.

use pogema_core::Error;
use pyo3::PyErrArguments;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyType;

/// An error of a class of `pogema_rs.errors`.
fn of_class(py: Python<'_>, class: &str, error: impl std::fmt::Display) -> PyErr {
    made(py, class, (error.to_string(),))
}

fn made(py: Python<'_>, class: &str, arguments: impl PyErrArguments + 'static) -> PyErr {
    let class = py
        .import("pogema_rs.errors")
        .and_then(|module| module.getattr(class)?.cast_into::<PyType>().map_err(PyErr::from));
    class.map_or_else(|missing| missing, |class| PyErr::from_type(class, arguments))
}

/// What a wrong config raises; the Python side makes it the class that POGEMA raises.
pub fn config(py: Python<'_>, error: &Error) -> PyErr {
    match error {
        Error::CellOutside { .. } => of_class(py, "OutsideMapError", error),
        Error::UnknownLetter { .. } => of_class(py, "MapTextError", error),
        _ => {
            let field = error.field().map(str::to_owned);
            made(py, "RefusedConfigError", (error.to_string(), field, error.reason()))
        }
    }
}

/// What an instance that cannot be made raises.
pub fn instance(py: Python<'_>, error: &Error) -> PyErr {
    of_class(py, "InstanceError", error)
}

/// What any other call raises.
pub fn call(py: Python<'_>, error: &Error) -> PyErr {
    let class = match error {
        Error::Length { what: "actions", .. } => "ActionCountError",
        Error::Action { .. } => "ActionError",
        Error::NotReset => "NotResetError",
        Error::StepsNotKept => "NotKeptError",
        _ => "StateError",
    };
    of_class(py, class, error)
}

/// What a call raises while another thread's is under way.
pub fn busy(py: Python<'_>) -> PyErr {
    of_class(py, "StateError", Error::Busy { what: "this environment" })
}

/// What an A* agent raises that was not told of a new episode.
pub fn astar(py: Python<'_>, error: &Error) -> PyErr {
    of_class(py, "JumpedError", error)
}

/// What a call of many environments raises.
pub fn batch(py: Python<'_>, error: &Error) -> PyErr {
    match error {
        Error::Length { .. }
        | Error::Action { .. }
        | Error::NotReset
        | Error::NotEnded { .. }
        | Error::Corrupt { .. }
        | Error::External { .. } => call(py, error),
        _ => instance(py, error),
    }
}

/// What a number raises that is no action of one environment of many.
pub fn action(py: Python<'_>, text: String) -> PyErr {
    of_class(py, "ActionError", text)
}

/// What a planner's caller did wrong.
pub fn plan(error: &Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}
