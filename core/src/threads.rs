//! Numbers of threads in arguments and flags.

use crate::{Error, counted};

/// Largest number of threads that a call accepts.
pub const MAX_THREADS: usize = 1024;

/// Returns the number of threads if it is from 1 to [`MAX_THREADS`].
///
/// # Errors
/// [`Error::Argument`] with the argument and its value for any other number.
pub fn check_threads(argument: &str, threads: usize) -> Result<usize, Error> {
    if (1..=MAX_THREADS).contains(&threads) {
        return Ok(threads);
    }
    Err(Error::argument(argument, threads, format!("1 to {MAX_THREADS}")))
}

/// Returns a note if the number of threads exceeds the number of cores.
pub fn threads_note(argument: &str, threads: usize) -> Option<String> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    (threads > cores)
        .then(|| format!("`{argument}` is {threads}, but the machine has only {}", counted(cores, "core")))
}
