//! Runs all checks of the engines.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use pogema_core::Error;
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;
use serde::Serialize;

use crate::compare::{Divergence, compare};
use crate::draw::{draw_extended_request, draw_request};
use crate::events::Events;
use crate::golden::GoldenRecording;
use crate::laws::broken_law;
use crate::oracle::Oracle;
use crate::play::{NamedEngine, play_on};
use crate::request::{Request, Response};
use crate::script::play_script;
use crate::tally::Tally;
use crate::{cases, golden};

/// The results of a run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// The parts of the run, in order.
    pub parts: Vec<RunPart>,
    /// Comparisons by rule.
    pub tally: Tally,
    /// Events in the episodes.
    pub events: Events,
    /// The failures.
    pub failures: Vec<Fault>,
}

/// One part of a run, such as the golden recordings or the cases.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RunPart {
    /// The name of the part.
    pub name: String,
    /// Number of recordings, cases or random episodes checked.
    pub checked: u64,
    /// Number of them that failed.
    pub failed: u64,
    /// Events in their episodes.
    pub events: Events,
}

/// One failure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fault {
    /// The part of the run.
    pub part: String,
    /// The line of a recording, the file of a case, or the number of a random episode.
    pub name: String,
    /// The difference, if two answers differ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub divergence: Option<Divergence>,
    /// A description of the failure.
    pub text: String,
    /// The file that keeps the case for replay.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kept: Option<PathBuf>,
}

/// How the caller follows a run, and ends it early.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Called after each case.
    pub progress: &'a (dyn Fn() + Sync),
    /// Another thread sets this to end the run soon. The report then covers the cases that were checked before.
    pub stop: &'a AtomicBool,
}

impl Default for Watch<'_> {
    fn default() -> Self {
        static NEVER: AtomicBool = AtomicBool::new(false);
        Self { progress: &|| (), stop: &NEVER }
    }
}

impl Watch<'_> {
    /// Returns whether the run must end.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Returns `None` after `stop`, because the key that stops the run also reaches the processes of the workers, which
    /// may then fail.
    fn unless_stopped<T>(&self, result: Result<T, Error>) -> Result<Option<T>, Error> {
        // The end of a process may be noticed before the thread that handles the key has run.
        let deadline = Instant::now() + Duration::from_secs(1);
        while result.is_err() && !self.is_stopped() && Instant::now() < deadline {
            thread::sleep(Duration::from_millis(10));
        }
        if self.is_stopped() { Ok(None) } else { result.map(Some) }
    }
}

/// The result of one case.
#[derive(Default)]
struct Checked {
    tally: Tally,
    events: Events,
    fault: Option<Fault>,
}

impl Checked {
    /// Creates a result with the events of a response.
    fn of(response: &Response) -> Self {
        let mut checked = Self::default();
        checked.events.watch(response);
        checked
    }

    /// Compares the answer of one engine, and keeps the first fault.
    fn compare(
        &mut self,
        part: &str,
        name: &str,
        engine: NamedEngine,
        (request, expected): (&Request, &Response),
        got: &Response,
    ) {
        let found = compare(request, expected, got, &mut self.tally);
        let fault = found.map(|found| {
            let fault = diverged(part, name, found);
            Fault { text: format!("{}:\n{}", engine.name, fault.text), ..fault }
        });
        self.fault = self.fault.take().or(fault);
    }
}

impl Report {
    /// Returns whether all checks passed.
    pub fn agrees(&self) -> bool {
        self.failures.is_empty()
    }

    fn add(&mut self, name: &str, results: Vec<Checked>) {
        let checked = results.len() as u64;
        let mut part = RunPart { name: name.into(), checked, failed: 0, events: Events::default() };
        for checked in results {
            self.tally.add(&checked.tally);
            part.events.add(&checked.events);
            if let Some(fault) = checked.fault {
                part.failed += 1;
                self.failures.push(fault);
            }
        }
        self.events.add(&part.events);
        self.parts.push(part);
    }

    /// Adds a part for each engine, from a function that returns the results of all engines in a case.
    fn add_for_each(
        &mut self,
        part: &str,
        engines: &[NamedEngine],
        num_cases: usize,
        watch: Watch<'_>,
        check: impl Fn(usize) -> Result<Vec<Checked>, Error> + Sync,
    ) -> Result<(), Error> {
        let check = |(): &mut (), case: u64| check(case as usize);
        let mut results = on_workers(None, num_cases as u64, watch, || Ok(()), check)?;
        for (index, engine) in engines.iter().enumerate() {
            let of_engine = results.iter_mut().map(|checked| std::mem::take(&mut checked[index])).collect();
            self.add(&part_of(part, *engine), of_engine);
        }
        Ok(())
    }

    /// Checks engines against the recordings of a folder. After `watch.stop`, the remaining recordings are skipped.
    ///
    /// # Errors
    /// If a file cannot be read or the threads cannot be started.
    pub fn check_recordings(
        &mut self,
        part: &str,
        folder: &Path,
        engines: &[NamedEngine],
        watch: Watch<'_>,
    ) -> Result<(), Error> {
        let mut lines = Vec::new();
        for path in golden::recording_files(folder)? {
            let of_file = golden::lines(&path)?.into_iter().enumerate();
            lines.extend(of_file.map(|(index, line)| (path.clone(), index, line)));
        }
        self.add_for_each(part, engines, lines.len(), watch, |number| {
            let (path, index, line) = &lines[number];
            let GoldenRecording { request, response } = golden::parse(path, *index, line)?;
            let name = format!("{} line {}", path.display(), index + 1);
            let on_engine = |&engine: &NamedEngine| {
                check(&part_of(part, engine), &name, &request, &response, &play_on(engine, &request))
            };
            Ok(engines.iter().map(on_engine).collect())
        })
    }

    /// Checks engines against the cases of a folder. After `watch.stop`, the remaining cases are skipped.
    ///
    /// # Errors
    /// Those of [`cases::read`], or if the threads cannot be started.
    pub fn check_cases(
        &mut self,
        part: &str,
        folder: &Path,
        engines: &[NamedEngine],
        watch: Watch<'_>,
    ) -> Result<(), Error> {
        let paths = golden::files(folder, ".yaml")?;
        self.add_for_each(part, engines, paths.len(), watch, |number| {
            let path = &paths[number];
            let case = cases::read(path)?;
            let request = case.request()?;
            let on_engine = |&engine: &NamedEngine| {
                let response = play_on(engine, &request);
                let mut checked = Checked::of(&response);
                let mismatch = case.mismatch(&response);
                checked.tally.count(&case.rule, mismatch.is_none());
                checked.fault =
                    mismatch.map(|text| fault(&part_of(part, engine), &path.display().to_string(), text));
                checked
            };
            Ok(engines.iter().map(on_engine).collect())
        })
    }

    /// Checks the engines against each other, and the first one against the invariants, on random episodes. Writes
    /// episodes that fail to the folder `keep`.
    ///
    /// # Errors
    /// If the threads cannot be started.
    pub fn check_fresh(
        &mut self,
        engines: &[NamedEngine],
        num_episodes: u64,
        seed: u64,
        keep: &Path,
        watch: Watch<'_>,
    ) -> Result<(), Error> {
        let Some((&first, others)) = engines.split_first() else { return Ok(()) };
        let check = |(): &mut (), number| {
            let (request, expected) = play_script(first, draw_extended_request(seed, number), seed);
            let name = format!("random episode {number} of seed {seed}");
            let mut checked = Checked::of(&expected);
            if let Some(law) = broken_law(&request, &expected) {
                checked.tally.count(law.rule, false);
                let text = format!("operation {}: {} (rule {})", law.op, law.text, law.rule);
                checked.fault = Some(fault("fresh", &name, text));
            }
            for &engine in others {
                let got = play_on(engine, &request);
                checked.compare("fresh", &name, engine, (&request, &expected), &got);
            }
            keep_fault(&mut checked, keep, &request, &expected);
            Ok(checked)
        };
        self.add("fresh", on_workers(None, num_episodes, watch, || Ok(()), check)?);
        Ok(())
    }

    /// Checks engines against POGEMA itself on random episodes. Writes episodes that fail to the folder `keep`.
    ///
    /// # Errors
    /// If POGEMA or the threads cannot be started, or if POGEMA ends or gives an unreadable answer.
    pub fn check_oracle(
        &mut self,
        engines: &[NamedEngine],
        python: &Path,
        num_episodes: u64,
        seed: u64,
        keep: &Path,
        watch: Watch<'_>,
    ) -> Result<(), Error> {
        let check = |oracle: &mut Oracle, number| {
            let request = play_script(NamedEngine::REFERENCE, draw_request(seed, number), seed).0;
            // POGEMA computes its answer while the engines compute theirs.
            oracle.send(&request)?;
            let answers: Vec<_> = engines.iter().map(|&engine| play_on(engine, &request)).collect();
            let expected = oracle.receive()?;
            let name = format!("random episode {number} of seed {seed}");
            let mut checked = Checked::of(&expected);
            for (engine, got) in engines.iter().zip(&answers) {
                checked.compare("oracle", &name, *engine, (&request, &expected), got);
            }
            keep_fault(&mut checked, keep, &request, &expected);
            Ok(checked)
        };
        self.add("oracle", on_workers(None, num_episodes, watch, || Oracle::start(python), check)?);
        Ok(())
    }

    /// Checks the cases of a folder against POGEMA itself. After `watch.stop`, the remaining cases are skipped.
    ///
    /// # Errors
    /// Those of [`cases::read`], or if POGEMA cannot be started, ends or gives an unreadable answer.
    pub fn check_cases_with_oracle(
        &mut self,
        folder: &Path,
        python: &Path,
        watch: Watch<'_>,
    ) -> Result<(), Error> {
        let Some(mut oracle) = watch.unless_stopped(Oracle::start(python))? else { return Ok(()) };
        let mut results = Vec::new();
        for path in golden::files(folder, ".yaml")? {
            let case = cases::read(&path)?;
            (watch.progress)();
            if !case.is_for_pogema() {
                continue;
            }
            let name = path.display().to_string();
            let request = case.request()?;
            let Some(expected) = watch.unless_stopped(oracle.ask(&request))? else { break };
            let got = crate::play(&request);
            let agreed = check("cases with oracle", &name, &request, &expected, &got);
            // If the case is a deviation by decision, POGEMA must really differ.
            let checked = match (&case.pogema, agreed.fault.is_some()) {
                (None, _) => agreed,
                (Some(_), true) => Checked::default(),
                (Some(_), false) => {
                    let text = "POGEMA agrees, but the key `pogema` of the case says that it differs".into();
                    Checked { fault: Some(fault("cases with oracle", &name, text)), ..Checked::default() }
                }
            };
            results.push(checked);
        }
        self.add("cases with oracle", results);
        Ok(())
    }
}

/// Returns the name of the part of a run that checks one of several engines.
fn part_of(part: &str, engine: NamedEngine) -> String {
    format!("{part}, {}", engine.name)
}

fn check(part: &str, name: &str, request: &Request, expected: &Response, got: &Response) -> Checked {
    let mut checked = Checked::of(expected);
    checked.fault =
        compare(request, expected, got, &mut checked.tally).map(|found| diverged(part, name, found));
    checked
}

fn fault(part: &str, name: &str, text: String) -> Fault {
    Fault { part: part.into(), name: name.into(), divergence: None, text, kept: None }
}

fn diverged(part: &str, name: &str, found: Divergence) -> Fault {
    Fault { text: found.to_string(), divergence: Some(found), ..fault(part, name, String::new()) }
}

/// Writes a failed case and its expected answer to a file. If that fails, adds the error to the description.
fn keep_fault(checked: &mut Checked, folder: &Path, request: &Request, expected: &Response) {
    let Some(fault) = &mut checked.fault else { return };
    let path = folder.join(format!("{}-{}.jsonl", fault.part, fault.name.replace(' ', "-")));
    let recording = GoldenRecording { request: request.clone(), response: expected.clone() };
    let kept = std::fs::create_dir_all(folder)
        .map_err(|error| Error::io(folder, error))
        .and_then(|()| golden::write(&path, &[recording]));
    match kept {
        Ok(()) => fault.kept = Some(path),
        Err(error) => fault.text = format!("{}\n  it could not be saved: {error}", fault.text),
    }
}

/// Runs cases on the given number of workers [default: one per core] and returns the results in case order. After
/// `watch.stop`, the remaining cases are skipped.
///
/// A worker may be a process that is slow to start, so idle workers are reused.
pub(crate) fn on_workers<W: Send, T: Send>(
    num_workers: Option<usize>,
    num_cases: u64,
    watch: Watch<'_>,
    make_worker: impl Fn() -> Result<W, Error> + Sync,
    run: impl Fn(&mut W, u64) -> Result<T, Error> + Sync,
) -> Result<Vec<T>, Error> {
    let pool = ThreadPoolBuilder::new().num_threads(num_workers.unwrap_or_default()).build();
    let pool = pool.map_err(|error| Error::external("threads", error))?;
    let idle = Mutex::new(Vec::new());
    let locked = || idle.lock().unwrap_or_else(PoisonError::into_inner);
    let run_case = |case| {
        let taken = locked().pop();
        let mut worker = match taken.map_or_else(&make_worker, Ok) {
            Ok(worker) => worker,
            Err(error) => return watch.unless_stopped(Err(error)).transpose(),
        };
        let result = run(&mut worker, case);
        locked().push(worker);
        (watch.progress)();
        watch.unless_stopped(result).transpose()
    };
    let cases = (0..num_cases).into_par_iter().take_any_while(|_| !watch.is_stopped());
    pool.install(|| cases.filter_map(run_case).collect())
}
