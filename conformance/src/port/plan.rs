//! The plan of a run: what it checks.

use std::path::PathBuf;

use pogema_core::words;

use super::protocol::Profile;

/// The items to check, and how.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// Number of random cases.
    pub num_cases: u64,
    /// Seed of the random cases.
    pub seed: u64,
    /// A pattern; only matching rules are checked [default: all rules].
    pub rules: Option<glob::Pattern>,
    /// The profiles to check [default: all that are claimed].
    pub profiles: Vec<Profile>,
    /// Number of cases played in parallel [default: one per core].
    pub num_workers: Option<usize>,
    /// Case files. If there are any, only they are checked.
    pub files: Vec<PathBuf>,
    /// The parts to check [default: all].
    pub parts: Vec<Part>,
}

words! {
    /// A part of a run.
    pub enum Part {
        /// The hand-written cases.
        Cases = "cases",
        /// The recordings of POGEMA 1.4.0.
        Recordings = "recordings",
        /// Random cases.
        Drawn = "drawn",
    }
}
