//! Ctrl-C: a command keeps its results and exits with status 130.

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use pogema_core::Error;

use crate::output::tell;

/// The exit status of an interrupted command: 128 plus the number of the signal, as a shell reports it.
const INTERRUPTED: u8 = 130;

/// On Ctrl-C, calls `keep` to keep the results, prints the line that `keep` returns, and ends the program.
///
/// # Errors
/// [`Error::External`] if the system refuses the handler, or the process has a handler already.
pub fn exit_on_ctrl_c(mut keep: impl FnMut() -> String + Send + 'static) -> Result<(), Error> {
    on_ctrl_c(move || {
        tell(&format!("interrupted: {}", keep()));
        std::process::exit(INTERRUPTED.into());
    })
}

/// A flag that Ctrl-C sets, for work that checks it. A second Ctrl-C ends the program.
#[derive(Clone, Debug)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Returns a flag that Ctrl-C sets from now on.
    ///
    /// # Errors
    /// [`Error::External`] if the system refuses the handler, or the process has a handler already.
    pub fn watch() -> Result<Self, Error> {
        let interrupt = Self(Arc::default());
        let flag = interrupt.flag();
        on_ctrl_c(move || {
            if flag.swap(true, Relaxed) {
                std::process::exit(INTERRUPTED.into());
            }
        })?;
        Ok(interrupt)
    }

    /// Returns the flag, which is set on Ctrl-C.
    pub fn flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.0)
    }

    /// Returns the exit status of an interrupted command, if this one was interrupted.
    pub fn status(&self) -> Option<ExitCode> {
        self.0.load(Relaxed).then(|| ExitCode::from(INTERRUPTED))
    }
}

fn on_ctrl_c(handle: impl FnMut() + Send + 'static) -> Result<(), Error> {
    ctrlc::set_handler(handle).map_err(|error| Error::external("Ctrl-C", error))
}
