//! `pogema evaluate`: plays all episodes of a suite and stores each as soon as it ends.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{HumanDuration, ProgressBar};
use pogema_core::files::{folder_of, write_whole};
use pogema_core::{Error, SimdPath, counted};
use pogema_toolbox::report::{Replay, SHOWN, page, picks};
use pogema_toolbox::views::check_views;
use pogema_toolbox::{
    Begin, EpisodeConfigs, Event, HasResults, REPORT, Results, RunOptions, Store, Suite, Summary, built_in,
    run,
};

use crate::interrupt::exit_on_ctrl_c;
use crate::maps::Sources;
use crate::output::{check_files, is_same_folder, print_line, progress_bar, tell, tell_warnings};
use crate::threads::{note_threads, number_of_threads};

#[derive(Args, Debug)]
pub struct Evaluate {
    /// Suite to play: a YAML file with environments, algorithms and views
    suite: PathBuf,
    /// YAML file whose `algorithms` replace those of the suite
    #[arg(long, value_name = "FILE")]
    algorithms: Option<PathBuf>,
    /// Folder for the results
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    #[command(flatten)]
    sources: Sources,
    /// Number of threads that play episodes [default: the number of processors]
    #[arg(long, value_name = "N", value_parser = number_of_threads())]
    threads: Option<usize>,
    /// Resume an interrupted run: play only the missing episodes
    #[arg(long, conflicts_with = "force")]
    resume: bool,
    /// Delete the results of earlier runs in the folder
    #[arg(long)]
    force: bool,
    /// Write an HTML page with tables, plots and replays [default file: `report.html` in the folder of the results]
    #[arg(long, value_name = "FILE", num_args = 0..=1)]
    html: Option<Vec<PathBuf>>,
}

impl Evaluate {
    pub fn run(&self) -> Result<(), Error> {
        let mut suite = Suite::read(&self.suite)?;
        if let Some(path) = &self.algorithms {
            suite = suite.with_algorithms(path)?;
        }
        built_in(&suite)?;
        check_views(&suite)?;
        let environments = environments(&suite, &self.sources)?;
        let named = self.html.as_ref().and_then(|named| named.first());
        named.map_or(Ok(()), |path| self.check_report(path, &suite))?;
        // Reports an invalid `POGEMA_SIMD` now: every episode would fail with it.
        SimdPath::from_environment()?;
        let report = self.html.as_ref().map(|_| named.cloned().unwrap_or_else(|| self.out.join(REPORT)));
        let begin = match (self.resume, self.force) {
            (true, _) => Begin::Resume,
            (_, true) => Begin::Anew,
            _ => Begin::New,
        };
        let store = Store::open(&self.out, &suite, &environments, begin).map_err(|error| {
            HasResults::explained(error, "`--resume` continues them, `--force` deletes them")
        })?;
        let store = Arc::new(store);
        let bar = Arc::new(Bar::default());
        let (shown, folder) = (Arc::clone(&bar), self.out.clone());
        exit_on_ctrl_c(move || shown.interrupted(&folder))?;
        let watch = |event: Event<'_>| bar.show(event);
        let stop = Arc::<AtomicBool>::default();
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = self.threads.unwrap_or(cores);
        note_threads(threads);
        let running = RunOptions { threads, stop: &stop, watch: &watch };
        let summary = run(&suite, &environments, &store, running)?;
        bar.has_ended.store(true, Relaxed);
        let write = |path: &PathBuf| write_report(path, &self.out, &suite, &environments, &store);
        let written = report.as_ref().map_or(Ok(()), write);
        // If no episode could be played, the page fails too: report the cause, not the consequence.
        print_summary(&self.out, &suite, &summary).and(written)
    }

    /// Checks that the report can be written, and that it replaces neither a result nor a file that the suite needs.
    fn check_report(&self, path: &Path, suite: &Suite) -> Result<(), Error> {
        let is_among_results = is_same_folder(folder_of(path), &self.out);
        if is_among_results && path.extension().is_none_or(|ending| ending != "html") {
            let reason = "is in the folder of the results, expected a name that ends in `.html`";
            return Err(Error::io(path, reason));
        }
        if is_among_results && !self.out.exists() {
            // The store makes the folder.
            return Ok(());
        }
        let inputs = std::iter::once(&self.suite).chain(&self.algorithms).chain(self.sources.paths());
        let inputs: Vec<&Path> = inputs.chain(&suite.maps).map(PathBuf::as_path).collect();
        check_files(&inputs, [("--html", path)])
    }
}

/// Returns the environments of a suite, with maps from files, and prints all warnings.
pub fn environments(suite: &Suite, sources: &Sources) -> Result<EpisodeConfigs, Error> {
    let (environments, warnings) = suite.environments(sources.paths())?;
    tell_warnings(&warnings);
    Ok(environments)
}

fn write_report(
    path: &Path,
    folder: &Path,
    suite: &Suite,
    environments: &EpisodeConfigs,
    store: &Store,
) -> Result<(), Error> {
    let results = Results::read(&[folder.to_owned()])?;
    let picks = picks(&results, SHOWN);
    let bar = begin("replays", picks.len(), 0);
    let replays: Vec<Replay> = picks
        .into_iter()
        .map(|pick| Replay::of(pick, &results, suite, environments, &Arc::default()))
        .inspect(|_| bar.inc(1))
        .collect();
    bar.finish_and_clear();
    write_whole(path, page(suite, &store.manifest(), &results, &replays)?.as_bytes())?;
    tell(&format!("wrote {}", path.display()));
    Ok(())
}

fn print_summary(folder: &Path, suite: &Suite, summary: &Summary) -> Result<(), Error> {
    let Summary { num_played, num_failed, is_whole } = summary;
    if *num_failed > 0 {
        let files = suite.algorithms.iter().map(|algorithm| format!("{}.failed.jsonl", algorithm.key));
        let files: Vec<String> = files.filter(|name| folder.join(name).exists()).collect();
        let reason = format!(
            "{} could not be played; see {} for the reasons; `--resume` tries them again",
            counted(*num_failed, "episode"),
            files.join(", ")
        );
        return Err(Error::io(folder, reason));
    }
    let rest = if *is_whole { "all results are complete" } else { "`--resume` plays the rest" };
    let played = counted(*num_played, "episode");
    print_line(&format!("{played} played; {rest}: {}", folder.display()))
}

/// A progress bar per algorithm, or a line every [`INTERVAL`] if the output is not a terminal.
#[derive(Default)]
struct Bar {
    shown: Mutex<Option<Shown>>,
    /// Whether all algorithms have ended; the report may still be missing.
    has_ended: AtomicBool,
}

/// The progress of an algorithm.
struct Shown {
    bar: ProgressBar,
    last_line: Instant,
    num_failed: u64,
}

/// Time between two progress lines.
const INTERVAL: Duration = Duration::from_secs(30);

impl Bar {
    /// Removes the bar, and returns a line on what is stored.
    fn interrupted(&self, folder: &Path) -> String {
        if self.has_ended.load(Relaxed) {
            let folder = folder.display();
            return format!(
                "the finished episodes are stored; `--resume --html` writes the report: {folder}"
            );
        }
        let bar = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
        let played = bar.as_ref().map_or_else(String::new, |Shown { bar, num_failed, .. }| {
            let (name, all) = (bar.message(), bar.length().unwrap_or_default());
            let done = bar.position() - num_failed;
            bar.finish_and_clear();
            format!("{done} of {all} episodes of `{name}` are stored; ")
        });
        format!("{played}`--resume` plays the rest: {}", folder.display())
    }

    fn show(&self, event: Event<'_>) {
        let mut shown = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
        match (event, shown.as_mut()) {
            (Event::Begin { algorithm, total, done }, _) => {
                let bar = begin(algorithm, total, done);
                *shown = Some(Shown { bar, last_line: Instant::now(), num_failed: 0 });
            }
            (Event::Played, Some(Shown { bar, last_line, .. })) => {
                bar.inc(1);
                if bar.is_hidden() && last_line.elapsed() >= INTERVAL {
                    *last_line = Instant::now();
                    let (name, done, all) = (bar.message(), bar.position(), bar.length().unwrap_or_default());
                    tell(&format!("{name}: {done} of {all} episodes, {} left", HumanDuration(bar.eta())));
                }
            }
            (Event::Failed(failed), Some(Shown { bar, num_failed, .. })) => {
                bar.suspend(|| tell(&format!("warning: episode {}: {}", failed.index, failed.error)));
                bar.inc(1);
                *num_failed += 1;
            }
            (Event::End, Some(Shown { bar, .. })) => bar.finish_and_clear(),
            (_, None) => {}
        }
    }
}

fn begin(algorithm: &str, total: usize, done: usize) -> ProgressBar {
    let bar = progress_bar("{msg} {wide_bar} {pos}/{len}, {eta} left", total as u64);
    bar.set_message(algorithm.to_owned());
    bar.inc(done as u64);
    bar.reset_eta();
    bar
}
