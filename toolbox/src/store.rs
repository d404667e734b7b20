//! A folder with the results of an evaluation, kept episode by episode.
//!
//! For each algorithm there is, while it plays, a file of lines, one for each episode that is done, in the order in
//! which they were; and when all are done, the results in pogema-toolbox's layout, in the order of the suite, and
//! beside them how each episode was played and how long it took, which differs from run to run and results must not.

use std::borrow::Cow;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use pogema_core::files::{UNFINISHED, write_whole};
use pogema_core::{Error, words};

use crate::manifest::{self, Manifest, RunRecord};
use crate::suite::Suite;

words! {
    /// How a run treats the results that the folder holds already.
    pub enum Begin {
        /// Fails if there are any.
        New = "new",
        /// Continues an earlier run of the same suite.
        Resume = "resume",
        /// Deletes them.
        Anew = "anew",
    }
}

/// The folder, which one process at a time may write to.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    noted: Mutex<Noted>,
    /// Releases of what plays besides this program, by name.
    versions: Vec<(String, String)>,
    /// Held until the end.
    _lock: File,
}

/// What is noted of how the results are made.
#[derive(Debug)]
struct Noted {
    manifest: Manifest,
    /// Whether what this process plays is a run of its own already.
    has_begun: bool,
}

/// The suite that was played.
pub(crate) const SUITE: &str = "suite.yaml";

/// The algorithms that replaced those of the suite; without this file, the suite's own played.
pub(crate) const ALGORITHMS: &str = "algorithms.yaml";
const LOCK: &str = ".lock";

impl Store {
    /// Opens a folder for a suite.
    ///
    /// # Errors
    /// If another process writes to it; if it holds anything that `begin` does not allow, all of which is then as it
    /// was.
    pub fn open(folder: &Path, suite: &Suite, begin: Begin) -> Result<Self, Error> {
        fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
        let lock = lock(folder)?;
        remove_unfinished(folder)?;
        let mut manifest = Manifest::of(suite);
        let known = Manifest::read(folder)?;
        match (begin, known) {
            (Begin::Resume, Some(known)) => manifest.go_on(known).map_err(|what| refused(folder, &what))?,
            (Begin::Anew, Some(known)) => delete(folder, &known)?,
            (Begin::New, Some(_)) => {
                let reason = "has results already: `--resume` goes on with them, `--force` deletes them";
                return Err(Error::io(folder, reason));
            }
            (_, None) => check_empty(folder)?,
        }
        let noted = Mutex::new(Noted { manifest: manifest.clone(), has_begun: false });
        let store = Self { folder: folder.to_owned(), noted, versions: Vec::new(), _lock: lock };
        // First what makes it a folder of results: a run may be killed between the two.
        store.tell(&manifest)?;
        store.write(SUITE, suite.text.as_bytes())?;
        match &suite.replacement {
            Some(file) => store.write(ALGORITHMS, file.text.as_bytes())?,
            None => remove(&store.path(ALGORITHMS))?,
        }
        Ok(store)
    }

    /// The same for a process that plays with more than this program, whose releases are told by name.
    #[must_use]
    pub fn with(mut self, versions: Vec<(String, String)>) -> Self {
        self.versions = versions;
        self
    }

    /// How the results were made.
    pub fn manifest(&self) -> Manifest {
        self.noted().manifest.clone()
    }

    /// The number of the run that this process is, which is noted when it is asked for first.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn run(&self) -> Result<usize, Error> {
        let mut noted = self.noted();
        if !noted.has_begun {
            noted.manifest.runs.push(RunRecord::now(&self.versions));
            self.tell(&noted.manifest)?;
            noted.has_begun = true;
        }
        Ok(noted.manifest.runs.len() - 1)
    }

    fn noted(&self) -> MutexGuard<'_, Noted> {
        self.noted.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn tell(&self, manifest: &Manifest) -> Result<(), Error> {
        let text = serde_json::to_string_pretty(manifest).map_err(|error| Error::io(&self.folder, error))?;
        self.write(manifest::FILE, format!("{text}\n").as_bytes())
    }

    /// The file of a name in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Writes a whole file, or leaves the one that is there.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        write_whole(&self.path(name), bytes)
    }
}

fn refused(folder: &Path, what: &str) -> Error {
    Error::io(folder, format!("{what}; choose another folder, or `--force` deletes the results"))
}

/// Deletes the results that an evaluation wrote, and nothing else.
fn delete(folder: &Path, known: &Manifest) -> Result<(), Error> {
    for key in known.algorithms.keys() {
        for ending in [RESULTS, EPISODES, LINES, FAILED] {
            remove(&folder.join(format!("{key}{ending}")))?;
        }
    }
    remove(&folder.join(REPORT))
}

/// Removes what runs were writing when they were killed; nobody else writes here now.
fn remove_unfinished(folder: &Path) -> Result<(), Error> {
    let mut unfinished = entries(folder)?.into_iter().filter(|path| name_of(path).starts_with(UNFINISHED));
    unfinished.try_for_each(|path| remove(&path))
}

fn check_empty(folder: &Path) -> Result<(), Error> {
    match entries(folder)?.iter().map(|path| name_of(path)).find(|name| name != LOCK) {
        None => Ok(()),
        Some(name) => {
            let reason = format!("holds `{name}`, which no evaluation wrote; choose an empty folder");
            Err(Error::io(folder, reason))
        }
    }
}

/// The files and folders in a folder.
pub(crate) fn entries(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let entries = fs::read_dir(folder).and_then(|entries| entries.map(|entry| Ok(entry?.path())).collect());
    entries.map_err(|error| Error::io(folder, error))
}

fn name_of(path: &Path) -> Cow<'_, str> {
    path.file_name().unwrap_or_default().to_string_lossy()
}

/// The page of the results.
pub const REPORT: &str = "report.html";

/// Endings of the files of an algorithm: its results, how each was played, the episodes done so far, and those that failed.
pub(crate) const RESULTS: &str = ".json";
pub(crate) const EPISODES: &str = ".episodes.json";
pub(crate) const LINES: &str = ".jsonl";
pub(crate) const FAILED: &str = ".failed.jsonl";

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
