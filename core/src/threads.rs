//! Numbers of threads that arguments and flags ask for.

use crate::Error;

/// The most threads that any call accepts.
pub const MAX_THREADS: usize = 1024;

/// Passes a number of threads from 1 to [`MAX_THREADS`].
///
/// # Errors
/// [`Error::Argument`] with the argument and its value.
pub fn check_threads(argument: &str, threads: usize) -> Result<usize, Error> {
    if (1..=MAX_THREADS).contains(&threads) {
        return Ok(threads);
    }
    Err(Error::argument(argument, threads, format!("1 to {MAX_THREADS}")))
}

/// Returns a note about a number of threads that exceeds the number of cores.
pub fn threads_note(argument: &str, threads: usize) -> Option<String> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    (threads > cores).then(|| format!("`{argument}` is {threads}, the machine has {cores} cores"))
}
