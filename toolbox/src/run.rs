//! Plays all episodes of a suite's built-in algorithms on threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};

use pogema_core::Error;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde_json::Value;

use crate::built_in::BuiltIn;
use crate::episode_configs::EpisodeConfigs;
use crate::play::{Played, play};
use crate::progress::{Done, Failed, Progress};
use crate::results::Pairs;
use crate::store::Store;
use crate::suite::{Algorithm, Suite};

/// An event during the run of a suite.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// An algorithm begins.
    Begin {
        /// Its name among the results.
        algorithm: &'a str,
        /// Number of episodes.
        total: usize,
        /// Number of episodes that earlier runs finished.
        done: usize,
    },
    /// An episode is done.
    Played,
    /// An episode could not be played.
    Failed(&'a Failed),
    /// An algorithm ends, whether or not all its episodes are done.
    End,
}

/// Options for the run of a suite.
#[derive(Clone, Copy)]
pub struct RunOptions<'a> {
    /// Number of threads; an algorithm may set a lower limit.
    pub threads: usize,
    /// Set it to stop the run soon. Unfinished episodes are discarded.
    pub stop: &'a Arc<AtomicBool>,
    /// Called for each event.
    pub watch: &'a (dyn Fn(Event<'_>) + Sync),
}

/// The outcome of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Episodes that this run played.
    pub num_played: usize,
    /// Episodes that could not be played.
    pub num_failed: usize,
    /// Whether all results are complete.
    pub is_whole: bool,
}

/// Plays those episodes of all algorithms that are not in the store yet.
///
/// # Errors
/// Those of [`built_in`], before any episode is played; if results cannot be written.
pub fn run(
    suite: &Suite,
    environments: &EpisodeConfigs,
    store: &Arc<Store>,
    running: RunOptions<'_>,
) -> Result<Summary, Error> {
    let algorithms = built_in(suite)?;
    let mut summary = Summary { is_whole: true, ..Summary::default() };
    for (algorithm, built_in) in algorithms {
        if running.stop.load(Relaxed) {
            summary.is_whole = false;
            break;
        }
        let part = run_one(algorithm, &built_in, environments, store, running)?;
        summary.num_played += part.num_played;
        summary.num_failed += part.num_failed;
        summary.is_whole &= part.is_whole;
    }
    Ok(summary)
}

/// Returns the algorithms of a suite if all are built in.
///
/// # Errors
/// One line about the first algorithm that is not built in or has an invalid parameter, or about maps that only
/// environments in Python know.
pub fn built_in(suite: &Suite) -> Result<Vec<(&Algorithm, BuiltIn)>, Error> {
    let values = |field| suite.environments.values_of(field);
    let name = values("map_name").into_iter().find_map(Value::as_str);
    if let (Some(name), true) = (name, values("use_maps").contains(&&Value::Bool(false))) {
        return Err(suite.in_file(Error::config("map_name", name, "no name with `use_maps: false`")));
    }
    suite.algorithms.iter().map(|algorithm| Ok((algorithm, built_in_of(suite, algorithm)?))).collect()
}

/// Returns an algorithm of a suite if it is built in.
///
/// # Errors
/// One line if it is not built in or has an invalid parameter.
pub(crate) fn built_in_of(suite: &Suite, algorithm: &Algorithm) -> Result<BuiltIn, Error> {
    let built_in = BuiltIn::of(algorithm, suite.folder()).unwrap_or_else(|| Err(unknown(algorithm)));
    built_in.map_err(|error| suite.in_algorithms_file(error))
}

fn unknown(algorithm: &Algorithm) -> Error {
    let all: Vec<&str> = pogema_policies::NamedPolicy::all().into_iter().map(|(name, _)| name).collect();
    let (line, key, name) = (algorithm.line, &algorithm.key, &algorithm.name);
    let known = all.join(", ");
    let reason = format!(
        "line {line}: `{key}.name`: `{name}` is not built in, expected one of {known}; \
         to run policies written in Python, use `pogema_rs.toolbox`"
    );
    Error::Syntax { reason }
}

/// Plays those episodes of one algorithm that are not in the store yet.
///
/// # Errors
/// If results cannot be read or written.
pub fn run_one(
    algorithm: &Algorithm,
    built_in: &BuiltIn,
    environments: &EpisodeConfigs,
    store: &Arc<Store>,
    running: RunOptions<'_>,
) -> Result<Summary, Error> {
    let total = environments.len();
    let Some(progress) = Progress::open(store, &algorithm.key, total)? else {
        return Ok(Summary { is_whole: true, ..Summary::default() });
    };
    (running.watch)(Event::Begin { algorithm: &algorithm.key, total, done: progress.num_done() });
    let tasks = environments.by_cost(progress.to_do());
    let built_in = built_in.clone().cancelled_by(running.stop);
    let (num_played, num_failed) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let progress = Mutex::new(progress);
    let one = |index: usize| {
        if running.stop.load(Relaxed) {
            return Ok(());
        }
        let played = played(index, environments, &built_in);
        let mut progress = progress.lock().unwrap_or_else(PoisonError::into_inner);
        match played {
            Ok(played) => {
                progress.keep(done(index, played))?;
                num_played.fetch_add(1, Relaxed);
                (running.watch)(Event::Played);
            }
            Err(_) if running.stop.load(Relaxed) => {}
            Err(failed) => {
                progress.note(&failed)?;
                num_failed.fetch_add(1, Relaxed);
                (running.watch)(Event::Failed(&failed));
            }
        }
        Ok(())
    };
    let threads = algorithm.num_processes.map_or(running.threads, |most| most.min(running.threads));
    // Threads take tasks one by one. The longest episodes begin first, so that no thread idles long at the end.
    pool(threads)?.install(|| tasks.into_iter().par_bridge().try_for_each(one))?;
    (running.watch)(Event::End);
    let progress = progress.into_inner().unwrap_or_else(PoisonError::into_inner);
    let is_whole = progress.finish(environments)?;
    Ok(Summary { num_played: num_played.into_inner(), num_failed: num_failed.into_inner(), is_whole })
}

fn played(index: usize, environments: &EpisodeConfigs, built_in: &BuiltIn) -> Result<Played, Box<Failed>> {
    let failed = |error: Error, config| {
        let env_grid_search = environments.changes(index).unwrap_or_default();
        Box::new(Failed {
            index,
            env_grid_search,
            config,
            error: error.to_string(),
            traceback: String::new(),
        })
    };
    let environment = environments.at(index).map_err(|error| failed(error, Value::Null))?;
    play(&environment.config, built_in).map_err(|error| failed(error, environment.config.to_value()))
}

pub(crate) fn done(index: usize, played: Played) -> Done {
    let (metrics, runtime) = (measured(&played), played.runtime.as_secs_f64());
    let network_time = played.network_time.map(|time| time.as_secs_f64());
    Done { index, metrics, runtime, network_time, proof: played.proof, ..Done::default() }
}

/// Returns the metrics of an episode as in results: POGEMA's counts as whole numbers, means as floats.
pub(crate) fn measured(played: &Played) -> Pairs {
    let ep_length_is_count = played.metrics.soc.is_some();
    let entry = |(name, value): (&str, f64)| {
        let is_count = COUNTS.contains(&name) || name == "ep_length" && ep_length_is_count;
        (name.to_owned(), if is_count { (value as u64).into() } else { value.into() })
    };
    played.metrics.named().into_iter().map(entry).collect()
}

const COUNTS: [&str; 4] = ["SoC", "makespan", "a_collisions", "o_collisions"];

fn pool(threads: usize) -> Result<ThreadPool, Error> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|error| Error::external("threads", error))
}
