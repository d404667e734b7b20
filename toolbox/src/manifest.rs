//! The manifest of results: suite, algorithms, and the runs with their machines.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use pogema_core::files::read_within;
use pogema_core::{Error, InputLimit};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::bounded::read_bounded;
use crate::built_in::{self, Weights};
use crate::episode_configs::EpisodeConfigs;
use crate::suite::{Algorithm, Suite};

/// Name of the manifest's file.
pub(crate) const FILE: &str = "about.json";

/// A record of how results were made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Path of the suite's file; paths in the suite are relative to its folder.
    pub suite: PathBuf,
    /// Fingerprint of the environments.
    pub environment: String,
    /// Fingerprint of each algorithm, by its name among the results.
    pub algorithms: BTreeMap<String, String>,
    /// Fingerprint of the weights of each learned algorithm. Results of earlier releases have none.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub weights: BTreeMap<String, String>,
    /// Fingerprint of the maps that each name or pattern in the suite selects, and of each file with a scenario.
    /// Results of earlier releases have none.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub maps: BTreeMap<String, String>,
    /// The runs that played episodes. Each episode has the index of its run.
    pub runs: Vec<RunRecord>,
}

/// One process that played episodes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// Time at which it began to play, in RFC 3339 format.
    pub began: String,
    /// The processor and its number of threads.
    pub machine: String,
    /// Versions of the software, by name.
    pub versions: BTreeMap<String, String>,
}

impl Manifest {
    /// Returns the manifest of a suite before any run.
    ///
    /// # Errors
    /// If weights cannot be read.
    pub fn of(suite: &Suite, environments: &EpisodeConfigs) -> Result<Self, Error> {
        let algorithm = |algorithm: &Algorithm| (algorithm.key.clone(), digest(algorithm.fingerprint()));
        let mut weights = BTreeMap::new();
        for algorithm in &suite.algorithms {
            if let Some(found) = built_in::weights_of(algorithm, suite.folder()) {
                weights.insert(algorithm.key.clone(), digest_of_weights(&found)?);
            }
        }
        Ok(Self {
            suite: std::path::absolute(&suite.path).unwrap_or_else(|_| suite.path.clone()),
            environment: digest(suite.environments.fingerprint()),
            algorithms: suite.algorithms.iter().map(algorithm).collect(),
            weights,
            maps: environments.inputs().into_iter().map(|(name, bytes)| (name, digest(bytes))).collect(),
            runs: Vec::new(),
        })
    }

    /// Reads the manifest of the results in a folder; returns `None` if there is none.
    ///
    /// # Errors
    /// If the file cannot be read, or is not a manifest.
    pub fn read(folder: &Path) -> Result<Option<Self>, Error> {
        let path = folder.join(FILE);
        if !path.exists() {
            return Ok(None);
        }
        serde_json::from_slice(&read_bounded(&path)?).map(Some).map_err(|error| Error::io(&path, error))
    }

    /// Takes over the runs and algorithms of an earlier manifest; algorithms that are no longer in the suite are kept.
    ///
    /// # Errors
    /// The difference, if the earlier results were made with other environments, maps, parameters or weights. The
    /// manifest does not change then.
    pub(crate) fn continue_from(&mut self, known: Self) -> Result<(), String> {
        if known.environment != self.environment {
            let reason = "has results for environments that differ from those of the suite; choose another folder, or delete the \
                          results with `--force`";
            return Err(reason.into());
        }
        let changed = changed(&known.maps, &self.maps);
        if !changed.is_empty() {
            let reason = "choose another folder, or delete the results with `--force`";
            return Err(format!(
                "has results on maps or scenarios that have changed: {}; {reason}",
                quoted(&changed, "")
            ));
        }
        check_same("parameters", &known.algorithms, &self.algorithms)?;
        check_same("weights", &known.weights, &self.weights)?;
        self.algorithms.extend(known.algorithms);
        self.weights.extend(known.weights);
        self.runs = known.runs;
        Ok(())
    }

    /// Forgets the algorithms for which `keep` is false.
    pub(crate) fn retain(&mut self, keep: impl Fn(&str) -> bool) {
        self.algorithms.retain(|key, _| keep(key));
        self.weights.retain(|key, _| keep(key));
    }
}

impl RunRecord {
    /// Returns the record of this process, with the versions of the other software that it uses to play.
    pub(crate) fn now(versions: &[(String, String)]) -> Self {
        let own = [("pogema-rs", env!("CARGO_PKG_VERSION")), ("POGEMA", "1.4.0")];
        let own = own.map(|(name, version)| (name.to_owned(), version.to_owned()));
        Self {
            began: format!("{:.0}", jiff::Timestamp::now()),
            machine: machine().to_owned(),
            versions: own.into_iter().chain(versions.iter().cloned()).collect(),
        }
    }
}

/// Returns the processor of this machine and its number of threads.
pub fn machine() -> &'static str {
    static MACHINE: LazyLock<String> = LazyLock::new(|| {
        let number = std::thread::available_parallelism().map_or(1, usize::from);
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let model = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
        let model = model.map_or(std::env::consts::ARCH, |(_, model)| model.trim());
        format!("{model}, {number} threads")
    });
    &MACHINE
}

/// Checks that the fingerprints of the algorithms in both maps are equal.
///
/// # Errors
/// The algorithms for which they differ, and how to play only these anew.
fn check_same(
    what: &str,
    known: &BTreeMap<String, String>,
    now: &BTreeMap<String, String>,
) -> Result<(), String> {
    let keys = changed(known, now);
    if keys.is_empty() {
        return Ok(());
    }
    Err(format!(
        "has results of algorithms whose {what} have changed: {}; choose another folder, or delete {} and play again",
        quoted(&keys, ""),
        quoted(&keys, ".*")
    ))
}

/// Returns the names that both maps hold with different fingerprints.
fn changed<'a>(known: &'a BTreeMap<String, String>, now: &BTreeMap<String, String>) -> Vec<&'a String> {
    let differ = known.iter().filter(|(name, known)| now.get(*name).is_some_and(|now| now != *known));
    differ.map(|(name, _)| name).collect()
}

fn quoted(names: &[&String], ending: &str) -> String {
    names.iter().map(|name| format!("`{name}{ending}`")).collect::<Vec<_>>().join(", ")
}

/// Returns a short hash of a network's tensors and of its JSON, which may be absent.
fn digest_of_weights(weights: &Weights) -> Result<String, Error> {
    // The size limit that also applies when a policy reads its network.
    let read = |path: &Path| read_within(path, InputLimit::default().largest_file());
    let (tensors, config) = match weights {
        Weights::File(path) => {
            let config = path.with_extension("json");
            (read(path)?, if config.exists() { Some(read(&config)?) } else { None })
        }
        Weights::Shipped(shipped) => (shipped.tensors.to_vec(), Some(shipped.config.to_vec())),
    };
    let config = config.map_or_else(Vec::new, |bytes| Sha256::digest(bytes).to_vec());
    Ok(digest([Sha256::digest(tensors).as_slice(), &config].concat()))
}

/// Returns a short hash of bytes.
fn digest(bytes: impl AsRef<[u8]>) -> String {
    let bytes: [u8; 32] = Sha256::digest(bytes).into();
    let [first, ..] = bytes.as_chunks::<8>().0 else { return String::new() };
    format!("{:016x}", u64::from_be_bytes(*first))
}
