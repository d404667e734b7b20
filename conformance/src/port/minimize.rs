//! Shrinks occurrences of each group and keeps them as cases on disk. Splits a group whose occurrences shrink to
//! different causes, and checks whether each kept case shows its cause again.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use pogema_core::Error;

use super::circumstances::circumstances;
use super::group::{Cause, Example, Share};
use super::items::Item;
use super::keep::{file_stem, keep};
use super::link::Misbehaviour;
use super::plan::Plan;
use super::report::PortReport;
use super::run::judge_item;
use super::shrink::{Budget, shrink};
use super::subject::{Subject, Worker};
use crate::runner::Watch;

/// Maximum number of occurrences of one group that are shrunk.
const MAX_SHRUNK: usize = 8;
/// Maximum number of misbehaviours of one group that are shrunk. Each repetition of a misbehaviour costs a new process.
const MAX_SHRUNK_FAULTS: usize = 2;

/// Shrinks several occurrences of each group, keeps the smallest as a case, and splits groups whose occurrences shrink
/// to different causes. Once `watch.stop` is set, examples stay as large as they are.
///
/// # Errors
/// If a case cannot be written or read again; the report is complete, but keeps no case from then on.
pub fn shrink_causes(
    subject: &Subject<'_>,
    report: &mut PortReport,
    plan: &Plan,
    folder: &Path,
    watch: Watch<'_>,
) -> Result<(), Error> {
    let name = report.hello.as_ref().map_or_else(|| report.command.clone(), |hello| hello.name.clone());
    let worker = Worker::new(subject, plan);
    let mut keeper = Keeper { subject, plan, folder, name, worker, watch, num_kept: BTreeMap::new() };
    let mut causes = Vec::new();
    let mut kept = Ok(());
    for cause in std::mem::take(&mut report.causes) {
        // A port that does not start has played nothing.
        if cause.example.op().is_none() || kept.is_err() {
            causes.push(cause);
        } else {
            kept = keeper.shrink_and_split(cause, &mut causes);
        }
        (watch.progress)();
    }
    report.causes = causes;
    kept
}

/// Keeps the cases of one port.
struct Keeper<'a> {
    subject: &'a Subject<'a>,
    plan: &'a Plan,
    folder: &'a Path,
    /// The name of the port.
    name: String,
    worker: Worker<'a>,
    watch: Watch<'a>,
    /// The number of cases kept under each file name.
    num_kept: BTreeMap<String, usize>,
}

impl Keeper<'_> {
    /// Adds the parts of a cause to `causes`, even if their cases cannot be kept.
    fn shrink_and_split(&mut self, mut cause: Cause, causes: &mut Vec<Cause>) -> Result<(), Error> {
        let original = cause.example.clone();
        let mut groups: BTreeMap<String, Vec<Example>> = BTreeMap::new();
        for example in self.shrink_some(std::mem::take(&mut cause.occurrences)) {
            groups.entry(circumstances(&example)).or_default().push(example);
        }
        let shrunk = groups.values().map(Vec::len).sum();
        let is_split = groups.len() > 1;
        let mut groups: Vec<(String, Vec<Example>)> = groups.into_iter().collect();
        // The most common cause first.
        groups.sort_by_key(|(_, examples)| std::cmp::Reverse(examples.len()));
        let mut kept = Ok(());
        for (when, mut examples) in groups {
            examples.sort_by_key(Example::size);
            let share = is_split.then_some(Share { alike: examples.len(), shrunk });
            let mut part = Cause { when, share, ..cause.clone() };
            examples.extend((!is_split).then(|| original.clone()));
            if kept.is_ok() {
                kept = self.keep_first_repeated(&mut part, &examples);
            }
            if let (Err(_), Some(smallest)) = (&kept, examples.first()) {
                part.example = smallest.clone();
            }
            causes.push(part);
        }
        kept
    }

    /// Shrinks some occurrences: the smallest, and others of all sizes.
    fn shrink_some(&mut self, mut occurrences: Vec<Example>) -> Vec<Example> {
        occurrences.sort_by_cached_key(Example::size);
        let fault = occurrences.first().and_then(|example| example.fault.as_ref());
        // Each repetition of a hang costs the time limit. A shorter limit is enough to find the same hang again.
        let hangs = fault.is_some_and(Misbehaviour::is_hang);
        let max_shrunk = match fault {
            Some(_) if hangs => 1,
            Some(_) => MAX_SHRUNK_FAULTS,
            None => MAX_SHRUNK,
        };
        let count = occurrences.len().min(max_shrunk);
        self.worker.restart(hangs);
        let mut budget = Budget::FULL;
        let mut shrunk = Vec::new();
        for index in 0..count {
            let occurrence = &occurrences[index * occurrences.len() / count];
            let example = shrink(&mut self.worker, occurrence, &mut budget, self.watch);
            // An example that could not be shrunk to the end says nothing about its cause.
            if shrunk.is_empty() || !(budget.is_spent() || self.watch.is_stopped()) {
                shrunk.push(example);
            }
        }
        shrunk
    }

    /// Tries the first examples and the last, and keeps the first of them that a new process of the port shows again.
    /// If no example is shown again, keeps the first example, or for a misbehaviour the example of the run.
    fn keep_first_repeated(&mut self, cause: &mut Cause, examples: &[Example]) -> Result<(), Error> {
        // Each attempt may cost the time limit.
        const MAX_ATTEMPTS: usize = 3;
        let path = self.new_path(&cause.example);
        let mut repeated = None;
        for example in examples.iter().take(MAX_ATTEMPTS - 1).chain(examples.last()) {
            keep(example, &self.name, &path)?;
            if self.watch.is_stopped() {
                break;
            }
            repeated = self.repeat(&path, example)?;
            if repeated.is_some() {
                break;
            }
        }
        cause.is_repeated = (!self.watch.is_stopped()).then_some(repeated.is_some());
        // The report shows what the replay shows. If the replay does not show a misbehaviour, the misbehaviour may
        // depend on the time limit, so the example of the run is kept.
        let smallest = examples.first().filter(|example| example.fault.is_none()).unwrap_or(&cause.example);
        if repeated.is_none() {
            keep(smallest, &self.name, &path)?;
        }
        cause.example = repeated.unwrap_or_else(|| smallest.clone());
        let words = self.subject.replay.iter().cloned();
        cause.replay = Some(shell_words::join(words.chain(["--case".into(), path.display().to_string()])));
        cause.kept = Some(path);
        Ok(())
    }

    /// Returns a new path for the case of an example.
    fn new_path(&mut self, example: &Example) -> PathBuf {
        let stem = file_stem(example);
        let count = self.num_kept.entry(stem.clone()).or_default();
        *count += 1;
        let number = if *count == 1 { String::new() } else { format!("-{count}") };
        self.folder.join(format!("{stem}{number}.yaml"))
    }

    /// Plays the case in a file on a new process of the port, and returns the example that matches the kept one.
    fn repeat(&mut self, path: &Path, example: &Example) -> Result<Option<Example>, Error> {
        self.worker.restart(false);
        let item = Item::of_file(path)?;
        let (request, expected) = item.request(self.plan.seed)?;
        let played = (&request, &expected);
        let (_, results) = judge_item(&mut self.worker, self.plan, &item, played, |_| false);
        let mut shown =
            results.into_iter().flat_map(|(mode, judged)| Example::all_of(&example.name, mode, judged));
        Ok(shown.find(|shown| shown.is_like(example)))
    }
}
