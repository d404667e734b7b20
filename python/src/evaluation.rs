//! Suites and the results of their episodes, both of built-in algorithms and of policies in Python.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};

use pogema_core::files::write_whole;
use pogema_core::{Error, Words};
use pogema_maps::formats::NamedMap;
use pogema_maps::{Library, did_you_mean, parse_map_text};
use pogema_policies::NamedPolicy;
use pogema_toolbox::report::{Pick, Replay, SHOWN, page, picks};
use pogema_toolbox::views::check_views;
use pogema_toolbox::{
    Algorithm, Begin, BuiltIn, Done, EpisodeConfigs, Event, Failed, HasResults, Pairs, Progress, Results,
    RunOptions, Store, Suite, run_one,
};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::guard::{self, guarded};
use crate::{errors, interrupt};

/// An algorithm of a suite: name of its results, its own name, parameters in JSON, number of processes, backend.
type Listed = (String, String, String, Option<usize>, String);

/// An episode played again in Python: metrics in JSON, packed recording, and an error message, empty on success.
type Replayed = (String, String, String);

/// A suite and the folder with its results.
#[pyclass(frozen, weakref, module = "pogema_rs._engine")]
pub struct Evaluation {
    suite: Suite,
    environments: EpisodeConfigs,
    /// One line for each map that replaced another map of the same name.
    warnings: Vec<String>,
    folder: PathBuf,
    store: OnceLock<Arc<Store>>,
    progress: Mutex<Option<Progress>>,
}

guarded! {
#[pymethods]
impl Evaluation {
    /// Reads a suite; `folder` is for its results.
    ///
    /// `maps` are map texts by name.
    #[new]
    fn new(
        path: PathBuf,
        text: Option<&str>,
        folder: PathBuf,
        maps: Vec<(String, String)>,
        files: Vec<PathBuf>,
    ) -> PyResult<Self> {
        let read = || {
            let suite = match text {
                Some(text) => Suite::parse(&path, text)?,
                None => Suite::read(&path)?,
            };
            check_views(&suite)?;
            let (library, warnings) = library(&suite, maps, &files)?;
            let environments = if suite.is_foreign() {
                EpisodeConfigs::unchecked(&suite, library)
            } else {
                EpisodeConfigs::new(&suite, library)?
            };
            Ok((suite, environments, warnings))
        };
        let (suite, environments, warnings) = read().map_err(|error: Error| errors::file(&error))?;
        let (store, progress) = (OnceLock::new(), Mutex::new(None));
        Ok(Self { suite, environments, warnings, folder, store, progress })
    }

    /// Returns a line for each map that replaced another map of the same name.
    fn warnings(&self) -> PyResult<Vec<String>> {
        Ok(self.warnings.clone())
    }

    /// Checks that every algorithm is registered or built in, and checks the parameters of built-in algorithms.
    ///
    /// Errors: `ValueError` for an unknown name or wrong parameters, `OSError` for weights that cannot be read.
    fn check_algorithms(&self, registered: Vec<String>) -> PyResult<()> {
        let others = self.suite.algorithms.iter().filter(|algorithm| !registered.contains(&algorithm.name));
        for algorithm in others {
            self.built_in(algorithm, &registered)?;
        }
        Ok(())
    }

    /// Opens the folder of the results and locks it.
    ///
    /// `begin` is `new`, `resume` or `anew`, and `versions` are the releases of the Python packages that policies use.
    fn open(&self, begin: &str, versions: Vec<(String, String)>) -> PyResult<()> {
        let begin = Begin::read("begin", begin).map_err(|error| errors::file(&error))?;
        let store = Store::open(&self.folder, &self.suite, &self.environments, begin).map_err(|error| {
            let options = "begin='resume' (`--resume`) continues them, begin='anew' (`--force`) deletes them";
            errors::folder(&HasResults::explained(error, options))
        })?;
        let opened = self.store.set(Arc::new(store.with(versions)));
        opened.map_err(|_| PyRuntimeError::new_err("the folder is open already"))
    }

    /// Releases the lock of the folder: when the run ends, or in a forked child, whose parent keeps the lock.
    fn release(&self) -> PyResult<()> {
        if let Some(store) = self.store.get() {
            store.release();
        }
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
        let fields = self.environments.fields(index).map_err(|error| errors::file(&error))?;
        Ok(serde_json::Value::Object(fields).to_string())
    }

    /// Returns the fields of [`Self::environment`] with the starts and goals of the map or the scenario, and without
    /// the scenario's file, which other processes may not find.
    fn whole_environment(&self, index: usize) -> PyResult<String> {
        let fields = self.environments.whole_fields(index).map_err(|error| errors::file(&error))?;
        Ok(serde_json::Value::Object(fields).to_string())
    }

    /// Returns the name and text of the map that a name or pattern selects for a seed.
    fn map(&self, name: &str, seed: u64) -> PyResult<(String, String)> {
        self.environments.map(name, seed).map_err(|error| errors::file(&error))
    }

    /// Begins an algorithm and returns its missing episodes, longest first, or `None` if all are done.
    fn begin(&self, key: &str) -> PyResult<Option<Vec<usize>>> {
        let opened = Progress::open(self.store()?, key, self.environments.len());
        let progress = opened.map_err(|error| errors::folder(&error))?;
        let to_do = progress.as_ref().map(|progress| self.environments.by_cost(progress.to_do()));
        *self.progress()? = progress;
        Ok(to_do)
    }

    /// Stores an episode, given in JSON: `index`, `metrics`, `runtime`, and the `network_time` and `proof` that
    /// `play_built_in` returns. `machine` is the one that played it.
    fn keep(&self, episode: &str, machine: String) -> PyResult<()> {
        let episode: Done = read_json(episode)?;
        let machine = (machine != pogema_toolbox::machine()).then_some(machine);
        self.with(|progress| progress.keep(Done { machine, ..episode }))
    }

    /// Records an episode that failed.
    fn note(&self, index: usize, config: &str, error: String, traceback: String) -> PyResult<()> {
        let env_grid_search = self.environments.changes(index).map_err(|error| errors::file(&error))?;
        let config = read_json(config)?;
        self.with(|progress| progress.note(&Failed { index, env_grid_search, config, error, traceback }))
    }

    /// Writes the results if all episodes are done, and returns whether they are.
    fn finish(&self) -> PyResult<bool> {
        let progress = self.progress()?.take();
        let finished = progress.map(|progress| progress.finish(&self.environments));
        finished.unwrap_or(Ok(true)).map_err(|error| errors::folder(&error))
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
        let (results, store) = (self.results()?, self.store()?);
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
            let page = page(&self.suite, &store.manifest(), &results, &replays)?;
            write_whole(&path, page.as_bytes())
        };
        interrupt::detach_scoped(py, &stop, write)?.map_err(|error| errors::folder(&error))
    }

    /// Plays the missing episodes of a built-in algorithm.
    ///
    /// Calls `progress.begin` with the number of missing episodes. After each episode, calls `progress.step`: if the
    /// episode failed, with its number and error, otherwise with 0 and an empty text. Returns how many episodes were
    /// played, how many failed, and whether the results are complete.
    fn run_built_in(
        &self,
        py: Python<'_>,
        key: &str,
        threads: usize,
        progress: Py<PyAny>,
    ) -> PyResult<(usize, usize, bool)> {
        let algorithm = self.suite.algorithm(key);
        let algorithm = algorithm.ok_or_else(|| PyValueError::new_err(format!("no algorithm `{key}`")))?;
        let (built_in, store) = (self.built_in(algorithm, &[])?, self.store()?);
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
        let running = RunOptions { threads: threads.max(1), stop: &stop, watch: &report };
        let run = || run_one(algorithm, &built_in, &self.environments, store, running);
        let summary = interrupt::detach_scoped(py, &stop, run)?.map_err(|error| errors::folder(&error))?;
        match raised.into_inner() {
            Ok(Some(error)) => Err(error),
            _ => Ok((summary.num_played, summary.num_failed, summary.is_whole)),
        }
    }
}
}

impl Evaluation {
    fn results(&self) -> PyResult<Results> {
        Results::read(std::slice::from_ref(&self.folder)).map_err(|error| errors::folder(&error))
    }

    fn store(&self) -> PyResult<&Arc<Store>> {
        self.store.get().ok_or_else(|| PyRuntimeError::new_err("the folder is not open; call `open` first"))
    }

    fn built_in(&self, algorithm: &Algorithm, registered: &[String]) -> PyResult<BuiltIn> {
        let built_in = BuiltIn::of(algorithm, self.suite.folder());
        let built_in = built_in.unwrap_or_else(|| {
            let (line, key, name) = (algorithm.line, &algorithm.key, &algorithm.name);
            let known = NamedPolicy::all().into_iter().map(|(known, _)| known);
            let hint = did_you_mean(name, known.chain(registered.iter().map(String::as_str)));
            let what = format!("line {line}: `{key}.name`: `{name}` is neither registered nor built in");
            Err(Error::Syntax { reason: format!("{what}{hint}") })
        });
        built_in.map_err(|error| errors::file(&self.suite.in_file(error)))
    }

    fn progress(&self) -> PyResult<MutexGuard<'_, Option<Progress>>> {
        Python::attach(|py| guard::lock(py, &self.progress, "this evaluation"))
    }

    fn with(&self, work: impl FnOnce(&mut Progress) -> Result<(), Error>) -> PyResult<()> {
        let mut progress = self.progress()?;
        let progress = progress.as_mut();
        let progress =
            progress.ok_or_else(|| PyRuntimeError::new_err("no algorithm has begun; call `begin` first"))?;
        work(progress).map_err(|error| errors::folder(&error))
    }
}

/// Collects the maps that a suite may name: built-in and generated ones, those in files, and those in `maps`, which are
/// map texts by name. Also returns a line for each replaced map.
fn library(
    suite: &Suite,
    maps: Vec<(String, String)>,
    files: &[PathBuf],
) -> Result<(Library, Vec<String>), Error> {
    let (mut library, mut warnings) = suite.library(files)?;
    for (name, text) in maps {
        let text = parse_map_text(&text).map_err(|error| Error::io(&name, error))?;
        if library.map(&name).is_ok_and(|known| *known != text) {
            warnings.push(format!("the registered map `{name}` replaces another map of that name"));
        }
        library.register([NamedMap { name, text }]);
    }
    Ok((library, warnings))
}

fn read_json<T: serde::de::DeserializeOwned>(text: &str) -> PyResult<T> {
    from_json(text).map_err(|error| errors::file(&error))
}

fn from_json<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, Error> {
    serde_json::from_str(text)
        .map_err(|error| Error::Corrupt { what: "JSON".into(), reason: error.to_string() })
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
        let environments = EpisodeConfigs::unchecked(&suite, library(&suite, maps, &[])?.0);
        serde_json::to_string(&suite.play_first(&environments)?)
            .map_err(|error| Error::Corrupt { what: "JSON".into(), reason: error.to_string() })
    };
    interrupt::detach(py, play)?.map_err(|error: Error| errors::file(&error))
}
}
