//! Long work off the main thread, so that Ctrl-C raises `KeyboardInterrupt` soon.
//!
//! Python runs its signal handlers on the main thread only. That thread therefore waits for the work, and checks for
//! signals meanwhile. On any other thread the work runs directly.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread::{Builder, scope};
use std::time::Duration;

use pogema_core::Error;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Time between two checks for signals.
const INTERVAL: Duration = Duration::from_millis(20);
/// Stack size of the worker thread, the same as that of the main thread on most systems.
const STACK_BYTES: usize = 8 << 20;
/// Smallest number of cells, agents or similar items for which a user may notice the time that work takes.
pub const LONG: usize = 1 << 18;

/// Does work that owns all its data, without the GIL.
///
/// If a signal handler raises, returns its exception immediately; the thread drops the result when it is done.
pub fn detach<T: Send + 'static>(py: Python<'_>, work: impl FnOnce() -> T + Send + 'static) -> PyResult<T> {
    if !is_main_thread(py)? {
        return Ok(py.detach(work));
    }
    let (sender, mut receiver) = channel();
    let worker = builder().spawn(move || {
        let _ = sender.send(work());
    });
    let worker = worker.map_err(no_thread)?;
    match wait(py, &mut receiver)? {
        Some(result) => Ok(result),
        None => match py.detach(|| worker.join()) {
            Err(panic) => resume_unwind(panic),
            Ok(()) => Err(PyRuntimeError::new_err("the thread ended without a result")),
        },
    }
}

/// Does work that borrows data, without the GIL.
///
/// If a signal handler raises, sets `stop`, waits until the work has stopped, and returns the exception. The work
/// must check `stop` often, and leave its state valid when it stops.
pub fn detach_scoped<T: Send>(
    py: Python<'_>,
    stop: &AtomicBool,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    stop.store(false, Relaxed);
    if !is_main_thread(py)? {
        return Ok(py.detach(work));
    }
    scope(|scope| {
        let (sender, mut receiver) = channel();
        let worker = builder().spawn_scoped(scope, move || {
            let _ = sender.send(work());
        });
        let worker = worker.map_err(no_thread)?;
        let waited = wait(py, &mut receiver);
        stop.store(waited.is_err(), Relaxed);
        if let Err(panic) = py.detach(|| worker.join()) {
            resume_unwind(panic);
        }
        stop.store(false, Relaxed);
        waited?.ok_or_else(|| PyRuntimeError::new_err("the thread ended without a result"))
    })
}

fn builder() -> Builder {
    Builder::new().name("pogema work".into()).stack_size(STACK_BYTES)
}

fn no_thread(error: std::io::Error) -> PyErr {
    PyRuntimeError::new_err(Error::external("thread", error).to_string())
}

/// Waits for a result and checks for signals; returns `None` if the worker panicked.
fn wait<T: Send>(py: Python<'_>, receiver: &mut Receiver<T>) -> PyResult<Option<T>> {
    loop {
        // A receiver can be sent to other threads, but not shared with them.
        let receiver = &mut *receiver;
        match py.detach(move || receiver.recv_timeout(INTERVAL)) {
            Ok(result) => return Ok(Some(result)),
            Err(RecvTimeoutError::Disconnected) => return Ok(None),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
        }
    }
}

fn is_main_thread(py: Python<'_>) -> PyResult<bool> {
    // While Python shuts down, it imports nothing and runs no signal handlers.
    let Ok(threading) = py.import("threading") else { return Ok(false) };
    let main = threading.call_method0("main_thread")?.getattr("ident")?;
    threading.call_method0("get_ident")?.eq(main)
}
