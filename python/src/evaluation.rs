//! Suites and the results of their episodes, both of built-in algorithms and of policies in Python.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard};

use pogema_core::files::write_whole;
use pogema_core::{Error, Words};
use pogema_maps::formats::NamedMap;
use pogema_maps::{Library, parse_map_text};
use pogema_toolbox::report::{Pick, Replay, SHOWN, page, picks};
use pogema_toolbox::views::check_views;
use pogema_toolbox::{
    Algorithm, Begin, BuiltIn, Done, EpisodeConfigs, Event, Failed, HasResults, Pairs, Progress, Results,
    Running, Store, Suite, run_one,
};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::guard::{self, guarded};
use crate::interrupt;

/// An algorithm of a suite: name of its results, its own name, parameters in JSON, number of processes, backend.
type Listed = (String, String, String, Option<usize>, String);

/// An episode played again in Python: metrics in JSON, packed recording, and an error message, empty on success.
type Replayed = (String, String, String);

/// A suite and the folder with its results.
#[pyclass(frozen, weakref, module = "pogema_rs._engine")]
pub struct Evaluation {
    suite: Suite,
    environments: EpisodeConfigs,
    store: Arc<Store>,
    folder: PathBuf,
    progress: Mutex<Option<Progress>>,
}

guarded! {
#[pymethods]
impl Evaluation {
    /// Reads a suite and opens the folder of its results.
    ///
    /// `begin` is `new`, `resume` or `anew`, `maps` are map texts by name, and `versions` are the releases of the
    /// Python packages that policies use.
    #[new]
    fn new(
        path: PathBuf,
        text: Option<&str>,
        folder: PathBuf,
        begin: &str,
        maps: Vec<(String, String)>,
        files: Vec<PathBuf>,
        versions: Vec<(String, String)>,
    ) -> PyResult<Self> {
        let read = || {
            let suite = match text {
                Some(text) => Suite::parse(&path, text)?,
                None => Suite::read(&path)?,
            };
            check_views(&suite)?;
            let environments = environments(&suite, maps, &files)?;
            Ok((suite, environments, Begin::read("begin", begin)?))
        };
        let wrong = |error: Error| PyValueError::new_err(error.to_string());
        let (suite, environments, begin) = read().map_err(wrong)?;
        let store = Store::open(&folder, &suite, &environments, begin).map_err(|error| {
            let options = "`begin` `resume` (`--resume`) continues them, `anew` (`--force`) deletes them";
            to_py_error(&HasResults::explained(error, options))
        })?;
        let store = Arc::new(store.with(versions));
        Ok(Self { suite, environments, store, folder, progress: Mutex::new(None) })
    }

    /// Closes the lock of the folder in a forked child; the parent keeps it.
    fn release_in_child(&self) -> PyResult<()> {
        self.store.release_in_child();
        Ok(())
    }

    /// Returns the number of episodes of each algorithm.
    fn num_episodes(&self) -> PyResult<usize> {
        Ok(self.environments.len())
    }

    /// Returns whether the suite uses environments other than POGEMA's.
    fn is_foreign(&self) -> PyResult<bool> {
        Ok(self.suite.is_foreign())
    }

    /// Returns whether the suite has views of its results.
    fn has_views(&self) -> PyResult<bool> {
        Ok(!self.suite.views.is_empty())
    }

    /// Returns the address of the Dask scheduler that the suite names.
    fn dask(&self) -> PyResult<Option<String>> {
        Ok(self.suite.dask.clone())
    }

    /// Returns the algorithms, in the order of the suite.
    fn algorithms(&self) -> PyResult<Vec<Listed>> {
        let all = self.suite.algorithms.iter().map(|algorithm| {
            let parameters = algorithm.parameters.iter().map(|(key, node)| (key.clone(), node.value()));
            let parameters: Pairs = parameters.collect();
            let (key, name, backend) = (&algorithm.key, &algorithm.name, &algorithm.backend);
            let parameters = serde_json::to_string(&parameters).unwrap_or_default();
            (key.clone(), name.clone(), parameters, algorithm.num_processes, backend.word().to_owned())
        });
        Ok(all.collect())
    }

    /// Returns all fields of an episode's environment, in JSON, as the suite has them.
    fn environment(&self, index: usize) -> PyResult<String> {
        let fields = self.environments.fields(index).map_err(|error| to_py_error(&error))?;
        Ok(serde_json::Value::Object(fields).to_string())
    }

    /// Returns the name and text of the map that a name or pattern selects for a seed.
    fn map(&self, name: &str, seed: u64) -> PyResult<(String, String)> {
        self.environments.map(name, seed).map_err(|error| to_py_error(&error))
    }

    /// Returns the fields varied for an episode, in JSON.
    fn changes(&self, index: usize) -> PyResult<String> {
        let changes = self.environments.changes(index).map_err(|error| to_py_error(&error))?;
        serde_json::to_string(&changes).map_err(|error| PyValueError::new_err(error.to_string()))
    }

    /// Begins an algorithm and returns its missing episodes, longest first, or `None` if all are done.
    fn begin(&self, key: &str) -> PyResult<Option<Vec<usize>>> {
        let opened = Progress::open(&self.store, key, self.environments.len());
        let progress = opened.map_err(|error| to_py_error(&error))?;
        let to_do = progress.as_ref().map(|progress| self.environments.by_cost(progress.to_do()));
        *self.progress()? = progress;
        Ok(to_do)
    }

    /// Stores an episode, given in JSON: `index`, `metrics`, `runtime` and, as `play_built_in` returns them,
    /// `network_time` and `proof`. `machine` is the one that played it.
    fn keep(&self, episode: &str, machine: String) -> PyResult<()> {
        let episode: Done = read_json(episode)?;
        let machine = (machine != pogema_toolbox::machine()).then_some(machine);
        self.with(|progress| progress.keep(Done { machine, ..episode }))
    }

    /// Records an episode that failed.
    fn note(&self, index: usize, config: &str, error: String, traceback: String) -> PyResult<()> {
        let env_grid_search = self.environments.changes(index).map_err(|error| to_py_error(&error))?;
        let config = read_json(config)?;
        self.with(|progress| progress.note(&Failed { index, env_grid_search, config, error, traceback }))
    }

    /// Writes the results if all episodes are done, and returns whether they are.
    fn finish(&self) -> PyResult<bool> {
        let progress = self.progress()?.take();
        let finished = progress.map(|progress| progress.finish(&self.environments));
        finished.unwrap_or(Ok(true)).map_err(|error| to_py_error(&error))
    }

    /// Returns the episodes that a page of the results replays: algorithm and episode number.
    fn picks(&self) -> PyResult<Vec<(String, usize)>> {
        let picks = picks(&self.results()?, SHOWN);
        Ok(picks.into_iter().map(|pick| (pick.algorithm, pick.episode)).collect())
    }

    /// Writes the page of the results.
    ///
    /// `again` has one entry for each episode of [`Self::picks`]: the outcome of playing it again in Python, or `None`
    /// if this method has to play it.
    fn write_report(&self, py: Python<'_>, path: PathBuf, again: Vec<Option<Replayed>>) -> PyResult<()> {
        let results = self.results()?;
        let stop = Arc::default();
        let write = || {
            let picks = picks(&results, SHOWN).into_iter();
            let replay = |(pick, again): (Pick, Option<Replayed>)| match again {
                None => Ok(Replay::of(pick, &results, &self.suite, &self.environments, &stop)),
                Some((_, _, error)) if !error.is_empty() => Ok(Replay::failed(pick, error)),
                Some((metrics, film, _)) => Ok(Replay::played(pick, &results, &from_json(&metrics)?, film)),
            };
            let replays = picks.zip(again).map(replay).collect::<Result<Vec<_>, Error>>()?;
            if stop.load(Relaxed) {
                return Err(Error::Cancelled);
            }
            let page = page(&self.suite, &self.store.manifest(), &results, &replays)?;
            write_whole(&path, page.as_bytes())
        };
        interrupt::detach_scoped(py, &stop, write)?.map_err(|error| to_py_error(&error))
    }

    /// Returns whether an algorithm of the suite is built in.
    ///
    /// Errors: `ValueError` for wrong parameters of a built-in algorithm.
    fn is_built_in(&self, key: &str) -> PyResult<bool> {
        Ok(self.built_in(key)?.is_some())
    }

    /// Plays the missing episodes of a built-in algorithm; returns `None` for any other algorithm.
    ///
    /// Calls `progress.begin` with the number of missing episodes, and after each episode `progress.step` with its
    /// number and error if it failed, otherwise with 0 and an empty text. Returns how many episodes were played, how
    /// many failed, and whether the results are complete.
    fn run_built_in(
        &self,
        py: Python<'_>,
        key: &str,
        threads: usize,
        progress: Py<PyAny>,
    ) -> PyResult<Option<(usize, usize, bool)>> {
        let Some((algorithm, built_in)) = self.built_in(key)? else { return Ok(None) };
        let stop = Arc::<AtomicBool>::default();
        let raised: Mutex<Option<PyErr>> = Mutex::new(None);
        let report = |event: Event<'_>| {
            let watched = Python::attach(|py| match event {
                Event::Begin { total, done, .. } => progress.call_method1(py, "begin", (total - done,)),
                Event::Played => progress.call_method1(py, "step", (0, "")),
                Event::Failed(failed) => progress.call_method1(py, "step", (failed.index, &failed.error)),
                Event::End => Ok(py.None()),
            });
            if let (Err(error), Ok(mut raised)) = (watched, raised.lock()) {
                stop.store(true, Relaxed);
                raised.get_or_insert(error);
            }
        };
        let running = Running { threads: threads.max(1), stop: &stop, watch: &report };
        let run = || run_one(algorithm, &built_in, &self.environments, &self.store, running);
        let summary = interrupt::detach_scoped(py, &stop, run)?.map_err(|error| to_py_error(&error))?;
        match raised.into_inner() {
            Ok(Some(error)) => Err(error),
            _ => Ok(Some((summary.num_played, summary.num_failed, summary.is_whole))),
        }
    }
}
}

impl Evaluation {
    fn results(&self) -> PyResult<Results> {
        Results::read(std::slice::from_ref(&self.folder)).map_err(|error| to_py_error(&error))
    }

    fn built_in(&self, key: &str) -> PyResult<Option<(&Algorithm, BuiltIn)>> {
        let Some((algorithm, built_in)) =
            self.suite.algorithm(key).and_then(|it| Some((it, BuiltIn::of(it, self.suite.folder())?)))
        else {
            return Ok(None);
        };
        let built_in = built_in.map_err(|error| to_py_error(&self.suite.in_file(error)))?;
        Ok(Some((algorithm, built_in)))
    }

    fn progress(&self) -> PyResult<MutexGuard<'_, Option<Progress>>> {
        Python::attach(|py| guard::lock(py, &self.progress, "this evaluation"))
    }

    fn with(&self, work: impl FnOnce(&mut Progress) -> Result<(), Error>) -> PyResult<()> {
        let mut progress = self.progress()?;
        let progress = progress.as_mut();
        let progress =
            progress.ok_or_else(|| PyRuntimeError::new_err("no algorithm has begun, call `begin` first"))?;
        work(progress).map_err(|error| to_py_error(&error))
    }
}

/// Returns the episode configs of a suite, with maps by name in addition to those in files.
fn environments(
    suite: &Suite,
    maps: Vec<(String, String)>,
    files: &[PathBuf],
) -> Result<EpisodeConfigs, Error> {
    let library = library(suite, maps, files)?;
    if suite.is_foreign() {
        return Ok(EpisodeConfigs::unchecked(suite, library));
    }
    EpisodeConfigs::new(suite, library)
}

/// Collects the maps that a suite may name: those in files, and those by name.
fn library(suite: &Suite, maps: Vec<(String, String)>, files: &[PathBuf]) -> Result<Library, Error> {
    let (mut library, _) = suite.library(files)?;
    let read = |(name, text): (String, String)| {
        let text = parse_map_text(&text).map_err(|error| Error::io(&name, error))?;
        Ok(NamedMap { name, text })
    };
    library.register(maps.into_iter().map(read).collect::<Result<Vec<_>, Error>>()?);
    Ok(library)
}

fn read_json<T: serde::de::DeserializeOwned>(text: &str) -> PyResult<T> {
    from_json(text).map_err(|error| to_py_error(&error))
}

fn from_json<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, Error> {
    serde_json::from_str(text)
        .map_err(|error| Error::Corrupt { what: "JSON".into(), reason: error.to_string() })
}

/// Converts an error to `OSError` or `ValueError`.
pub fn to_py_error(error: &Error) -> PyErr {
    match error {
        Error::Io { .. } => pyo3::exceptions::PyOSError::new_err(error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

guarded! {
/// Returns the processor of this machine and its number of threads.
#[pyfunction]
pub fn machine() -> PyResult<&'static str> {
    Ok(pogema_toolbox::machine())
}
}

guarded! {
/// Plays one episode of a built-in algorithm; returns it in JSON, in the form that `Evaluation.keep` takes.
///
/// `suite` contains that episode alone, and `maps` are map texts by name.
#[pyfunction]
pub fn play_built_in(py: Python<'_>, suite: &str, maps: Vec<(String, String)>) -> PyResult<String> {
    let suite = suite.to_owned();
    let play = move || {
        let suite = Suite::parse(std::path::Path::new("suite.yaml"), &suite)?;
        let environments = EpisodeConfigs::unchecked(&suite, library(&suite, maps, &[])?);
        serde_json::to_string(&suite.play_one(&environments)?)
            .map_err(|error| Error::Corrupt { what: "JSON".into(), reason: error.to_string() })
    };
    interrupt::detach(py, play)?.map_err(|error: Error| to_py_error(&error))
}
}
