//! Runs of ports over everything that they claim.

use std::sync::atomic::{AtomicU64, Ordering};

use pogema_core::Error;

use super::claims::{Mode, needed_by, profile_of};
use super::items::{Item, items};
use super::judge::Judged;
use super::link::Misbehaviour;
use super::plan::Plan;
use super::protocol::{Hello, Profile};
use super::report::{ItemResult, PortReport, add_result};
use super::subject::{Subject, Worker};
use crate::request::{Request, Response};
use crate::runner::{Watch, on_workers};

/// Number of misbehaviours after which the other items of a port are skipped.
const MAX_FAULTS: u64 = 20;
/// Number of missing answers after which the other items are skipped, because each costs the time limit.
const MAX_HANGS: u64 = 5;

/// Checks ports in parallel. Calls `total` once with the number of checks.
///
/// # Errors
/// If a case or recording cannot be read, or the threads cannot be started.
pub fn check_ports(
    subjects: &[Subject<'_>],
    plan: &Plan,
    total: impl FnOnce(u64),
    watch: Watch<'_>,
) -> Result<Vec<PortReport>, Error> {
    let items = items(plan)?;
    let num_subjects = subjects.len() as u64;
    let num_checks = items.len().saturating_mul(num_subjects);
    total(num_checks);
    let faults: Vec<AtomicU64> = subjects.iter().map(|_| AtomicU64::new(0)).collect();
    let results = on_workers(
        plan.num_workers,
        num_checks,
        watch,
        || Ok(subjects.iter().map(|subject| Worker::new(subject, plan)).collect::<Vec<_>>()),
        |workers, number| {
            let subject = (number % num_subjects) as usize;
            items.with(number / num_subjects, |item| {
                check_item(&mut workers[subject], subject, &faults[subject], plan, item)
            })
        },
    )?;
    let blank =
        |subject: &Subject<'_>| PortReport { command: subject.command.clone(), ..PortReport::default() };
    let mut reports: Vec<PortReport> = subjects.iter().map(blank).collect();
    let mut num_left = vec![items.len(); subjects.len()];
    for result in results {
        num_left[result.subject] -= 1;
        add_result(&mut reports[result.subject], result, plan);
    }
    for (report, num_left) in reports.iter_mut().zip(num_left) {
        report.num_interrupted = num_left;
    }
    Ok(reports)
}

fn check_item(
    worker: &mut Worker<'_>,
    subject: usize,
    faults: &AtomicU64,
    plan: &Plan,
    item: &Item,
) -> Result<ItemResult, Error> {
    let mut result = ItemResult {
        subject,
        name: item.name(plan.seed),
        case_rule: item.case_rule().map(str::to_owned),
        num_steps: 0,
        judged: Vec::new(),
        is_cut_off: false,
        hello: None,
    };
    let is_over = || faults.load(Ordering::Relaxed) >= MAX_FAULTS;
    if is_over() {
        return Ok(ItemResult { is_cut_off: true, ..result });
    }
    let (request, expected) = item.request(plan.seed)?;
    result.num_steps = expected.records.iter().filter(|record| record.step().is_some()).count() as u64;
    (result.hello, result.judged) = judge_item(worker, plan, item, (&request, &expected), |judged| {
        faults.fetch_add(judged.fault.as_ref().map_or(0, weight), Ordering::Relaxed);
        is_over()
    });
    Ok(result)
}

/// Returns how much a misbehaviour counts towards the maximum.
fn weight(fault: &Misbehaviour) -> u64 {
    match fault {
        Misbehaviour { op: None, .. } => MAX_FAULTS,
        fault if fault.is_hang() => MAX_FAULTS / MAX_HANGS,
        _ => 1,
    }
}

/// Checks a port by an item, in each mode in which the item is played, until `is_over` returns true for a result.
///
/// Returns the claims of the port, if it started, and the results.
pub fn judge_item(
    worker: &mut Worker<'_>,
    plan: &Plan,
    item: &Item,
    (request, expected): (&Request, &Response),
    is_over: impl Fn(&Judged) -> bool,
) -> (Option<Hello>, Vec<(Mode, Judged)>) {
    let (hello, full_hello) = match worker.hello() {
        Ok((hello, full_hello)) => (hello.clone(), full_hello.clone()),
        Err(fault) => {
            let judged = Judged { fault: Some(fault), request: request.clone(), ..Judged::default() };
            is_over(&judged);
            return (None, vec![(Mode::Instance, judged)]);
        }
    };
    let unclaimed = item.case_rule().and_then(|rule| needed_by(&hello, rule));
    let mut results = Vec::new();
    for mode in [Mode::Instance, Mode::Config] {
        if !is_played_in(mode, &hello, plan, item) {
            continue;
        }
        let mut judged = match unclaimed.clone() {
            Some(unclaimed) => Judged { not_claimed: vec![unclaimed], ..Judged::default() },
            None => worker.judge(mode, request, expected),
        };
        if let Some(rule) = item.case_rule() {
            // Without the features that its rule is about, a case does not test the rule.
            let missing = judged.not_claimed.iter().any(|unclaimed| unclaimed.covers(rule));
            judged.is_played &= !missing || !judged.divergences.is_empty();
        }
        let is_over = is_over(&judged);
        results.push((mode, judged));
        if is_over {
            break;
        }
    }
    (Some(full_hello), results)
}

/// Returns whether an item is played in a mode: an item about drawing only from a config, any other from an instance
/// and, if the port claims seeding, also from a config. A plan for seeding alone plays nothing from an instance.
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
