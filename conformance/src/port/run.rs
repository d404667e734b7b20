//! Runs of ports over everything that they claim.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use pogema_core::Error;

use super::claims::{Mode, needed_by, profile_of};
use super::items::{Item, items};
use super::judge::{Judged, judge};
use super::keep::keep;
use super::link::{Link, Misbehaviour};
use super::plan::Plan;
use super::protocol::{Hello, Profile};
use super::report::{ItemResult, PortReport, add_result};
use super::shrink::shrink;
use crate::runner::{Progress, on_workers};

/// Number of misbehaviours after which the other items of a port are skipped.
const MAX_FAULTS: u64 = 20;

/// A port, and a function that starts it.
pub struct Subject<'a> {
    /// The command line; names the port until it answers `hello`.
    pub command: String,
    /// Starts the port: once for each worker, and again after each misbehaviour.
    pub start: Box<dyn Fn() -> Result<Box<dyn Link>, Misbehaviour> + Sync + 'a>,
}

/// Checks ports in parallel. Calls `total` once with the number of checks, and `progress` after each check.
///
/// # Errors
/// If a case or recording cannot be read.
pub fn check_ports(
    subjects: &[Subject<'_>],
    plan: &Plan,
    total: impl FnOnce(u64),
    progress: Progress<'_>,
) -> Result<Vec<PortReport>, Error> {
    let items = items(plan)?;
    let num_subjects = subjects.len() as u64;
    total(items.len() as u64 * num_subjects);
    let faults: Vec<AtomicU64> = subjects.iter().map(|_| AtomicU64::new(0)).collect();
    let results = on_workers(
        plan.num_workers,
        items.len() as u64 * num_subjects,
        || Ok(subjects.iter().map(|_| None).collect::<Vec<Option<Running>>>()),
        |running, number| {
            let (item, subject) =
                (&items[(number / num_subjects) as usize], (number % num_subjects) as usize);
            let slot = &mut running[subject];
            let result = check_item(&subjects[subject], subject, slot, &faults[subject], plan, item);
            progress();
            result
        },
    )?;
    let blank =
        |subject: &Subject<'_>| PortReport { command: subject.command.clone(), ..PortReport::default() };
    let mut reports: Vec<PortReport> = subjects.iter().map(blank).collect();
    for result in results {
        add_result(&mut reports[result.subject], result, plan);
    }
    Ok(reports)
}

/// Shrinks the example of each cause and writes it as a case.
///
/// # Errors
/// If a case cannot be written.
pub fn shrink_causes(
    subject: &Subject<'_>,
    report: &mut PortReport,
    plan: &Plan,
    folder: &Path,
    progress: Progress<'_>,
) -> Result<(), Error> {
    let mut slot = None;
    let name = report.hello.as_ref().map_or_else(|| report.command.clone(), |hello| hello.name.clone());
    for cause in report.causes.iter_mut().filter(|cause| cause.rule.is_some()) {
        // If the port cannot be started again, the example stays unchanged.
        if let Ok(running) = running(subject, &mut slot, plan) {
            let shrunk = shrink(running.link.as_mut(), &running.hello, &cause.example);
            cause.example = shrunk.example;
            if shrunk.has_faulted {
                slot = None;
            }
        }
        cause.kept = keep(&cause.example, &name, folder)?;
        cause.replay = cause.kept.as_ref().map(|path| {
            let quoted = shell_words::join([subject.command.as_str(), "--case", &path.display().to_string()]);
            format!("pogema conform --port {quoted}")
        });
        progress();
    }
    Ok(())
}

/// A started port.
struct Running {
    link: Box<dyn Link>,
    hello: Hello,
}

fn check_item(
    subject: &Subject<'_>,
    index: usize,
    slot: &mut Option<Running>,
    faults: &AtomicU64,
    plan: &Plan,
    item: &Item,
) -> Result<ItemResult, Error> {
    let (request, expected) = item.request(plan.seed)?;
    let mut result = ItemResult {
        subject: index,
        name: item.name(plan.seed),
        case_rule: item.case_rule().map(str::to_owned),
        num_steps: expected.records.iter().filter(|record| record.step().is_some()).count() as u64,
        judged: Vec::new(),
        is_cut_off: false,
        hello: None,
    };
    for mode in [Mode::Instance, Mode::Config] {
        if faults.load(Ordering::Relaxed) >= MAX_FAULTS {
            result.is_cut_off = result.judged.is_empty();
            break;
        }
        let running = match running(subject, slot, plan) {
            Ok(running) => running,
            Err(fault) => {
                faults.fetch_add(MAX_FAULTS, Ordering::Relaxed);
                result.judged.push((mode, Judged { fault: Some(fault), request, ..Judged::default() }));
                break;
            }
        };
        result.hello = Some(running.hello.clone());
        if !is_played_in(mode, &running.hello, plan, item) {
            continue;
        }
        let mut judged = match item.case_rule().and_then(|rule| needed_by(&running.hello, rule)) {
            Some(unclaimed) => Judged { not_claimed: vec![unclaimed], ..Judged::default() },
            None => judge(running.link.as_mut(), &running.hello, mode, &request, &expected),
        };
        if let Item::Case(_, case) = item {
            // Without the features that its rule is about, a case does not test the rule.
            let missing = judged.not_claimed.iter().any(|unclaimed| unclaimed.covers(&case.rule));
            judged.is_played &= !missing || !judged.divergences.is_empty();
        }
        if judged.fault.is_some() {
            faults.fetch_add(1, Ordering::Relaxed);
            *slot = None;
        }
        result.judged.push((mode, judged));
    }
    Ok(result)
}

fn running<'s>(
    subject: &Subject<'_>,
    slot: &'s mut Option<Running>,
    plan: &Plan,
) -> Result<&'s mut Running, Misbehaviour> {
    if let Some(running) = slot {
        return Ok(running);
    }
    let mut link = (subject.start)()?;
    let mut hello = link.hello()?;
    if !plan.profiles.is_empty() {
        hello.profiles.retain(|profile| *profile == Profile::Core || plan.profiles.contains(profile));
    }
    Ok(slot.insert(Running { link, hello }))
}

/// Returns whether an item is played in a mode. Items about drawing need a config; all others use every mode.
fn is_played_in(mode: Mode, hello: &Hello, plan: &Plan, item: &Item) -> bool {
    let seeds = hello.profiles.contains(&Profile::Seeding);
    let only_seeding =
        plan.profiles.iter().all(|profile| *profile == Profile::Seeding) && !plan.profiles.is_empty();
    let is_about_seeding =
        item.case_rule().is_some_and(|rule| profile_of(rule) == Profile::Seeding || rule == "seed/actions");
    match mode {
        Mode::Instance => !is_about_seeding && !only_seeding,
        // Items about seeding are included even if seeding is not claimed, to report that once.
        Mode::Config => seeds || is_about_seeding,
    }
}
