//! What a run shows of each rule and of each port, in the words that all forms of the report share.

use std::collections::BTreeSet;

use pogema_conformance::port::{Cause, PROTOCOL_ROW, PortReport, Verdicts, needed_by};
use pogema_core::{Error, shorten, words};
use serde_json::Value;

/// How a rule came out for a port, all its cases together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// As the spec says, wherever it was asked.
    Passed,
    /// Otherwise, and nobody knew.
    Failed,
    /// Otherwise or without an answer, and all of it known.
    Known,
    /// Without an answer.
    Error,
    /// Not asked, since the port does not claim it.
    NotClaimed,
    /// Nothing happened, as in the row of the protocol in a good run.
    Blank,
}

/// How a rule came out for a port.
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

/// What the failures and errors of a rule come from: its own causes, and those that its cases show.
pub fn causes_of<'a>(report: &'a PortReport, rule: &'a str) -> impl Iterator<Item = &'a Cause> {
    report.causes.iter().filter(move |cause| match &cause.rule {
        Some(broken) => broken == rule || cause.cases.contains_key(rule),
        None => !is_rule(rule) || cause.cases.contains_key(rule),
    })
}

/// What is counted of each rule.
pub const OUTCOMES: [&str; 4] = ["pass", "fail", "not claimed", "error"];

/// How often each outcome of a rule came, in words: nothing for never.
pub fn counts(report: &PortReport, rule: &str) -> [String; 4] {
    let Verdicts { passed, failed, not_claimed, errors } =
        report.rules.get(rule).copied().unwrap_or_default();
    let is_known = standing(report, rule) == Standing::Known;
    let told = |count: u64, is_bad: bool| match count {
        0 => String::new(),
        count if is_bad && is_known => format!("{count} known"),
        count => count.to_string(),
    };
    [told(passed, false), told(failed, true), told(not_claimed, false), told(errors, true)]
}

/// Whether a row is about a rule, and not about the protocol.
pub fn is_rule(row: &str) -> bool {
    row != PROTOCOL_ROW
}

/// Every rule that any of the ports was asked for or did not claim.
pub fn rows(reports: &[PortReport]) -> BTreeSet<&str> {
    reports.iter().flat_map(|report| report.rules.keys()).map(String::as_str).collect()
}

/// Everything that any of the ports did not claim.
pub fn unclaimed(reports: &[PortReport]) -> BTreeSet<&str> {
    reports.iter().flat_map(|report| report.not_claimed.keys()).map(String::as_str).collect()
}

/// Why a rule was not asked of a port.
pub fn why_unclaimed(report: &PortReport, rule: &str) -> String {
    if let Some(unclaimed) = report.hello.as_ref().and_then(|hello| needed_by(hello, rule)) {
        return format!("not claimed: {}", unclaimed.what);
    }
    let all: Vec<&str> = report.not_claimed.keys().map(String::as_str).collect();
    format!("not claimed; the port leaves out {}", all.join(", "))
}

/// What a port is called: the name that it gave, or its command line if it gave none.
pub fn name_of(report: &PortReport) -> &str {
    report.hello.as_ref().map_or(&report.command, |hello| &hello.name)
}

/// What the ports are called, with a number where a name comes again.
pub fn names(reports: &[PortReport]) -> Vec<String> {
    let earlier =
        |until: usize, name: &str| reports[..until].iter().filter(|report| name_of(report) == name).count();
    let numbered = reports.iter().enumerate().map(|(index, report)| match earlier(index, name_of(report)) {
        0 => name_of(report).to_owned(),
        count => format!("{} ({})", name_of(report), count + 1),
    });
    numbered.collect()
}

/// Who the port is.
pub fn title(report: &PortReport) -> String {
    match &report.hello {
        Some(hello) => format!("{} {} ({})", hello.name, hello.version, report.command),
        None => report.command.clone(),
    }
}

/// How many rules of a port came out how.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Score {
    /// Those that hold.
    pub passed: usize,
    /// Those that were asked at all.
    pub claimed: usize,
    /// Causes that are known.
    pub known: usize,
    /// Rules broken that nobody knew of.
    pub diverging: usize,
    /// Faults that nobody knew of.
    pub misbehaving: usize,
    /// Whether too many faults, known or not, ended the run.
    pub is_cut_short: bool,
}

/// How many rules of a port came out how.
pub fn score(report: &PortReport) -> Score {
    let standings = report.rules.keys().filter(|rule| is_rule(rule)).map(|rule| standing(report, rule));
    let asked: Vec<Standing> =
        standings.filter(|standing| !matches!(standing, Standing::NotClaimed | Standing::Blank)).collect();
    let count = |pick: fn(&Cause) -> bool| report.causes.iter().filter(|cause| pick(cause)).count();
    Score {
        passed: asked.iter().filter(|standing| **standing == Standing::Passed).count(),
        claimed: asked.len(),
        known: count(|cause| cause.known.is_some()),
        diverging: count(|cause| cause.rule.is_some() && cause.known.is_none()),
        misbehaving: count(|cause| cause.rule.is_none() && cause.known.is_none()),
        is_cut_short: report.num_not_run > 0 && count(|cause| cause.rule.is_none()) > 0,
    }
}

words! {
    /// What a run says of a port, in short; the style sheet of the page knows the words.
    pub enum Verdict {
        /// It does all that it claims.
        Conforms = "conforms",
        /// It does, but for what is known.
        Known = "known",
        /// It breaks a rule.
        Diverges = "diverges",
        /// It breaks the protocol, and perhaps rules.
        Misbehaves = "misbehaves",
        /// It claims nothing that was asked.
        Unchecked = "nothing",
    }
}

impl Score {
    /// What it comes to.
    pub fn verdict(self) -> Verdict {
        match self {
            // What is known of a port does not excuse the cases that it was not asked for that reason.
            Self { misbehaving: 1.., .. } | Self { is_cut_short: true, .. } => Verdict::Misbehaves,
            Self { diverging: 1.., .. } => Verdict::Diverges,
            Self { claimed: 0, .. } => Verdict::Unchecked,
            Self { known: 1.., .. } => Verdict::Known,
            _ => Verdict::Conforms,
        }
    }
}

/// One line that says it all.
pub fn verdict(report: &PortReport) -> String {
    let score = score(report);
    let Score { known, diverging, misbehaving, .. } = score;
    let played = format!("{} cases, {} steps", report.num_played, report.num_steps);
    let causes = |number: usize| format!("{number} cause{}", if number == 1 { "" } else { "s" });
    let but = if known == 0 { String::new() } else { format!(", but for {known} known") };
    match (diverging, misbehaving) {
        (0, 0) if score.is_cut_short => {
            format!("misbehaves as is known, too often to be asked everything: {played}")
        }
        (0, 0) if score.verdict() == Verdict::Unchecked => format!("nothing was checked: {played}"),
        (0, 0) => format!("conforms to all it claims{but}: {played}"),
        (1.., 0) => format!("diverges: {} in {played}", causes(diverging)),
        (0, _) => format!("misbehaves: {} in {played}", causes(misbehaving)),
        (..) => format!("diverges and misbehaves: {} in {played}", causes(diverging + misbehaving)),
    }
}

/// How often something was seen.
pub fn times(cause: &Cause) -> String {
    if cause.times == 1 { "once".into() } else { format!("{} times", cause.times) }
}

/// A rule's place in the published spec.
pub fn spec_url(rule: &str) -> Option<String> {
    let (owner, repository) =
        env!("CARGO_PKG_REPOSITORY").strip_prefix("https://github.com/")?.split_once('/')?;
    let chapter = rule.split('/').next().filter(|_| is_rule(rule))?;
    // As mdBook makes an anchor of a heading.
    let letters = rule.chars().filter(|letter| letter.is_alphanumeric() || "-_".contains(*letter));
    let anchor = if rule == chapter { String::new() } else { format!("#{}", letters.collect::<String>()) };
    Some(format!("https://{owner}.github.io/{repository}/spec/{chapter}.html{anchor}"))
}

/// A long value as far as it helps a reader.
pub fn shortened(text: &str) -> String {
    shorten(text, 200)
}

/// A text without what only terminals understand, since ports may say anything.
pub fn printable(text: &str) -> String {
    text.chars().filter(|letter| !letter.is_control() || "\n\t".contains(*letter)).collect()
}

/// Fills in a template of HTML or SVG, in which everything is escaped.
pub fn fill(template: &str, holes: Value) -> Result<String, Error> {
    Ok(printable(&pogema_render::html::fill(template, holes)?))
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
        assert!(count > 50, "{count} links were found");
        assert_eq!(spec_url(PROTOCOL_ROW), None);
    }
}
