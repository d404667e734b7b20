//! Checks ports against everything that they claim.

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

/// Number of misbehaviours after which the remaining items are skipped if at least half of the checks ended with one.
const MAX_FAULTS: u64 = 20;
/// Number of misbehaviours after which the remaining items are skipped, because each costs a new process.
const MAX_RESTARTS: u64 = 500;
/// Number of missing answers after which the remaining items are skipped, because each costs the time limit.
const MAX_HANGS: u64 = 5;

/// Numbers of checks of a port so far, and of those that ended with a misbehaviour or without an answer.
#[derive(Debug, Default)]
struct Conduct {
    checks: AtomicU64,
    faults: AtomicU64,
    hangs: AtomicU64,
}

impl Conduct {
    fn add(&self, judged: &Judged) {
        let Some(fault) = &judged.fault else {
            self.checks.fetch_add(judged.is_played.into(), Ordering::Relaxed);
            return;
        };
        self.checks.fetch_add(1, Ordering::Relaxed);
        self.faults.fetch_add(1, Ordering::Relaxed);
        let num_hangs = match fault {
            // The port does not start.
            Misbehaviour { op: None, .. } => MAX_HANGS,
            fault => u64::from(fault.is_hang()),
        };
        self.hangs.fetch_add(num_hangs, Ordering::Relaxed);
    }

    /// Returns whether the remaining items are skipped.
    fn is_over(&self) -> bool {
        let [checks, faults, hangs] =
            [&self.checks, &self.faults, &self.hangs].map(|count| count.load(Ordering::Relaxed));
        hangs >= MAX_HANGS || faults >= MAX_RESTARTS || (faults >= MAX_FAULTS && 2 * faults >= checks)
    }
}

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
    let conducts: Vec<Conduct> = subjects.iter().map(|_| Conduct::default()).collect();
    let results = on_workers(
        plan.num_workers,
        num_checks,
        watch,
        || Ok(subjects.iter().map(|subject| Worker::new(subject, plan)).collect::<Vec<_>>()),
        |workers, number| {
            let subject = (number % num_subjects) as usize;
            items.with(number / num_subjects, |item| {
                check_item(&mut workers[subject], subject, &conducts[subject], plan, item)
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
    conduct: &Conduct,
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
    if conduct.is_over() {
        return Ok(ItemResult { is_cut_off: true, ..result });
    }
    let (request, expected) = item.request(plan.seed)?;
    result.num_steps = expected.records.iter().filter(|record| record.step().is_some()).count() as u64;
    (result.hello, result.judged) = judge_item(worker, plan, item, (&request, &expected), |judged| {
        conduct.add(judged);
        conduct.is_over()
    });
    Ok(result)
}

/// Checks a port with an item, in each mode in which the item is played, until `is_over` returns true for a result.
///
/// Returns the claims of the port and the results. If the port did not start, the claims are `None`.
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

/// Returns whether an item is played in a mode.
///
/// An item about seeding is played only from a config. Any other item is played from an instance. If the port claims
/// seeding, it is also played from a config. A plan for seeding alone plays nothing from an instance.
fn is_played_in(mode: Mode, hello: &Hello, plan: &Plan, item: &Item) -> bool {
    let seeds = hello.profiles.contains(&Profile::Seeding);
    let only_seeding =
        plan.profiles.iter().all(|profile| *profile == Profile::Seeding) && !plan.profiles.is_empty();
    let is_about_seeding =
        item.case_rule().is_some_and(|rule| profile_of(rule) == Profile::Seeding || rule == "seed/actions");
    match mode {
        Mode::Instance => !is_about_seeding && !only_seeding,
        // Items about seeding are included even if seeding is not claimed, to report the missing claim once.
        Mode::Config => seeds || is_about_seeding,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::port::link::FaultKind;

    fn conduct_of(num_checks: u64, faults: &[Misbehaviour]) -> Conduct {
        let conduct = Conduct::default();
        for fault in faults {
            conduct.add(&Judged { fault: Some(fault.clone()), ..Judged::default() });
        }
        for _ in faults.len() as u64..num_checks {
            conduct.add(&Judged { is_played: true, ..Judged::default() });
        }
        // A check of a feature that the port does not claim does not count.
        conduct.add(&Judged::default());
        conduct
    }

    fn fault(op: Option<usize>) -> Misbehaviour {
        Misbehaviour { op, ..Misbehaviour::new(FaultKind::Unrequested, "") }
    }

    #[test]
    fn frequent_faults_end_a_run_and_rare_ones_do_not() {
        let crash = fault(Some(1));
        assert!(!conduct_of(19, &vec![crash.clone(); 19]).is_over());
        assert!(conduct_of(40, &vec![crash.clone(); 20]).is_over());
        assert!(!conduct_of(41, &vec![crash.clone(); 20]).is_over());
        assert!(conduct_of(5000, &vec![crash; 500]).is_over());
        assert!(conduct_of(1, &[fault(None)]).is_over());
    }
}
