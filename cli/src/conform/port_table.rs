//! What a run shows of a port, for the terminal.

use std::fmt::Write as _;

use pogema_conformance::port::{Cause, PortReport};

use super::table;

/// The report as tables and words.
pub fn tell(report: &PortReport) -> String {
    let mut text = format!("{}\n\n", title(report));
    let mut rules = table(&["rule", "pass", "fail", "not claimed", "error"]);
    for (rule, row) in &report.rules {
        let counts = [row.passed, row.failed, row.not_claimed, row.errors].map(|count| match count {
            0 => String::new(),
            count => count.to_string(),
        });
        rules.add_row(std::iter::once(rule.clone()).chain(counts));
    }
    let _ = writeln!(text, "{rules}\n");
    if !report.not_claimed.is_empty() {
        let mut unclaimed = table(&["not claimed", "cases left unchecked"]);
        for (what, count) in &report.not_claimed {
            unclaimed.add_row([what.clone(), count.to_string()]);
        }
        let _ = writeln!(text, "{unclaimed}\n");
    }
    for cause in &report.causes {
        let _ = writeln!(text, "{}", tell_cause(cause));
    }
    if report.num_not_run > 0 {
        let _ = writeln!(text, "{} cases were not asked after that\n", report.num_not_run);
    }
    text.push_str(&verdict(report));
    text
}

/// Who the port is.
pub fn title(report: &PortReport) -> String {
    match &report.hello {
        Some(hello) => format!("{} {} ({})", hello.name, hello.version, report.command),
        None => report.command.clone(),
    }
}

fn tell_cause(cause: &Cause) -> String {
    let mut text = String::new();
    let times = if cause.times == 1 { "once".into() } else { format!("{} times", cause.times) };
    match &cause.rule {
        Some(rule) => {
            let _ = writeln!(text, "FAIL {rule}: {} differs, {times}", cause.what);
        }
        None => {
            let _ = writeln!(text, "ERROR {}, {times}", cause.what);
        }
    }
    if !cause.cases.is_empty() {
        let rules: Vec<&str> = cause.cases.keys().map(String::as_str).collect();
        let _ = writeln!(text, "  shown by the cases of {}", rules.join(", "));
    }
    let _ = writeln!(text, "  smallest: {}", cause.example.name);
    if let Some(found) = &cause.example.divergence {
        let _ = writeln!(text, "  operation {}: {}", found.op, found.field);
        let _ = write!(text, "  expected {}\n  got      {}\n{}", found.expected, found.got, found.picture);
    }
    if let Some(fault) = &cause.example.fault {
        let _ = writeln!(text, "  {fault}");
    }
    if let Some(replay) = &cause.replay {
        let _ = writeln!(text, "  play it again: {replay}");
    }
    text
}

/// One line that says it all.
pub fn verdict(report: &PortReport) -> String {
    let sum = |pick: fn(&Cause) -> bool| report.causes.iter().filter(|cause| pick(cause)).count();
    let diverging = sum(|cause| cause.rule.is_some() && cause.known.is_none());
    let misbehaving = sum(|cause| cause.rule.is_none() && cause.known.is_none());
    let played = format!("{} cases, {} steps", report.num_played, report.num_steps);
    match (diverging, misbehaving) {
        (0, 0) => format!("conforms to all it claims: {played}"),
        (1.., 0) => format!("diverges: {diverging} causes in {played}"),
        (0, _) => format!("misbehaves: {misbehaving} causes in {played}"),
        (..) => format!("diverges and misbehaves: {} causes in {played}", diverging + misbehaving),
    }
}
