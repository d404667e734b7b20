//! How results were made: by what suite, what algorithms, and what runs on what machines.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use pogema_core::Error;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::suite::{Algorithm, Suite};

/// The file that tells how results were made.
pub(crate) const FILE: &str = "about.json";

/// How results were made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// The suite's file, beside which stand files that it names.
    pub suite: PathBuf,
    /// By what the environments are known.
    pub environment: String,
    /// By what each algorithm is known.
    pub algorithms: BTreeMap<String, String>,
    /// Whoever played some of the episodes, each of which has the number of its run.
    pub runs: Vec<RunRecord>,
}

/// One process that played episodes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// When it began to play, in the form of RFC 3339.
    pub began: String,
    /// The processor and how many threads it has.
    pub machine: String,
    /// Releases by the name of what they are of.
    pub versions: BTreeMap<String, String>,
}

impl Manifest {
    /// What a suite's results are known by, before anything was played.
    pub fn of(suite: &Suite) -> Self {
        let algorithm = |algorithm: &Algorithm| (algorithm.key.clone(), digest(&algorithm.fingerprint()));
        Self {
            suite: std::path::absolute(&suite.path).unwrap_or_else(|_| suite.path.clone()),
            environment: digest(&suite.environments.fingerprint()),
            algorithms: suite.algorithms.iter().map(algorithm).collect(),
            runs: Vec::new(),
        }
    }

    /// What is known of the results in a folder, if there are any.
    ///
    /// # Errors
    /// If the file cannot be read, or is another one.
    pub fn read(folder: &Path) -> Result<Option<Self>, Error> {
        let path = folder.join(FILE);
        if !path.exists() {
            return Ok(None);
        }
        let text = std::fs::read_to_string(&path).map_err(|error| Error::io(&path, error))?;
        serde_json::from_str(&text).map(Some).map_err(|error| Error::io(&path, error))
    }

    /// Takes over what an earlier run did; algorithms that are no longer in the suite stay known.
    ///
    /// # Errors
    /// In what the earlier results are others, without a change.
    pub(crate) fn go_on(&mut self, known: Self) -> Result<(), String> {
        if known.environment != self.environment {
            return Err("has results of other environments than the suite's".into());
        }
        let is_other =
            |(key, told): &(&String, &String)| self.algorithms.get(*key).is_some_and(|now| now != *told);
        if let Some((key, _)) = known.algorithms.iter().find(is_other) {
            return Err(format!("has results of `{key}` with other parameters than the suite's"));
        }
        self.algorithms.extend(known.algorithms);
        self.runs = known.runs;
        Ok(())
    }
}

impl RunRecord {
    /// This process, with the releases of what else it plays with.
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

/// The processor of this machine and how many threads it has.
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

/// A short name for a text.
fn digest(text: &str) -> String {
    let bytes: [u8; 32] = Sha256::digest(text.as_bytes()).into();
    let [first, ..] = bytes.as_chunks::<8>().0 else { return String::new() };
    format!("{:016x}", u64::from_be_bytes(*first))
}
