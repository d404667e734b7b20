//! Converts errors to the Python classes that POGEMA's users catch.

use std::io::ErrorKind;

use pogema_core::{Error, one_line};
use pyo3::PyErrArguments;
use pyo3::exceptions::{PyFileNotFoundError, PyMemoryError, PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyType;

/// Makes an error of a class of `pogema_rs.errors`.
fn of_class(py: Python<'_>, class: &str, error: impl std::fmt::Display) -> PyErr {
    made(py, class, (error.to_string(),))
}

fn made(py: Python<'_>, class: &str, arguments: impl PyErrArguments + 'static) -> PyErr {
    let class = py
        .import("pogema_rs.errors")
        .and_then(|module| module.getattr(class)?.cast_into::<PyType>().map_err(PyErr::from));
    class.map_or_else(|missing| missing, |class| PyErr::from_type(class, arguments))
}

/// Converts an error in a config; the Python side turns it into the class that POGEMA raises.
pub fn config(py: Python<'_>, error: &Error) -> PyErr {
    match error {
        Error::Memory { .. } => memory(error),
        Error::CellOutside { .. } => of_class(py, "OutsideMapError", error),
        Error::UnknownCharacter { .. } => of_class(py, "MapTextError", error),
        _ => {
            let field = error.field().map(str::to_owned);
            made(py, "RejectedConfigError", (error.to_string(), field, error.reason()))
        }
    }
}

/// Converts an error from making an instance.
pub fn instance(py: Python<'_>, error: &Error) -> PyErr {
    match error {
        Error::Memory { .. } => memory(error),
        _ => of_class(py, "InstanceError", error),
    }
}

/// Converts an error from any other call.
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

/// Converts an error about memory.
pub fn memory(error: &Error) -> PyErr {
    PyMemoryError::new_err(error.to_string())
}

/// Returns the error for an entry point that panicked.
pub fn internal(text: &str) -> PyErr {
    let text = one_line(format_args!("internal error, please report it: {text}"));
    Python::attach(|py| of_class(py, "InternalError", text))
}

/// Returns the error of a call that was made during a call of another thread; `what` names the object, for example
/// "this planner".
pub fn busy(py: Python<'_>, what: &'static str) -> PyErr {
    of_class(py, "StateError", Error::Busy { what })
}

/// Converts an error of an A* agent that was not cleared before a new episode.
pub fn astar(py: Python<'_>, error: &Error) -> PyErr {
    of_class(py, "JumpedError", error)
}

/// Converts an error from a call of a batch.
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

/// Converts an error of a learned policy that plays a batch.
pub fn policy(py: Python<'_>, error: &Error) -> PyErr {
    match error {
        Error::Memory { .. } => memory(error),
        _ => call(py, error),
    }
}

/// Returns the error for an invalid action in a batch.
pub fn action(py: Python<'_>, text: String) -> PyErr {
    of_class(py, "ActionError", text)
}

/// Converts an error from generating or reading a map.
pub fn map(py: Python<'_>, error: &Error) -> PyErr {
    match error {
        Error::Memory { .. } => memory(error),
        // pogema-toolbox raises an AssertionError for wrong sides of maps.
        Error::Argument { name, .. } if matches!(&**name, "width" | "height") => {
            of_class(py, "MapShapeError", error)
        }
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// Converts an error from the start of a film: a missing program, or a thread that cannot be started.
pub fn film(py: Python<'_>, error: &Error) -> PyErr {
    match error {
        Error::Request { .. } => PyFileNotFoundError::new_err(error.to_string()),
        _ => call(py, error),
    }
}

/// Converts an error in the arguments of a planner.
pub fn plan(error: &Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Converts an error from files: a system error to `OSError`, any other, for example wrong content, to `ValueError`.
pub fn file(error: &Error) -> PyErr {
    let text = error.to_string();
    match system_kind(error) {
        None | Some(ErrorKind::InvalidData) => PyValueError::new_err(text),
        Some(ErrorKind::NotFound) => PyFileNotFoundError::new_err(text),
        Some(_) => PyOSError::new_err(text),
    }
}

/// Converts an error from a folder of results: wrong content of a file, too, becomes an `OSError`.
pub fn folder(error: &Error) -> PyErr {
    match error {
        Error::Io { .. } if system_kind(error) != Some(ErrorKind::NotFound) => {
            PyOSError::new_err(error.to_string())
        }
        _ => file(error),
    }
}

/// Returns the kind of an error of the system.
fn system_kind(error: &Error) -> Option<ErrorKind> {
    let Error::Io { cause, .. } = error else { return None };
    // If one file names another, an error about the named file is inside the error about the file that names it.
    let inner = cause.get().downcast_ref::<Error>().and_then(system_kind);
    inner.or_else(|| cause.get().downcast_ref::<std::io::Error>().map(std::io::Error::kind))
}
