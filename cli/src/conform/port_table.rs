//! The report on ports as text for the terminal.

use std::fmt::Write as _;

use pogema_conformance::panel::{Limits, text_of_panels};
use pogema_conformance::port::{Cause, PROTOCOL_RULE, PortReport};
use pogema_conformance::rules;
use pogema_toolbox::fitted;

use super::known::Leftover;
use super::summary::{
    self, NOT_REPEATED, OUTCOMES, STOPPED, counts, names, printable, shortened, spec_url, times, title,
    verdict,
};
use crate::output::lined_table;

/// Limits of text pictures, so that they fit on a screen.
const LIMITS: Limits = Limits { rows: 12, columns: 120 };

/// Formats the reports: tables that compare all ports, then the causes and the verdict of each port.
pub fn report_text(reports: &[PortReport], leftover: &Leftover) -> String {
    let mut text = String::new();
    if let [report] = reports {
        let _ = writeln!(text, "{}\n", title(report));
    }
    let _ = writeln!(text, "{}\n", rule_table(reports));
    let unclaimed = unclaimed(reports);
    let _ = write!(text, "{unclaimed}{}", if unclaimed.is_empty() { "" } else { "\n\n" });
    for (report, name) in reports.iter().zip(names(reports)) {
        if reports.len() > 1 {
            let _ = writeln!(text, "=== {name}: {}\n", title(report));
        }
        text.push_str(&port_text(report));
    }
    let stopped = leftover.stopped.iter().map(|known| format!("STOPPED {known}\n  it {STOPPED}\n"));
    let not_played = leftover.not_played.iter().map(|known| format!("not played: {known}\n"));
    stopped.chain(not_played).for_each(|line| text.push_str(&line));
    printable(text.trim_end())
}

/// Returns the table of rules with columns for each port. If there are several ports, leaves out empty columns, except
/// the first of each port.
fn rule_table(reports: &[PortReport]) -> String {
    let rows = summary::rows(reports);
    let holds = |report: &PortReport, at: usize| rows.iter().any(|rule| !counts(report, rule)[at].is_empty());
    let is_shown = |report: &PortReport, at: usize| reports.len() == 1 || at == 0 || holds(report, at);
    let columns: Vec<(usize, usize)> = (0..reports.len())
        .flat_map(|port| (0..OUTCOMES.len()).map(move |at| (port, at)))
        .filter(|&(port, at)| is_shown(&reports[port], at))
        .collect();
    let names = names(reports);
    let title = |&(port, at): &(usize, usize)| match (reports.len(), at) {
        (1, _) => OUTCOMES[at].to_owned(),
        (_, 0) => format!("{}\n{}", names[port], OUTCOMES[at]),
        _ => format!("\n{}", OUTCOMES[at]),
    };
    let titles: Vec<String> = std::iter::once("rule".to_owned()).chain(columns.iter().map(title)).collect();
    let mut table = lined_table(&titles.iter().map(String::as_str).collect::<Vec<_>>());
    for rule in rows {
        let counts: Vec<[String; 4]> = reports.iter().map(|report| counts(report, rule)).collect();
        let cells = columns.iter().map(|&(port, at)| counts[port][at].clone());
        table.add_row(std::iter::once(rule.to_owned()).chain(cells));
    }
    fitted(table)
}

fn unclaimed(reports: &[PortReport]) -> String {
    let all = summary::unclaimed(reports);
    if all.is_empty() {
        return String::new();
    }
    let names = names(reports);
    let mut titles = vec!["not claimed"];
    match reports.len() {
        1 => titles.push("cases left unchecked"),
        _ => titles.extend(names.iter().map(String::as_str)),
    }
    let mut table = lined_table(&titles);
    for what in all {
        let counts =
            reports.iter().map(|report| report.not_claimed.get(what).map_or(String::new(), u64::to_string));
        table.add_row(std::iter::once(what.to_owned()).chain(counts));
    }
    fitted(table)
}

fn port_text(report: &PortReport) -> String {
    let mut text = String::new();
    let (known, new): (Vec<&Cause>, Vec<&Cause>) =
        report.causes.iter().partition(|cause| cause.known.is_some());
    for cause in new {
        let _ = writeln!(text, "{}", cause_text(cause));
    }
    for cause in known {
        let (rule, reason) =
            (cause.rule.as_deref().unwrap_or(PROTOCOL_RULE), cause.known.as_deref().unwrap_or_default());
        let _ = writeln!(text, "KNOWN {rule}: {}, {}\n  {reason}", cause.what, times(cause));
        text.push_str(&replay_text(cause));
        text.push('\n');
    }
    if report.num_not_run > 0 {
        let _ = writeln!(text, "cases not run: {}\n", report.num_not_run);
    }
    if report.num_interrupted > 0 {
        let _ = writeln!(text, "interrupted; cases not reached: {}\n", report.num_interrupted);
    }
    let _ = writeln!(text, "{}\n", verdict(report));
    text
}

/// Formats a cause with its smallest example.
pub fn cause_text(cause: &Cause) -> String {
    let mut text = match &cause.rule {
        Some(rule) => format!("FAIL {rule}: {} differs, {}\n", cause.what, times(cause)),
        None => format!("ERROR {}, {}\n", cause.what, times(cause)),
    };
    if let Some(rule) = &cause.rule {
        let _ = writeln!(text, "  rule: {}", rules::statement_of(rule).unwrap_or_default());
        let _ = writeln!(text, "  read on: {}", spec_url(rule).unwrap_or_default());
    }
    if !cause.cases.is_empty() {
        let rules: Vec<&str> = cause.cases.keys().map(String::as_str).collect();
        let _ = writeln!(text, "  shown by the cases of {}", rules.join(", "));
    }
    if cause.example.op().is_some() {
        let _ = writeln!(text, "  smallest: {}", cause.example.name);
    }
    if !cause.when.is_empty() {
        let _ = writeln!(text, "  when: {}", cause.when);
    }
    if let Some(found) = &cause.example.divergence {
        let _ = writeln!(text, "  operation {}: {}", found.op, found.field);
        let (expected, got) = (shortened(&found.expected), shortened(&found.got));
        let _ = write!(
            text,
            "  expected {expected}\n  got      {got}\n{}",
            text_of_panels(&found.picture, LIMITS)
        );
    }
    if let Some(fault) = &cause.example.fault {
        let op = fault.op.map_or(String::new(), |op| format!("operation {op}: "));
        let details = format!("{op}{fault}");
        if details != cause.what {
            let _ = writeln!(text, "  {details}");
        }
    }
    text + &replay_text(cause)
}

fn replay_text(cause: &Cause) -> String {
    let Some(replay) = &cause.replay else { return String::new() };
    let note = match cause.is_repeated {
        Some(false) => format!("  not shown again: {NOT_REPEATED}\n"),
        _ => String::new(),
    };
    format!("{note}  play it again: {replay}\n")
}
