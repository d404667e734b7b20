//! The way from Python into this module: every entry is inside [`guarded!`].

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, MutexGuard, TryLockError};

use pyo3::prelude::*;

use crate::errors;

/// Defines functions and methods for Python, and turns a panic inside them into an `InternalError`.
///
/// pyo3 would raise a `PanicException`, which `except Exception` does not catch.
macro_rules! guarded {
    (
        $(#[$($attribute:tt)*])*
        impl $class:ident {
            $(
                $(#[$($inner:tt)*])*
                $vis:vis fn $name:ident $(<$life:lifetime>)? ($($arguments:tt)*) -> PyResult<$value:ty> $body:block
            )*
        }
    ) => {
        $(#[$($attribute)*])*
        impl $class {
            $(
                $(#[$($inner)*])*
                $vis fn $name $(<$life>)? ($($arguments)*) -> PyResult<$value> {
                    crate::guard::run(move || $body)
                }
            )*
        }
    };
    (
        $(#[$($attribute:tt)*])*
        $vis:vis fn $name:ident $(<$life:lifetime>)? ($($arguments:tt)*) -> PyResult<$value:ty> $body:block
    ) => {
        $(#[$($attribute)*])*
        $vis fn $name $(<$life>)? ($($arguments)*) -> PyResult<$value> {
            crate::guard::run(move || $body)
        }
    };
}
pub(crate) use guarded;

/// Runs the body of an entry.
pub fn run<T>(body: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|panic| Err(errors::internal(&text(&*panic))))
}

/// Locks an object for one call, without waiting; `what` names the object with its article.
///
/// Errors: `StateError` while another thread is inside a call, `InternalError` after a call that panicked.
pub fn lock<'a, T>(py: Python<'_>, mutex: &'a Mutex<T>, what: &'static str) -> PyResult<MutexGuard<'a, T>> {
    mutex.try_lock().map_err(|error| match error {
        TryLockError::WouldBlock => errors::busy(py, what),
        TryLockError::Poisoned(_) => {
            errors::internal(&format!("an earlier call of {what} failed: make a new one"))
        }
    })
}

/// Returns the message of a panic.
pub fn text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic without a message").to_owned()
}

guarded! {
/// Panics, for the test of this module.
#[pyfunction]
#[pyo3(name = "_panic")]
#[expect(clippy::panic, reason = "the test needs a panic")]
pub fn force_panic(text: &str) -> PyResult<()> {
    panic!("{text}")
}
}
