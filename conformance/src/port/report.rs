//! Results of a run for a port, rule by rule.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::claims::Mode;
use super::group::{self, Cause, Example};
use super::judge::Judged;
use super::plan::Plan;
use super::protocol::Hello;
use crate::compare::Divergence;
use crate::rules::statement_of;

/// The name of the table row for violations of the protocol.
pub const PROTOCOL_ROW: &str = "(protocol)";

const FORETOLD: &str = "goal/restart/foretold";

/// The results of a run for one port.
#[derive(Clone, Debug, Default, Serialize)]
pub struct PortReport {
    /// The command line of the port.
    pub command: String,
    /// The name and claims of the port.
    pub hello: Option<Hello>,
    /// The verdicts by rule.
    pub rules: BTreeMap<String, Verdicts>,
    /// The defects, grouped by cause.
    pub causes: Vec<Cause>,
    /// The features that were not claimed, with the number of cases left unchecked.
    pub not_claimed: BTreeMap<String, u64>,
    /// Number of cases played.
    pub num_played: u64,
    /// Number of steps in the cases played.
    pub num_steps: u64,
    /// Number of cases skipped after too many misbehaviours.
    pub num_not_run: u64,
    /// Number of cases that the run did not reach before it was interrupted.
    pub num_interrupted: u64,
}

/// Numbers of cases of a rule by verdict.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Verdicts {
    /// Cases in which the port follows the rule.
    pub passed: u64,
    /// Cases in which the port breaks the rule.
    pub failed: u64,
    /// Cases that did not check the rule, because the port does not claim it or does not show the values that the rule
    /// is about.
    pub not_claimed: u64,
    /// Cases in which the port broke the protocol.
    pub errors: u64,
}

impl PortReport {
    /// Returns whether the port breaks a rule, known deviations aside.
    pub fn diverges(&self) -> bool {
        self.causes.iter().any(|cause| cause.rule.is_some() && cause.known.is_none())
    }

    /// Returns whether the port breaks the protocol, known deviations aside.
    pub fn misbehaves(&self) -> bool {
        self.causes.iter().any(|cause| cause.rule.is_none() && cause.known.is_none())
    }

    fn row(&mut self, rule: &str) -> &mut Verdicts {
        self.rules.entry(rule.to_owned()).or_default()
    }
}

/// The result of an item for one port.
pub struct ItemResult {
    pub subject: usize,
    pub name: String,
    pub case_rule: Option<String>,
    pub num_steps: u64,
    pub judged: Vec<(Mode, Judged)>,
    /// Whether the item was skipped after too many misbehaviours.
    pub is_cut_off: bool,
    pub hello: Option<Hello>,
}

/// Adds the result of an item to a report.
pub fn add_result(report: &mut PortReport, mut result: ItemResult, plan: &Plan) {
    if result.hello.is_none() && !result.is_cut_off {
        // The port did not start, which says nothing about the rule of the case.
        result.case_rule = None;
    }
    report.hello = report.hello.take().or(result.hello);
    report.num_not_run += u64::from(result.is_cut_off);
    let is_played = result.judged.iter().any(|(_, judged)| judged.is_played);
    let is_compared = result.case_rule.as_deref().is_none_or(|rule| is_compared(rule, &result.judged));
    let is_left_out = !is_played
        && result
            .judged
            .iter()
            .flat_map(|(_, judged)| &judged.not_claimed)
            .any(|what| plan.leaves_out(&what.what));
    report.num_played += u64::from(is_played);
    report.num_steps += if is_played { result.num_steps } else { 0 };
    // A case that was played in two modes counts once.
    let not_claimed = result.judged.iter().flat_map(|(_, judged)| &judged.not_claimed);
    let not_claimed: BTreeSet<_> = not_claimed.map(|unclaimed| (&unclaimed.what, unclaimed.rule)).collect();
    for (what, rule) in not_claimed.into_iter().filter(|(what, _)| !plan.leaves_out(what)) {
        *report.not_claimed.entry(what.clone()).or_default() += 1;
        // A prefix of several rules gets no row.
        if result.case_rule.is_none() && statement_of(rule).is_some() {
            report.row(rule).not_claimed += 1;
        }
    }
    let mut verdict = Verdicts::default();
    for (mode, judged) in result.judged {
        count_verdicts(report, result.case_rule.as_deref(), &judged, plan);
        let case = result.case_rule.as_deref();
        for example in Example::all_of(&result.name, mode, judged) {
            let Some(found) = &example.divergence else {
                verdict.errors = 1;
                group::add(&mut report.causes, example, case);
                continue;
            };
            if case.is_some() || is_selected(plan, &found.rule) {
                let case_rule = case.filter(|rule| is_about(rule, found));
                verdict.failed |= u64::from(case_rule.is_some());
                group::add(&mut report.causes, example, case_rule);
            }
        }
    }
    // A rule has no row if all its cases were skipped, or if its profile was not selected.
    let is_skipped = result.is_cut_off || is_left_out;
    let has_verdict = !is_skipped || verdict != Verdicts::default();
    if let Some(rule) = result.case_rule.filter(|_| has_verdict) {
        let row = report.row(&rule);
        match verdict {
            Verdicts { errors: 1.., .. } => row.errors += 1,
            Verdicts { failed: 1.., .. } => row.failed += 1,
            _ if is_played && is_compared => row.passed += 1,
            _ => row.not_claimed += 1,
        }
    }
}

/// Returns whether a case compared what its rule is about.
///
/// If the port does not claim what the rule is about, the result is false, even if something else differs. If the rule
/// is about foretold goals and the port foretells none, the result is false, too.
fn is_compared(rule: &str, judged: &[(Mode, Judged)]) -> bool {
    judged.iter().any(|(_, judged)| {
        let is_claimed = !judged.not_claimed.iter().any(|unclaimed| unclaimed.covers(rule));
        is_claimed && (rule != FORETOLD || judged.tally.rules.contains_key(FORETOLD))
    })
}

fn is_selected(plan: &Plan, rule: &str) -> bool {
    plan.rules.as_ref().is_none_or(|rules| rules.matches(rule))
}

/// Counts the verdicts of an item for the rules of its comparisons.
fn count_verdicts(report: &mut PortReport, case_rule: Option<&str>, judged: &Judged, plan: &Plan) {
    for found in judged.divergences.iter().filter(|found| is_selected(plan, &found.rule)) {
        // A case counts for its own rule, once.
        if case_rule.is_none_or(|rule| !is_about(rule, found)) {
            report.row(&found.rule).failed += 1;
        }
    }
    if case_rule.is_some() {
        return;
    }
    if judged.fault.is_some() {
        report.row(PROTOCOL_ROW).errors += 1;
    }
    for (rule, _) in
        judged.tally.rules.iter().filter(|(rule, count)| count.diverged == 0 && is_selected(plan, rule))
    {
        report.row(rule).passed += 1;
    }
}

/// Returns whether a difference counts against the rule of the case.
///
/// A difference in the state always counts, and so does every difference in a case about history, policies or seeds.
/// Any other difference counts only if its rule is in the same family.
fn is_about(case_rule: &str, found: &Divergence) -> bool {
    let family = |rule: &str| match rule.split('/').next().unwrap_or_default() {
        // The same windows show all three.
        "border" | "occupancy" => "observe".to_owned(),
        other => other.to_owned(),
    };
    let is_state = ["map", "start", "cell", "goal", "active", "action", "error"].contains(&found.field.name);
    // A wrong step back or draw can show in any field.
    let covers_all = ["history", "policy", "seed"].contains(&family(case_rule).as_str());
    is_state || covers_all || family(case_rule) == family(&found.rule)
}
