//! Replays episodes of an evaluation.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use pogema_core::{Error, Trace};

use crate::episode_configs::EpisodeConfigs;
use crate::manifest::Manifest;
use crate::play::{play, record};
use crate::progress::Done;
use crate::results::{Pairs, Row, figure};
use crate::run::{built_in_of, done, measured};
use crate::store::{ALGORITHMS, SUITE};
use crate::suite::Suite;

impl Suite {
    /// Reads the suite that was saved with the results in a folder.
    ///
    /// # Errors
    /// If the folder holds no results, or the suite saved with them is invalid.
    pub fn of_results(folder: &Path) -> Result<Self, Error> {
        let manifest = Manifest::read(folder)?;
        let manifest = manifest.ok_or_else(|| Error::io(folder, "holds no results of `pogema evaluate`"))?;
        let text = pogema_maps::files::read_text(&folder.join(SUITE))?;
        // Paths in the suite are relative to the folder of the original file.
        let suite = Self::parse(&manifest.suite, &text)?;
        let algorithms = folder.join(ALGORITHMS);
        if algorithms.exists() { suite.with_algorithms(&algorithms) } else { Ok(suite) }
    }

    /// Creates the environments of the suite, whose maps may also come from further files. Also returns a warning for
    /// each map that replaces another one.
    ///
    /// # Errors
    /// Those of [`EpisodeConfigs::new`], or if a file cannot be read.
    pub fn environments(&self, further: &[PathBuf]) -> Result<(EpisodeConfigs, Vec<String>), Error> {
        let (library, warnings) = self.library(further)?;
        Ok((EpisodeConfigs::new(self, library)?, warnings))
    }

    /// Plays an episode of the suite with one of its algorithms; returns the metrics and the trace. Another thread may
    /// set `stop` to end the call soon.
    ///
    /// # Errors
    /// If there is no such algorithm or episode, or the algorithm runs only in Python; [`Error::Cancelled`] if the call
    /// was stopped.
    pub fn play_again(
        &self,
        environments: &EpisodeConfigs,
        key: &str,
        index: usize,
        stop: &Arc<AtomicBool>,
    ) -> Result<(Pairs, Trace), Error> {
        let algorithm = self.algorithm(key).ok_or_else(|| {
            let known: Vec<&str> = self.algorithms.iter().map(|algorithm| algorithm.key.as_str()).collect();
            Error::argument("algorithm", key, format!("one of the suite's algorithms: {}", known.join(", ")))
        })?;
        let (played, trace) =
            record(&environments.at(index)?.config, &built_in_of(self, algorithm)?.cancelled_by(stop))?;
        Ok((measured(&played), trace))
    }

    /// Plays the first episode of the suite with its first algorithm.
    ///
    /// # Errors
    /// If the episode cannot be played, or the algorithm is not built in.
    pub fn play_first(&self, environments: &EpisodeConfigs) -> Result<Done, Error> {
        let algorithm = self.algorithms.first();
        let algorithm =
            algorithm.ok_or_else(|| Error::request("the suite has no algorithms, expected at least one"))?;
        let played = play(&environments.at(0)?.config, &built_in_of(self, algorithm)?)?;
        Ok(done(0, played))
    }
}

/// Returns the metrics in which a replayed episode differs from its row, each with both values.
pub fn differences(row: &Row, metrics: &Pairs) -> Vec<String> {
    let difference = |(name, then): (&String, &serde_json::Value)| {
        let (then, now) = (figure(then)?, figure(metrics.get(name)?)?);
        (then.to_bits() != now.to_bits()).then(|| format!("{name} is {now}, but {then} in the results"))
    };
    row.metrics.iter().filter_map(difference).collect()
}
