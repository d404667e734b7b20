//! The plan of a run: what it checks.

use std::path::PathBuf;

use pogema_core::{Words as _, words};

use super::protocol::Profile;

/// The items to check, and how.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// Number of random episodes.
    pub num_cases: u64,
    /// Seed of the random episodes.
    pub seed: u64,
    /// A pattern; only matching rules are checked [default: all rules].
    pub rules: Option<glob::Pattern>,
    /// The profiles to check, in addition to `core` [default: all that are claimed].
    pub profiles: Vec<Profile>,
    /// Number of cases played in parallel [default: one per core].
    pub num_workers: Option<usize>,
    /// Case files. If there are any, only they are checked.
    pub files: Vec<PathBuf>,
    /// The parts to check [default: all].
    pub parts: Vec<Part>,
}

impl Plan {
    /// Returns whether a feature is not checked because its profile was not selected.
    pub fn leaves_out(&self, feature: &str) -> bool {
        let is_selected = |profile: &Profile| *profile == Profile::Core || self.profiles.contains(profile);
        let mut others = Profile::all().filter(|profile| !is_selected(profile));
        !self.profiles.is_empty() && others.any(|profile| feature == format!("profile {profile}"))
    }
}

words! {
    /// A part of a run.
    pub enum Part {
        /// The hand-written cases.
        Cases = "cases",
        /// The recordings of POGEMA 1.4.0.
        Recordings = "recordings",
        /// Random episodes.
        Drawn = "drawn",
    }
}
