//! The finished episodes of an algorithm, and the files that keep them.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pogema_core::Error;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::bounded::read_bounded;
use crate::results::{Episode, Proof, Row};
use crate::store::{EPISODES, FAILED, LINES, RESULTS, Store, remove};
use crate::{EpisodeConfigs, Pairs};

/// A finished episode.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Done {
    /// Its index.
    pub index: usize,
    /// Its metrics, and further measurements of the player.
    pub metrics: Pairs,
    /// Time of the policy. Units: seconds.
    pub runtime: f64,
    /// Time spent in the policy's network, if it has one; with several threads, the longest time that one of them spent
    /// there. Units: seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub network_time: Option<f64>,
    /// The machine, if it differs from that of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub machine: Option<String>,
    /// Index of the run that played it, set by [`Progress::keep`].
    #[serde(default)]
    pub run: usize,
    /// What the planner proved.
    #[serde(default, skip_serializing_if = "Proof::is_empty")]
    pub proof: Proof,
}

/// An episode that could not be played.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Failed {
    /// Its index.
    pub index: usize,
    /// The varied fields.
    pub env_grid_search: Pairs,
    /// The complete config.
    pub config: Value,
    /// The error, in one line.
    pub error: String,
    /// The traceback of the error, if known.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub traceback: String,
}

/// Writes the episodes of an algorithm to a file while it plays.
#[derive(Debug)]
pub struct Progress {
    store: Arc<Store>,
    key: String,
    run: usize,
    path: PathBuf,
    file: File,
    done: Vec<bool>,
    failed: Option<File>,
}

impl Progress {
    /// Reads which of an algorithm's `num_episodes` episodes are done; `None` if its results are already written.
    ///
    /// An incomplete last line, left by an interrupted run, is removed from the file.
    ///
    /// # Errors
    /// If a file cannot be read, written or removed, or holds anything that this type did not write.
    pub fn open(store: &Arc<Store>, key: &str, num_episodes: usize) -> Result<Option<Self>, Error> {
        if store.path(&format!("{key}{RESULTS}")).exists() {
            // The last run may have been interrupted after it wrote all results.
            remove(&store.path(&format!("{key}{LINES}")))?;
            return Ok(None);
        }
        remove(&store.path(&format!("{key}{FAILED}")))?;
        let path = store.path(&format!("{key}{LINES}"));
        let failed = |error: std::io::Error| Error::io(&path, error);
        let (lines, whole) = read(&path, num_episodes)?;
        // Windows cannot truncate a file that is open for appending. The store's lock excludes other writers.
        let mut file =
            OpenOptions::new().create(true).write(true).truncate(false).open(&path).map_err(failed)?;
        truncate(&mut file, whole).map_err(failed)?;
        let mut done = vec![false; num_episodes];
        for line in &lines {
            done[line.index] = true;
        }
        let run = store.run()?;
        Ok(Some(Self { store: Arc::clone(store), key: key.to_owned(), run, path, file, done, failed: None }))
    }

    /// Returns the indices of the episodes that are not done.
    pub fn to_do(&self) -> Vec<usize> {
        (0..self.done.len()).filter(|&index| !self.done[index]).collect()
    }

    /// Returns the number of episodes that are done.
    pub fn num_done(&self) -> usize {
        self.done.iter().filter(|&&done| done).count()
    }

    /// Writes a finished episode.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn keep(&mut self, mut done: Done) -> Result<(), Error> {
        done.run = self.run;
        append(&mut self.file, &self.path, &done)?;
        self.done[done.index] = true;
        Ok(())
    }

    /// Writes an episode that could not be played; the next run retries it.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn note(&mut self, failed: &Failed) -> Result<(), Error> {
        let path = self.store.path(&format!("{}{FAILED}", self.key));
        let file = match &mut self.failed {
            Some(file) => file,
            none => none.insert(File::create(&path).map_err(|error| Error::io(&path, error))?),
        };
        append(file, &path, failed)
    }

    /// Writes the results if all episodes are done; returns whether they are.
    ///
    /// # Errors
    /// If the results cannot be written. In this case, the finished episodes are kept.
    pub fn finish(self, environments: &EpisodeConfigs) -> Result<bool, Error> {
        if self.done.contains(&false) {
            return Ok(false);
        }
        let (lines, _) = read(&self.path, self.done.len())?;
        let (mut rows, mut episodes) = (Vec::with_capacity(lines.len()), Vec::with_capacity(lines.len()));
        for line in sorted(lines) {
            let settings = environments.changes(line.index)?;
            let algorithm = self.key.clone();
            rows.push(self.to_json(&Row { metrics: line.metrics, settings, algorithm, ..Row::default() })?);
            let config = Value::Object(environments.named_fields(line.index)?);
            episodes.push(self.to_json(&Episode {
                episode: line.index,
                seed: config.get("seed").cloned().unwrap_or_default(),
                config,
                seconds: Some(line.runtime),
                network_seconds: line.network_time,
                run: line.run,
                machine: line.machine,
                proof: line.proof,
            })?);
        }
        self.store.write(&format!("{}{EPISODES}", self.key), list(&episodes).as_bytes())?;
        self.store.write(&format!("{}{RESULTS}", self.key), list(&rows).as_bytes())?;
        remove(&self.path)?;
        Ok(true)
    }

    fn to_json(&self, value: &impl Serialize) -> Result<String, Error> {
        serde_json::to_string(value).map_err(|error| Error::io(&self.path, error))
    }
}

/// Returns a JSON list with one element per line.
fn list(elements: &[String]) -> String {
    format!("[\n{}\n]\n", elements.join(",\n"))
}

fn append(file: &mut File, path: &Path, value: &impl Serialize) -> Result<(), Error> {
    let failed = |error: std::io::Error| Error::io(path, error);
    let mut line = serde_json::to_vec(value).map_err(|error| Error::io(path, error))?;
    line.push(b'\n');
    let whole = file.stream_position().map_err(failed)?;
    // Write the line in one call, so that a process killed here leaves the whole line or none. If the disk is full,
    // truncate the file to its previous length.
    file.write_all(&line).map_err(|error| {
        let _ = truncate(file, whole);
        failed(error)
    })
}

/// Truncates a file to a length; the next write continues there.
fn truncate(file: &mut File, length: u64) -> std::io::Result<()> {
    file.set_len(length)?;
    file.seek(SeekFrom::Start(length)).map(|_| ())
}

/// Reads the episodes of a file, and returns the number of bytes in complete lines as well.
fn read(path: &Path, num_episodes: usize) -> Result<(Vec<Done>, u64), Error> {
    let is_there = path.try_exists().map_err(|error| Error::io(path, error))?;
    let bytes = if is_there { read_bounded(path)? } else { Vec::new() };
    let whole = bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |last| last + 1);
    let mut seen: BTreeMap<usize, usize> = BTreeMap::new();
    let mut lines = Vec::new();
    for (number, line) in (1..).zip(bytes[..whole].split_inclusive(|&byte| byte == b'\n')) {
        let wrong = |reason: String| Error::io(path, format!("line {number}: {reason}"));
        let done: Done = serde_json::from_slice(line).map_err(|error| wrong(error.to_string()))?;
        if done.index >= num_episodes {
            return Err(wrong(format!("episode `{}`, expected one below {num_episodes}", done.index)));
        }
        if let Some(first) = seen.insert(done.index, number) {
            return Err(wrong(format!("duplicate episode `{}`, first in line {first}", done.index)));
        }
        lines.push(done);
    }
    Ok((lines, whole as u64))
}

fn sorted(mut lines: Vec<Done>) -> Vec<Done> {
    lines.sort_by_key(|line| line.index);
    lines
}
