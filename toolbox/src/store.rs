//! A folder with the results of an evaluation, kept episode by episode.
//!
//! For each algorithm there is, while it plays, a file of lines, one for each episode that is done, in the order in
//! which they were; and when all are done, the results in pogema-toolbox's layout, in the order of the suite, and
//! beside them how long each episode took, since that differs from run to run and results must not.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

use pogema_core::Error;
use pogema_maps::files::write_whole;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::suite::{Algorithm, Suite};

/// What may be in the folder already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Begin {
    /// Nothing.
    New,
    /// An earlier run of the same suite, which is gone on with.
    Resume,
    /// Results of anything, which are deleted.
    Anew,
}

/// What results were made with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// Release of this program.
    pub version: String,
    /// Release of POGEMA whose episodes they are.
    pub pogema: String,
    /// Operating system, processor and number of threads.
    pub machine: String,
    /// By what the environments are known.
    pub environment: String,
    /// By what each algorithm is known.
    pub algorithms: BTreeMap<String, String>,
}

/// The folder, which one process at a time may write to.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    /// Held until the end.
    _lock: File,
}

const ABOUT: &str = "about.json";
const SUITE: &str = "suite.yaml";
const LOCK: &str = ".lock";

impl Store {
    /// Opens a folder for a suite.
    ///
    /// # Errors
    /// If another process writes to it; if it holds anything that `begin` does not allow, all of which is then as it
    /// was.
    pub fn open(folder: &Path, suite: &Suite, begin: Begin) -> Result<Self, Error> {
        fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
        let store = Self { folder: folder.to_owned(), _lock: lock(folder)? };
        let mut about = about(suite);
        let known = store.known()?;
        match (begin, known) {
            (Begin::Resume, Some(known)) => store.check_same(&known, &mut about)?,
            (Begin::Anew, Some(known)) => store.delete(&known)?,
            (Begin::New, Some(_)) => {
                let reason = "has results already: `--resume` goes on with them, `--force` deletes them";
                return Err(Error::io(folder, reason));
            }
            (_, None) => store.check_empty()?,
        }
        store.write(SUITE, suite.text.as_bytes())?;
        let about = serde_json::to_string_pretty(&about).map_err(|error| Error::io(folder, error))?;
        store.write(ABOUT, format!("{about}\n").as_bytes())?;
        Ok(store)
    }

    /// The file of a name in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Writes a whole file, or leaves the one that is there.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        write_whole(&self.path(name), bytes)
    }

    fn known(&self) -> Result<Option<About>, Error> {
        let path = self.path(ABOUT);
        if !path.exists() {
            return Ok(None);
        }
        let text = fs::read_to_string(&path).map_err(|error| Error::io(&path, error))?;
        serde_json::from_str(&text).map(Some).map_err(|error| Error::io(&path, error))
    }

    /// Passes if the folder's results are of this suite; algorithms that are no longer in it stay known.
    fn check_same(&self, known: &About, about: &mut About) -> Result<(), Error> {
        let refused = |what: String| {
            Error::io(
                &self.folder,
                format!("{what}; choose another folder, or `--force` deletes the results"),
            )
        };
        if known.environment != about.environment {
            return Err(refused("has results of other environments than the suite's".into()));
        }
        for (key, told) in &known.algorithms {
            match about.algorithms.get(key) {
                Some(now) if now != told => {
                    return Err(refused(format!(
                        "has results of `{key}` with other parameters than the suite's"
                    )));
                }
                _ => about.algorithms.insert(key.clone(), told.clone()),
            };
        }
        Ok(())
    }

    /// Deletes the results that an evaluation wrote, and nothing else.
    fn delete(&self, known: &About) -> Result<(), Error> {
        for key in known.algorithms.keys() {
            for ending in [RESULTS, TIMES, LINES, FAILED] {
                remove(&self.path(&format!("{key}.{ending}")))?;
            }
        }
        Ok(())
    }

    fn check_empty(&self) -> Result<(), Error> {
        let failed = |error: std::io::Error| Error::io(&self.folder, error);
        for entry in fs::read_dir(&self.folder).map_err(failed)? {
            let name = entry.map_err(failed)?.file_name();
            if name != LOCK {
                let name = name.to_string_lossy();
                let reason = format!("holds `{name}`, which no evaluation wrote; choose an empty folder");
                return Err(Error::io(&self.folder, reason));
            }
        }
        Ok(())
    }
}

/// Endings of the files of an algorithm: its results, their times, the episodes done so far, and those that failed.
pub(crate) const RESULTS: &str = "json";
pub(crate) const TIMES: &str = "times.json";
pub(crate) const LINES: &str = "jsonl";
pub(crate) const FAILED: &str = "failed.jsonl";

fn about(suite: &Suite) -> About {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let algorithm = |algorithm: &Algorithm| (algorithm.key.clone(), digest(&algorithm.told()));
    About {
        version: env!("CARGO_PKG_VERSION").into(),
        pogema: "1.4.0".into(),
        machine: format!("{} {}, {threads} threads", std::env::consts::OS, std::env::consts::ARCH),
        environment: digest(&suite.environments.told()),
        algorithms: suite.algorithms.iter().map(algorithm).collect(),
    }
}

/// A short name for a text.
fn digest(text: &str) -> String {
    let bytes: [u8; 32] = Sha256::digest(text.as_bytes()).into();
    let [first, ..] = bytes.as_chunks::<8>().0 else { return String::new() };
    format!("{:016x}", u64::from_be_bytes(*first))
}

fn lock(folder: &Path) -> Result<File, Error> {
    let path = folder.join(LOCK);
    let file = File::create(&path).map_err(|error| Error::io(&path, error))?;
    file.try_lock().map_err(|_| Error::io(folder, "another process is writing to this folder"))?;
    Ok(file)
}

/// Deletes a file that may not be there.
pub(crate) fn remove(path: &Path) -> Result<(), Error> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(Error::io(path, error)),
        _ => Ok(()),
    }
}
