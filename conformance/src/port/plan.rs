//! What a run checks.

use std::path::PathBuf;

use pogema_core::words;

use super::protocol::Profile;

/// What to check.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// How many cases to draw.
    pub num_cases: u64,
    /// Seed of the drawn cases.
    pub seed: u64,
    /// Only rules that this matches.
    pub rules: Option<glob::Pattern>,
    /// Only these profiles; all that are claimed, if there are none.
    pub profiles: Vec<Profile>,
    /// How many cases are played side by side; one for each processor, if none is given.
    pub num_workers: Option<usize>,
    /// These cases alone, and nothing else, if there are any.
    pub files: Vec<PathBuf>,
    /// These parts alone; all, if there are none.
    pub parts: Vec<Part>,
}

words! {
    /// A part of a run.
    pub enum Part {
        /// The hand-written cases.
        Cases = "cases",
        /// The recordings of POGEMA 1.4.0.
        Recordings = "recordings",
        /// Drawn cases.
        Drawn = "drawn",
    }
}
