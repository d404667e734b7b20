//! A folder with the results of an evaluation, written episode by episode.
//!
//! While an algorithm plays, its file has one line per finished episode, in the order in which they finished. When all
//! episodes are done, the store writes the results in pogema-toolbox's layout, in the order of the suite. A second file
//! holds how each episode was played and how long it took. These data differ between runs, but results must not.

use std::borrow::Cow;
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use pogema_core::files::{UNFINISHED, write_whole};
use pogema_core::{Error, words};

use crate::episode_configs::EpisodeConfigs;
use crate::manifest::{self, Manifest, RunRecord};
use crate::suite::Suite;

words! {
    /// How a run treats existing results in the folder.
    pub enum Begin {
        /// Fails if there are results.
        New = "new",
        /// Continues an earlier run of the same suite.
        Resume = "resume",
        /// Deletes the results.
        Anew = "anew",
    }
}

/// The cause of the error from [`Store::open`] with [`Begin::New`] if the folder has results.
#[derive(Debug, thiserror::Error)]
#[error("has results already")]
pub struct HasResults;

impl HasResults {
    /// Adds `options`, a text about the options that accept the folder, to an error with this cause. Other errors stay
    /// unchanged.
    pub fn explained(error: Error, options: &str) -> Error {
        match error {
            Error::Io { path, cause } if cause.get().is::<Self>() => {
                Error::io(path, format!("{Self}: {options}"))
            }
            other => other,
        }
    }
}

/// A folder of results, to which only one run at a time may write.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    journal: Mutex<Journal>,
    /// Versions of other software that the run uses, by name.
    versions: Vec<(String, String)>,
    /// Held until [`Store::release`], or as long as the store lives.
    lock: Mutex<Option<File>>,
}

/// The manifest and the state of its last run.
#[derive(Debug)]
struct Journal {
    manifest: Manifest,
    /// Whether the manifest already has a run for this process.
    has_begun: bool,
}

/// File with the suite that was played.
pub(crate) const SUITE: &str = "suite.yaml";

/// File with the algorithms that replaced those of the suite. Without this file, the suite's own were played.
pub(crate) const ALGORITHMS: &str = "algorithms.yaml";
const LOCK: &str = ".lock";

impl Store {
    /// Opens a folder for a suite with these environments.
    ///
    /// # Errors
    /// If another run writes to the folder, or if the folder holds anything that `begin` does not allow. Such content
    /// is left unchanged.
    pub fn open(
        folder: &Path,
        suite: &Suite,
        environments: &EpisodeConfigs,
        begin: Begin,
    ) -> Result<Self, Error> {
        let manifest = Manifest::of(suite, environments)?;
        // A run that is rejected leaves nothing in the folder, not even the lock.
        if folder.exists() {
            admit(folder, manifest.clone(), begin)?;
        }
        fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
        let lock = lock(folder)?;
        remove_unfinished(folder)?;
        // Another process may have written to the folder before the lock was taken.
        let (manifest, deleted) = admit(folder, manifest, begin)?;
        deleted.map_or(Ok(()), |known| delete(folder, &known))?;
        let journal = Mutex::new(Journal { manifest: manifest.clone(), has_begun: false });
        let store =
            Self { folder: folder.to_owned(), journal, versions: Vec::new(), lock: Mutex::new(Some(lock)) };
        // Write the manifest first: it marks a folder of results, and the run may be killed before the other files are
        // written.
        store.write_manifest(&manifest)?;
        store.write(SUITE, suite.text.as_bytes())?;
        match &suite.replacement {
            Some(file) => store.write(ALGORITHMS, file.text.as_bytes())?,
            None => remove(&store.path(ALGORITHMS))?,
        }
        Ok(store)
    }

    /// Sets the versions of other software that the run uses, by name.
    #[must_use]
    pub fn with(mut self, versions: Vec<(String, String)>) -> Self {
        self.versions = versions;
        self
    }

    /// Returns the manifest of the results.
    pub fn manifest(&self) -> Manifest {
        self.journal().manifest.clone()
    }

    /// Releases the lock before the store is dropped. Call it after the last write.
    ///
    /// In a forked child it closes the child's handle of the lock, and the parent keeps the lock. Otherwise the folder
    /// would stay locked until the child ends, even if the parent has died.
    pub fn release(&self) {
        // Does not wait: a thread of the parent that was inside this function at the fork does not exist in the child
        // and would never release the mutex.
        if let Ok(mut lock) = self.lock.try_lock() {
            *lock = None;
        }
    }

    /// Returns the index of this process's run. The first call adds the run to the manifest.
    ///
    /// # Errors
    /// If the manifest cannot be written.
    pub fn run(&self) -> Result<usize, Error> {
        let mut journal = self.journal();
        if !journal.has_begun {
            journal.manifest.runs.push(RunRecord::now(&self.versions));
            self.write_manifest(&journal.manifest)?;
            journal.has_begun = true;
        }
        Ok(journal.manifest.runs.len() - 1)
    }

    fn journal(&self) -> MutexGuard<'_, Journal> {
        self.journal.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn write_manifest(&self, manifest: &Manifest) -> Result<(), Error> {
        let text = serde_json::to_string_pretty(manifest).map_err(|error| Error::io(&self.folder, error))?;
        self.write(manifest::FILE, format!("{text}\n").as_bytes())
    }

    /// Returns the path of a file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Writes a whole file, or on failure leaves the existing one unchanged.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        write_whole(&self.path(name), bytes)
    }
}

/// Returns the manifest with which a run begins, and the manifest of the existing results if the run deletes them.
/// `manifest` is the manifest of the suite.
///
/// # Errors
/// If the folder holds anything that `begin` does not allow.
fn admit(folder: &Path, mut manifest: Manifest, begin: Begin) -> Result<(Manifest, Option<Manifest>), Error> {
    let known = Manifest::read(folder).map_err(|error| match error {
        Error::Io { path, cause } => {
            Error::io(path, format!("{cause}; choose another folder, or delete this one"))
        }
        error => error,
    });
    match (begin, known?) {
        (Begin::Resume, Some(mut known)) => {
            known.retain(|key| files_of(folder, key).any(|path| path.exists()));
            manifest.continue_from(known).map_err(|what| Error::io(folder, what))?;
            Ok((manifest, None))
        }
        (Begin::Anew, Some(known)) => Ok((manifest, Some(known))),
        (Begin::New, Some(_)) => Err(Error::io(folder, HasResults)),
        (_, None) => check_empty(folder).map(|()| (manifest, None)),
    }
}

/// Deletes the results that an evaluation wrote, and nothing else.
fn delete(folder: &Path, known: &Manifest) -> Result<(), Error> {
    let mut files = known.algorithms.keys().flat_map(|key| files_of(folder, key));
    files.try_for_each(|path| remove(&path))?;
    remove(&folder.join(REPORT))
}

/// Returns the paths of all files that an evaluation may write for one algorithm.
fn files_of(folder: &Path, key: &str) -> impl Iterator<Item = PathBuf> {
    [RESULTS, EPISODES, LINES, FAILED].into_iter().map(move |ending| folder.join(format!("{key}{ending}")))
}

/// Removes the unfinished files of killed runs. The lock excludes other evaluations; files that other commands are
/// writing to the folder are lost.
fn remove_unfinished(folder: &Path) -> Result<(), Error> {
    let mut unfinished = entries(folder)?.into_iter().filter(|path| name_of(path).starts_with(UNFINISHED));
    unfinished.try_for_each(|path| remove(&path))
}

fn check_empty(folder: &Path) -> Result<(), Error> {
    let is_own = |name: &str| name == LOCK || name.starts_with(UNFINISHED);
    match entries(folder)?.iter().map(|path| name_of(path)).find(|name| !is_own(name)) {
        None => Ok(()),
        Some(name) => {
            let reason = format!("holds `{name}`, which no evaluation wrote; choose an empty folder");
            Err(Error::io(folder, reason))
        }
    }
}

/// Returns the files and folders in a folder.
pub(crate) fn entries(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let entries = fs::read_dir(folder).and_then(|entries| entries.map(|entry| Ok(entry?.path())).collect());
    entries.map_err(|error| Error::io(folder, error))
}

fn name_of(path: &Path) -> Cow<'_, str> {
    path.file_name().unwrap_or_default().to_string_lossy()
}

/// File with the report of the results.
pub const REPORT: &str = "report.html";

/// Endings of an algorithm's files: results, how each episode was played, episodes done so far, and failed episodes.
pub(crate) const RESULTS: &str = ".json";
pub(crate) const EPISODES: &str = ".episodes.json";
pub(crate) const LINES: &str = ".jsonl";
pub(crate) const FAILED: &str = ".failed.jsonl";

fn lock(folder: &Path) -> Result<File, Error> {
    let path = folder.join(LOCK);
    let file = File::create(&path).map_err(|error| Error::io(&path, error))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(Error::io(folder, "another run is writing to this folder")),
        // Some network file systems have no locks.
        Err(TryLockError::Error(error)) => Err(Error::io(path, format!("cannot lock: {error}"))),
    }
}

/// Deletes a file if it exists.
pub(crate) fn remove(path: &Path) -> Result<(), Error> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(Error::io(path, error)),
        _ => Ok(()),
    }
}
