//! Outcomes of rules and ports, and the wording that all output formats share.

use std::collections::BTreeSet;

use pogema_conformance::port::{Cause, PROTOCOL_ROW, PortReport, Share, Verdicts, needed_by};
use pogema_conformance::rules;
use pogema_core::{Error, counted, is_unprintable, shorten, words};
use serde_json::Value;

/// The note on a known deviation that no longer occurs.
pub const STOPPED: &str = "stopped occurring and can be removed from the list";

/// The outcome of a rule for a port, over all its cases.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// All comparisons hold.
    Passed,
    /// A comparison differs because of a cause that is not known.
    Failed,
    /// Comparisons differ or answers are missing, and all causes are known.
    Known,
    /// An answer is missing or invalid because of a cause that is not known.
    Error,
    /// Not played, since the port does not claim the rule.
    NotClaimed,
    /// No outcome, for example in the row of the protocol if the port did not break the protocol.
    Blank,
}

/// Returns the outcome of a rule for a port.
pub fn standing(report: &PortReport, rule: &str) -> Standing {
    let row = report.rules.get(rule).copied().unwrap_or_default();
    let is_new = |is_fault: bool| {
        let mut causes = causes_of(report, rule).filter(|cause| cause.rule.is_none() == is_fault).peekable();
        causes.peek().is_none() || causes.any(|cause| cause.known.is_none())
    };
    match row {
        Verdicts { errors: 1.., .. } if is_new(true) => Standing::Error,
        Verdicts { failed: 1.., .. } if is_new(false) => Standing::Failed,
        Verdicts { errors: 1.., .. } | Verdicts { failed: 1.., .. } => Standing::Known,
        Verdicts { passed: 1.., .. } => Standing::Passed,
        Verdicts { not_claimed: 1.., .. } => Standing::NotClaimed,
        _ => Standing::Blank,
    }
}

/// Returns the causes of the failures and errors of a rule: the causes of this rule, and the causes of other rules that
/// the cases of this rule show.
pub fn causes_of<'a>(report: &'a PortReport, rule: &'a str) -> impl Iterator<Item = &'a Cause> {
    report.causes.iter().filter(move |cause| match &cause.rule {
        Some(broken) => broken == rule || cause.cases.contains_key(rule),
        None => !is_rule(rule) || cause.cases.contains_key(rule),
    })
}

/// The titles of the counts of each rule.
pub const OUTCOMES: [&str; 4] = ["pass", "fail", "not claimed", "error"];

/// Formats how often each outcome of a rule occurred; zero becomes an empty string.
pub fn counts(report: &PortReport, rule: &str) -> [String; 4] {
    let Verdicts { passed, failed, not_claimed, errors } =
        report.rules.get(rule).copied().unwrap_or_default();
    let is_known = standing(report, rule) == Standing::Known;
    let shown = |count: u64, is_bad: bool| match count {
        0 => String::new(),
        count if is_bad && is_known => format!("{count} known"),
        count => count.to_string(),
    };
    [shown(passed, false), shown(failed, true), shown(not_claimed, false), shown(errors, true)]
}

/// Returns whether a row is about a rule, and not about the protocol.
pub fn is_rule(row: &str) -> bool {
    row != PROTOCOL_ROW
}

/// Returns the rows of the table: the rules that were played or that a port does not claim, and the protocol if a port
/// broke it.
pub fn rows(reports: &[PortReport]) -> BTreeSet<&str> {
    reports.iter().flat_map(|report| report.rules.keys()).map(String::as_str).collect()
}

/// Returns the features that at least one port does not claim.
pub fn unclaimed(reports: &[PortReport]) -> BTreeSet<&str> {
    reports.iter().flat_map(|report| report.not_claimed.keys()).map(String::as_str).collect()
}

/// Returns the reason why a rule was not played with a port.
pub fn why_unclaimed(report: &PortReport, rule: &str) -> String {
    if let Some(unclaimed) = report.hello.as_ref().and_then(|hello| needed_by(hello, rule)) {
        return format!("not claimed: {}", unclaimed.what);
    }
    let all: Vec<&str> = report.not_claimed.keys().map(String::as_str).collect();
    format!("not claimed; the port leaves out {}", all.join(", "))
}

/// Returns the name that a port gave itself, or its command line if it gave none.
pub fn name_of(report: &PortReport) -> &str {
    report.hello.as_ref().map_or(&report.command, |hello| &hello.name)
}

/// Returns the names of the ports. Ports with the same name get their versions if these differ, and numbers
/// otherwise.
pub fn names(reports: &[PortReport]) -> Vec<String> {
    let version =
        |report: &PortReport| report.hello.as_ref().map_or(String::new(), |hello| hello.version.clone());
    let versioned = |report: &PortReport| {
        let name = name_of(report);
        let is_other = |other: &&PortReport| name_of(other) == name && version(other) != version(report);
        let differs = reports.iter().any(|other| is_other(&other));
        if differs { format!("{name} {}", version(report)) } else { name.to_owned() }
    };
    let names: Vec<String> = reports.iter().map(versioned).collect();
    let numbered = |(index, name): (usize, &String)| match names[..index]
        .iter()
        .filter(|other| *other == name)
        .count()
    {
        0 => name.clone(),
        count => format!("{name} ({})", count + 1),
    };
    names.iter().enumerate().map(numbered).collect()
}

/// Returns name, version and command line of a port.
pub fn title(report: &PortReport) -> String {
    match &report.hello {
        Some(hello) => format!("{} {} ({})", hello.name, hello.version, report.command),
        None => report.command.clone(),
    }
}

/// Counts of the outcomes and causes of a port.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Score {
    /// Rules that hold.
    pub passed: usize,
    /// Rules that were played.
    pub played: usize,
    /// Known causes.
    pub known: usize,
    /// Causes that break a rule and are not known.
    pub diverging: usize,
    /// Causes that break the protocol and are not known.
    pub misbehaving: usize,
    /// Whether too many faults, known or not, ended the run.
    pub is_cut_short: bool,
    /// Whether the run was interrupted.
    pub is_interrupted: bool,
}

/// Counts the outcomes and causes of a port.
pub fn score(report: &PortReport) -> Score {
    let standings = report.rules.keys().filter(|rule| is_rule(rule)).map(|rule| standing(report, rule));
    let played: Vec<Standing> =
        standings.filter(|standing| !matches!(standing, Standing::NotClaimed | Standing::Blank)).collect();
    let count = |pick: fn(&Cause) -> bool| report.causes.iter().filter(|cause| pick(cause)).count();
    Score {
        passed: played.iter().filter(|standing| **standing == Standing::Passed).count(),
        played: played.len(),
        known: count(|cause| cause.known.is_some()),
        diverging: count(|cause| cause.rule.is_some() && cause.known.is_none()),
        misbehaving: count(|cause| cause.rule.is_none() && cause.known.is_none()),
        is_cut_short: report.num_not_run > 0 && count(|cause| cause.rule.is_none()) > 0,
        is_interrupted: report.num_interrupted > 0,
    }
}

words! {
    /// The verdict on a port; its words are also class names in the style sheet of the page.
    pub enum Verdict {
        /// Everything that the port claims holds.
        Conforms = "conforms",
        /// Everything that the port claims holds, except for known causes.
        Known = "known",
        /// The port breaks a rule.
        Diverges = "diverges",
        /// The port breaks the protocol, and possibly rules.
        Misbehaves = "misbehaves",
        /// Nothing that the port claims was played, or the run was interrupted before a new cause was found.
        Unchecked = "nothing",
    }
}

impl Score {
    /// Returns the verdict that follows from the counts.
    pub fn verdict(self) -> Verdict {
        match self {
            // Known faults do not excuse the cases that were not run because of them.
            Self { misbehaving: 1.., .. } | Self { is_cut_short: true, .. } => Verdict::Misbehaves,
            Self { diverging: 1.., .. } => Verdict::Diverges,
            Self { played: 0, .. } | Self { is_interrupted: true, .. } => Verdict::Unchecked,
            Self { known: 1.., .. } => Verdict::Known,
            _ => Verdict::Conforms,
        }
    }
}

/// Returns the verdict on a port in one line.
pub fn verdict(report: &PortReport) -> String {
    let score = score(report);
    let Score { known, diverging, misbehaving, .. } = score;
    let counted = |number: u64, noun| counted(number as usize, noun);
    let played = format!("{}, {}", counted(report.num_played, "case"), counted(report.num_steps, "step"));
    let causes = |number: usize| counted(number as u64, "cause");
    let exception = if known == 0 { String::new() } else { format!(", except for {known} known") };
    match (diverging, misbehaving) {
        (0, 0) if score.is_cut_short => {
            format!("misbehaves only in known ways, but too often to finish the run: {played}")
        }
        (1.., 0) if score.is_cut_short => {
            let found = causes(diverging);
            format!("diverges, and misbehaves in known ways too often to finish the run: {found} in {played}")
        }
        (0, 0) if score.is_interrupted => format!("interrupted, no new cause so far: {played}"),
        (0, 0) if score.verdict() == Verdict::Unchecked => format!("nothing was checked: {played}"),
        (0, 0) => format!("conforms to all it claims{exception}: {played}"),
        (1.., 0) => format!("diverges: {} in {played}", causes(diverging)),
        (0, _) => format!("misbehaves: {} in {played}", causes(misbehaving)),
        (..) => format!("diverges and misbehaves: {} in {played}", causes(diverging + misbehaving)),
    }
}

/// Formats how often a cause occurred.
pub fn times(cause: &Cause) -> String {
    let times = if cause.times == 1 { "once".into() } else { format!("{} times", cause.times) };
    match cause.share {
        Some(Share { alike, shrunk }) => {
            format!("{times}; {alike} of {shrunk} shrunk examples have this cause")
        }
        None => times,
    }
}

/// The note on a counterexample that a replay did not show again.
pub const NOT_REPEATED: &str =
    "a new process did not reproduce it on the kept case, so the port's answers vary";

/// Returns the names of all rules.
pub fn rule_names() -> impl Iterator<Item = &'static str> {
    rules::all().map(|(name, _)| name)
}

/// Returns the address of a rule in the published spec.
pub fn spec_url(rule: &str) -> Option<String> {
    let (owner, repository) =
        env!("CARGO_PKG_REPOSITORY").strip_prefix("https://github.com/")?.split_once('/')?;
    let chapter = rule.split('/').next().filter(|_| is_rule(rule))?;
    // mdBook turns a heading into an anchor this way.
    let letters = rule.chars().filter(|letter| letter.is_alphanumeric() || "-_".contains(*letter));
    let anchor = if rule == chapter { String::new() } else { format!("#{}", letters.collect::<String>()) };
    Some(format!("https://{owner}.github.io/{repository}/spec/{chapter}.html{anchor}"))
}

/// Shortens a long value to a readable length.
pub fn shortened(text: &str) -> String {
    shorten(text, 200)
}

/// Removes control characters except newlines and tabs, and text direction marks, since ports may send anything.
pub fn printable(text: &str) -> String {
    text.chars().filter(|letter| !is_unprintable(*letter) || "\n\t".contains(*letter)).collect()
}

/// Fills in an HTML or SVG template. Values are escaped unless the template marks them with `safe`.
pub fn fill(template: &str, values: Value) -> Result<String, Error> {
    Ok(printable(&pogema_render::html::fill(template, values)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_are_linked_as_the_spec_links_them() {
        let index = include_str!("../../../docs/spec/index.md");
        let links =
            index.lines().filter_map(|line| line.strip_prefix("| [")?.split(')').next()?.split_once("]("));
        let mut count = 0;
        for (rule, place) in links {
            let page = place.replace(".md#", ".html#");
            assert_eq!(spec_url(rule), Some(format!("https://pogema-rs.github.io/pogema-rs/spec/{page}")));
            count += 1;
        }
        assert!(count > 50, "found only {count} links");
        assert_eq!(spec_url(PROTOCOL_ROW), None);
    }
}
