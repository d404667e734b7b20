//! What a run shows of a port, rule by rule.

use std::collections::BTreeMap;

use serde::Serialize;

use super::claims::Mode;
use super::group::{self, Cause, Example};
use super::judge::Judged;
use super::plan::Plan;
use super::protocol::Hello;
use crate::compare::Divergence;

/// The row of the table for what breaks no rule but the protocol.
pub const PROTOCOL_ROW: &str = "(protocol)";

/// What a run shows of one port.
#[derive(Clone, Debug, Default, Serialize)]
pub struct PortReport {
    /// Its command line.
    pub command: String,
    /// Who it says it is.
    pub hello: Option<Hello>,
    /// By rule.
    pub rules: BTreeMap<String, Verdicts>,
    /// What is wrong, by cause.
    pub causes: Vec<Cause>,
    /// What was not claimed, and how many cases that left unchecked.
    pub not_claimed: BTreeMap<String, u64>,
    /// Cases that were played.
    pub num_played: u64,
    /// Steps in them.
    pub num_steps: u64,
    /// Cases that were not asked any more after too many misbehaviours.
    pub num_not_run: u64,
}

/// How cases of a rule came out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Verdicts {
    /// As the rule says.
    pub passed: u64,
    /// Otherwise.
    pub failed: u64,
    /// Not played, since the port does not claim it.
    pub not_claimed: u64,
    /// Not answered.
    pub errors: u64,
}

impl PortReport {
    /// Whether the port breaks a rule.
    pub fn diverges(&self) -> bool {
        self.causes.iter().any(|cause| cause.rule.is_some() && cause.known.is_none())
    }

    /// Whether the port broke the protocol.
    pub fn misbehaves(&self) -> bool {
        self.causes.iter().any(|cause| cause.rule.is_none() && cause.known.is_none())
    }

    fn row(&mut self, rule: &str) -> &mut Verdicts {
        self.rules.entry(rule.to_owned()).or_default()
    }
}

/// What an item shows of one port.
pub struct Shown {
    pub subject: usize,
    pub name: String,
    pub case_rule: Option<String>,
    pub num_steps: u64,
    pub judged: Vec<(Mode, Judged)>,
    /// Whether it was not asked any more.
    pub is_cut_off: bool,
    pub hello: Option<Hello>,
}

/// Adds what an item shows.
pub fn take(report: &mut PortReport, shown: Shown, plan: &Plan) {
    report.hello = report.hello.take().or(shown.hello);
    report.num_not_run += u64::from(shown.is_cut_off);
    let is_played = shown.judged.iter().any(|(_, judged)| judged.is_played);
    report.num_played += u64::from(is_played);
    report.num_steps += if is_played { shown.num_steps } else { 0 };
    let mut verdict = Verdicts::default();
    for (mode, judged) in shown.judged {
        for unclaimed in &judged.not_claimed {
            *report.not_claimed.entry(unclaimed.what.clone()).or_default() += 1;
            if shown.case_rule.is_none() {
                report.row(unclaimed.rule).not_claimed += 1;
            }
        }
        take_rows(report, shown.case_rule.as_deref(), &judged, plan);
        let Judged { request, divergences, fault, .. } = judged;
        let example = |divergence, fault| {
            let (name, request) = (shown.name.clone(), request.clone());
            Example { name, mode, request, divergence, fault }
        };
        let case = shown.case_rule.as_deref();
        for found in divergences.into_iter().filter(|found| case.is_some() || is_wanted(plan, &found.rule)) {
            let is_shown = case.filter(|rule| is_about(rule, &found));
            verdict.failed |= u64::from(is_shown.is_some());
            group::add(&mut report.causes, example(Some(found), None), is_shown);
        }
        if fault.is_some() {
            verdict.errors = 1;
            group::add(&mut report.causes, example(None, fault), case);
        }
    }
    if let Some(rule) = shown.case_rule {
        let row = report.row(&rule);
        match verdict {
            Verdicts { errors: 1.., .. } => row.errors += 1,
            Verdicts { failed: 1.., .. } => row.failed += 1,
            _ if is_played => row.passed += 1,
            _ if shown.is_cut_off => {}
            _ => row.not_claimed += 1,
        }
    }
}

fn is_wanted(plan: &Plan, rule: &str) -> bool {
    plan.rules.as_ref().is_none_or(|rules| rules.matches(rule))
}

/// Counts what an item shows of the rules of its comparisons.
fn take_rows(report: &mut PortReport, case_rule: Option<&str>, judged: &Judged, plan: &Plan) {
    for found in judged.divergences.iter().filter(|found| is_wanted(plan, &found.rule)) {
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
        judged.tally.rules.iter().filter(|(rule, count)| count.diverged == 0 && is_wanted(plan, rule))
    {
        report.row(rule).passed += 1;
    }
}

/// Whether a difference says something of the rule of the case that it was seen in: every case is about states, and
/// otherwise about its own family.
fn is_about(case_rule: &str, found: &Divergence) -> bool {
    let family = |rule: &str| match rule.split('/').next().unwrap_or_default() {
        // Seen through the same windows.
        "border" | "occupancy" => "observe".to_owned(),
        other => other.to_owned(),
    };
    let is_of_state =
        ["cell", "goal", "active", "start", "action", "error"].contains(&found.field.kind().as_str());
    // What comes after a step back, or after a draw, shows itself in any field.
    let is_about_all = ["history", "policy", "seed"].contains(&family(case_rule).as_str());
    is_of_state || is_about_all || family(case_rule) == family(&found.rule)
}
