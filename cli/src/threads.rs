//! The flag `--threads`.

use clap::builder::{RangedU64ValueParser, TypedValueParser};
use pogema_core::{MAX_THREADS, threads_note};

use crate::output::tell;

/// Returns a parser of a number of threads.
pub fn number_of_threads() -> impl TypedValueParser<Value = usize> {
    RangedU64ValueParser::<usize>::new().range(1..=MAX_THREADS as u64)
}

/// Prints a note if the machine has fewer cores than threads.
pub fn note_threads(threads: usize) {
    if let Some(note) = threads_note("--threads", threads) {
        tell(&format!("note: {note}"));
    }
}
