//! The episodes that an algorithm has done, and what is written of them.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pogema_core::Error;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::results::{Episode, Proof, Row};
use crate::store::{EPISODES, FAILED, LINES, RESULTS, Store, remove};
use crate::{EpisodeConfigs, Pairs};

/// An episode that is done.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Done {
    /// Its number.
    pub index: usize,
    /// Its figures, and whatever else the one who played it measured.
    pub metrics: Pairs,
    /// What the policy took of it. Units: seconds.
    pub runtime: f64,
    /// The machine, if it is not that of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub machine: Option<String>,
    /// The number of the run that played it, which is set when it is kept.
    #[serde(default)]
    pub run: usize,
    /// What its planner proved.
    #[serde(default, skip_serializing_if = "Proof::is_empty")]
    pub proof: Proof,
}

/// An episode that could not be played.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Failed {
    /// Its number.
    pub index: usize,
    /// What was varied.
    pub env_grid_search: Pairs,
    /// All that makes it.
    pub config: Value,
    /// What happened, in one line.
    pub error: String,
    /// Where it happened, if that is known.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub traceback: String,
}

/// The file to which the episodes of an algorithm are written while it plays.
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
    /// Takes up what is done of so many episodes of an algorithm; none if all are.
    ///
    /// # Errors
    /// If a file holds anything else than this wrote. What a run that broke off wrote last is taken off the file.
    pub fn open(store: &Arc<Store>, key: &str, num_episodes: usize) -> Result<Option<Self>, Error> {
        if store.path(&format!("{key}{RESULTS}")).exists() {
            // A run may have broken off after it had written all.
            remove(&store.path(&format!("{key}{LINES}")))?;
            return Ok(None);
        }
        remove(&store.path(&format!("{key}{FAILED}")))?;
        let path = store.path(&format!("{key}{LINES}"));
        let failed = |error: std::io::Error| Error::io(&path, error);
        let (lines, whole) = read(&path, num_episodes)?;
        let file = OpenOptions::new().create(true).append(true).open(&path).map_err(failed)?;
        file.set_len(whole).map_err(failed)?;
        let mut done = vec![false; num_episodes];
        for line in &lines {
            done[line.index] = true;
        }
        let run = store.run()?;
        Ok(Some(Self { store: Arc::clone(store), key: key.to_owned(), run, path, file, done, failed: None }))
    }

    /// The episodes that are not done.
    pub fn to_do(&self) -> Vec<usize> {
        (0..self.done.len()).filter(|&index| !self.done[index]).collect()
    }

    /// Number of episodes that are done.
    pub fn num_done(&self) -> usize {
        self.done.iter().filter(|&&done| done).count()
    }

    /// Keeps an episode.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn keep(&mut self, mut done: Done) -> Result<(), Error> {
        done.run = self.run;
        append(&mut self.file, &self.path, &done)?;
        self.done[done.index] = true;
        Ok(())
    }

    /// Notes an episode that could not be played; the next run tries again.
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

    /// Writes the results, if all episodes are done; says whether they are.
    ///
    /// # Errors
    /// If they cannot be written; what is done stays kept then.
    pub fn finish(self, environments: &EpisodeConfigs) -> Result<bool, Error> {
        if self.done.contains(&false) {
            return Ok(false);
        }
        let (lines, _) = read(&self.path, self.done.len())?;
        let (mut rows, mut episodes) = (Vec::with_capacity(lines.len()), Vec::with_capacity(lines.len()));
        for line in sorted(lines) {
            let settings = environments.changes(line.index)?;
            let algorithm = self.key.clone();
            rows.push(self.told(&Row { metrics: line.metrics, settings, algorithm, ..Row::default() })?);
            let config = Value::Object(environments.named_fields(line.index)?);
            episodes.push(self.told(&Episode {
                episode: line.index,
                seed: config.get("seed").cloned().unwrap_or_default(),
                config,
                seconds: Some(line.runtime),
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

    fn told(&self, value: &impl Serialize) -> Result<String, Error> {
        serde_json::to_string(value).map_err(|error| Error::io(&self.path, error))
    }
}

/// A list in JSON with a line for each of its elements.
fn list(elements: &[String]) -> String {
    format!("[\n{}\n]\n", elements.join(",\n"))
}

fn append(file: &mut File, path: &Path, value: &impl Serialize) -> Result<(), Error> {
    let failed = |error: std::io::Error| Error::io(path, error);
    let mut line = serde_json::to_vec(value).map_err(|error| Error::io(path, error))?;
    line.push(b'\n');
    let whole = file.metadata().map_err(failed)?.len();
    // One call, so that whoever ends this process ends it before or after; what a full disk took is taken back.
    file.write_all(&line).map_err(|error| {
        let _ = file.set_len(whole);
        failed(error)
    })
}

/// The episodes of a file, and how many of its bytes are whole lines.
fn read(path: &Path, num_episodes: usize) -> Result<(Vec<Done>, u64), Error> {
    let bytes = match fs::read(path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Vec::new(),
        bytes => bytes.map_err(|error| Error::io(path, error))?,
    };
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
            return Err(wrong(format!("episode `{}` again, which stands in line {first}", done.index)));
        }
        lines.push(done);
    }
    Ok((lines, whole as u64))
}

fn sorted(mut lines: Vec<Done>) -> Vec<Done> {
    lines.sort_by_key(|line| line.index);
    lines
}
