//! One run over everything there is to check.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use pogema_core::Error;
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;
use serde::Serialize;

use crate::compare::{Divergence, compare};
use crate::draw::draw_request;
use crate::events::Events;
use crate::golden::GoldenRecording;
use crate::laws::broken_law;
use crate::oracle::Oracle;
use crate::play::{NamedEngine, play_on};
use crate::request::{Request, Response};
use crate::script::play_script;
use crate::tally::Tally;
use crate::{cases, golden};

/// What a run found.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// The parts of the run, in order.
    pub parts: Vec<RunPart>,
    /// Comparisons by rule.
    pub tally: Tally,
    /// What happened in the episodes.
    pub events: Events,
    /// What went wrong.
    pub failures: Vec<Fault>,
}

/// One part of a run: the golden recordings, the cases, and so on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RunPart {
    /// Its name.
    pub name: String,
    /// Files or cases checked.
    pub checked: u64,
    /// Those that failed.
    pub failed: u64,
    /// What happened in their episodes.
    pub events: Events,
}

/// One thing that went wrong.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fault {
    /// The part of the run.
    pub part: String,
    /// The file or case.
    pub name: String,
    /// The difference, if two answers differ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub divergence: Option<Divergence>,
    /// What is wrong, in words.
    pub text: String,
    /// Where it was kept, to be played again.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kept: Option<PathBuf>,
}

/// How a run goes on; called after each case.
pub type Progress<'a> = &'a (dyn Fn() + Sync);

/// The result of one case.
#[derive(Default)]
struct Checked {
    tally: Tally,
    events: Events,
    fault: Option<Fault>,
}

impl Checked {
    /// A case whose episodes are counted.
    fn of(response: &Response) -> Self {
        let mut checked = Self::default();
        checked.events.watch(response);
        checked
    }

    /// Compares one engine's answer; the first fault stays.
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
    /// Whether everything agreed.
    pub fn agrees(&self) -> bool {
        self.failures.is_empty()
    }

    fn take(&mut self, name: &str, results: Vec<Checked>) {
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

    /// Checks an engine against the recordings of a folder.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn check_recordings(&mut self, part: &str, folder: &Path, engine: NamedEngine) -> Result<(), Error> {
        let mut results = Vec::new();
        for path in golden::recording_files(folder)? {
            for (index, recording) in golden::read(&path)?.iter().enumerate() {
                let name = format!("{} line {}", path.display(), index + 1);
                let got = play_on(engine, &recording.request);
                results.push(check(part, &name, &recording.request, &recording.response, &got));
            }
        }
        self.take(part, results);
        Ok(())
    }

    /// Checks an engine against the cases of a folder.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn check_cases(&mut self, part: &str, folder: &Path, engine: NamedEngine) -> Result<(), Error> {
        let mut results = Vec::new();
        for path in golden::files(folder, ".yaml")? {
            let case = cases::read(&path)?;
            let response = play_on(engine, &case.request()?);
            let mut checked = Checked::of(&response);
            let mismatch = case.mismatch(&response);
            checked.tally.count(&case.rule, mismatch.is_none());
            checked.fault = mismatch.map(|text| fault(part, &path.display().to_string(), text));
            results.push(checked);
        }
        self.take(part, results);
        Ok(())
    }

    /// Checks the engines against each other, and the first against the laws, on freshly drawn cases.
    ///
    /// # Errors
    /// If a worker fails.
    pub fn check_fresh(
        &mut self,
        engines: &[NamedEngine],
        num_cases: u64,
        seed: u64,
        keep: &Path,
        progress: Progress<'_>,
    ) -> Result<(), Error> {
        let Some((&first, others)) = engines.split_first() else { return Ok(()) };
        let check = |(): &mut (), case| {
            let (request, expected) = play_script(first, draw_request(seed, case), seed);
            let name = format!("case {case} of seed {seed}");
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
            progress();
            Ok(checked)
        };
        self.take("fresh", on_workers(None, num_cases, || Ok(()), check)?);
        Ok(())
    }

    /// Checks engines against POGEMA itself on freshly drawn cases.
    ///
    /// # Errors
    /// If POGEMA cannot be started or ends.
    pub fn check_oracle(
        &mut self,
        engines: &[NamedEngine],
        python: &Path,
        num_cases: u64,
        seed: u64,
        keep: &Path,
        progress: Progress<'_>,
    ) -> Result<(), Error> {
        let check = |oracle: &mut Oracle, case| {
            let request = play_script(NamedEngine::REFERENCE, draw_request(seed, case), seed).0;
            // POGEMA works on its answer while we work on ours.
            oracle.send(&request)?;
            let answers: Vec<_> = engines.iter().map(|&engine| play_on(engine, &request)).collect();
            let expected = oracle.receive()?;
            let name = format!("case {case} of seed {seed}");
            let mut checked = Checked::of(&expected);
            for (engine, got) in engines.iter().zip(&answers) {
                checked.compare("oracle", &name, *engine, (&request, &expected), got);
            }
            keep_fault(&mut checked, keep, &request, &expected);
            progress();
            Ok(checked)
        };
        self.take("oracle", on_workers(None, num_cases, || Oracle::start(python), check)?);
        Ok(())
    }

    /// Checks the cases of a folder against POGEMA itself.
    ///
    /// # Errors
    /// If a file cannot be read, or POGEMA cannot be started or ends.
    pub fn check_cases_with_oracle(&mut self, folder: &Path, python: &Path) -> Result<(), Error> {
        let mut oracle = Oracle::start(python)?;
        let mut results = Vec::new();
        for path in golden::files(folder, ".yaml")? {
            let case = cases::read(&path)?;
            if !case.is_for_pogema() {
                continue;
            }
            let name = path.display().to_string();
            let request = case.request()?;
            let expected = oracle.ask(&request)?;
            let got = crate::play(&request);
            let agreed = check("cases with oracle", &name, &request, &expected, &got);
            // Where we differ by decision, POGEMA must really do otherwise.
            let checked = match (&case.pogema, agreed.fault.is_some()) {
                (None, _) => agreed,
                (Some(_), true) => Checked::default(),
                (Some(_), false) => {
                    let text = "POGEMA does the same, though the case says that it does not".into();
                    Checked { fault: Some(fault("cases with oracle", &name, text)), ..Checked::default() }
                }
            };
            results.push(checked);
        }
        self.take("cases with oracle", results);
        Ok(())
    }
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

/// Keeps a failed case on disk, with the expected answer; a failure to do so is told along with it.
fn keep_fault(checked: &mut Checked, folder: &Path, request: &Request, expected: &Response) {
    let Some(fault) = &mut checked.fault else { return };
    let path = folder.join(format!("{}-{}.jsonl", fault.part, fault.name.replace(' ', "-")));
    let recording = GoldenRecording { request: request.clone(), response: expected.clone() };
    let kept = std::fs::create_dir_all(folder)
        .map_err(|error| Error::io(folder, error))
        .and_then(|()| golden::write(&path, &[recording]));
    match kept {
        Ok(()) => fault.kept = Some(path),
        Err(error) => fault.text = format!("{}\n  could not be kept: {error}", fault.text),
    }
}

/// Runs cases on some workers, or as many as there are cores; the results come in the order of the cases.
///
/// A worker may be a process that is slow to start, so there is one for each thread and not for each part of the work.
pub(crate) fn on_workers<W: Send, T: Send>(
    num_workers: Option<usize>,
    num_cases: u64,
    make_worker: impl Fn() -> Result<W, Error> + Sync,
    run: impl Fn(&mut W, u64) -> Result<T, Error> + Sync,
) -> Result<Vec<T>, Error> {
    let pool = ThreadPoolBuilder::new().num_threads(num_workers.unwrap_or_default()).build();
    let pool = pool.map_err(|error| Error::external("threads", error))?;
    let idle = Mutex::new(Vec::new());
    let locked = || idle.lock().unwrap_or_else(PoisonError::into_inner);
    let one = |case| {
        let taken = locked().pop();
        let mut worker = taken.map_or_else(&make_worker, Ok)?;
        let result = run(&mut worker, case);
        locked().push(worker);
        result
    };
    pool.install(|| (0..num_cases).into_par_iter().map(one).collect())
}
