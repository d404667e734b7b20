//! Guards the entry points from Python: each is inside [`guarded!`].

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};

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
                    crate::guard::run(concat!(stringify!($class), "::", stringify!($name)), move || $body)
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
            crate::guard::run(stringify!($name), move || $body)
        }
    };
}
pub(crate) use guarded;

/// Runs the body of an entry, named as in its source.
pub fn run<T>(entry: &'static str, body: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    let body = || {
        panic_if_forced(entry);
        body()
    };
    catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|panic| Err(errors::internal(&text(&*panic))))
}

/// Whether a test forces a panic. If not, a call does not have to lock `FORCED`.
static IS_FORCED: AtomicBool = AtomicBool::new(false);
/// The entry whose next call panics, and the message.
static FORCED: Mutex<Option<(String, String)>> = Mutex::new(None);

#[expect(clippy::panic, reason = "a test needs a panic in each entry")]
fn panic_if_forced(entry: &str) {
    if !IS_FORCED.load(Ordering::Relaxed) {
        return;
    }
    let mut forced = FORCED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, message)) = forced.take_if(|(name, _)| name == entry) {
        IS_FORCED.store(false, Ordering::Relaxed);
        drop(forced);
        panic!("{message}");
    }
}

/// Locks an object for one call, without waiting; `what` names the object, for example "this planner".
///
/// Errors: `StateError` while another thread is inside a call, `InternalError` after a call that panicked.
pub fn lock<'a, T>(py: Python<'_>, mutex: &'a Mutex<T>, what: &'static str) -> PyResult<MutexGuard<'a, T>> {
    mutex.try_lock().map_err(|error| match error {
        TryLockError::WouldBlock => errors::busy(py, what),
        TryLockError::Poisoned(_) => {
            errors::internal(&format!("an earlier call of {what} failed; make a new object"))
        }
    })
}

/// Returns the message of a panic.
pub fn text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic without a message").to_owned()
}

guarded! {
/// Makes the next call of an entry panic, for the tests.
///
/// `entry` is the name of a function, or `Class::name`, as in the source.
#[pyfunction]
#[pyo3(name = "_force_panic")]
pub fn force_panic(entry: String, message: String) -> PyResult<()> {
    *FORCED.lock().unwrap_or_else(PoisonError::into_inner) = Some((entry, message));
    IS_FORCED.store(true, Ordering::Relaxed);
    Ok(())
}
}
