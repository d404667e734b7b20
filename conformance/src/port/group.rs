//! Differences grouped by cause, so that one bug is one entry of a report.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use super::claims::Mode;
use super::link::Misbehaviour;
use crate::compare::Divergence;
use crate::request::Request;

/// A defect of a port, with all its occurrences.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cause {
    /// The broken rule; none if the port broke the protocol.
    pub rule: Option<String>,
    /// The field that differs, without its index, or the misbehaviour.
    pub what: String,
    /// Number of occurrences.
    pub times: u64,
    /// Number of hand-written cases that show it, by rule.
    pub cases: BTreeMap<String, u64>,
    /// The smallest occurrence.
    pub example: Example,
    /// The file of the smallest counterexample.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kept: Option<PathBuf>,
    /// The command that replays it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replay: Option<String>,
    /// The reason why it is accepted for now, if it is a known deviation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub known: Option<String>,
}

/// One occurrence of a defect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Example {
    /// The case, the line of a recording, or the number of a drawn case.
    pub name: String,
    /// Whether the port received an instance or a config.
    pub mode: Mode,
    /// The request that was played.
    pub request: Request,
    /// The difference.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub divergence: Option<Divergence>,
    /// The misbehaviour of the port.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<Misbehaviour>,
}

impl Cause {
    fn of(example: Example) -> Self {
        let (rule, what) = example.key();
        Self { rule, what, times: 0, cases: BTreeMap::new(), example, kept: None, replay: None, known: None }
    }
}

impl Example {
    fn key(&self) -> (Option<String>, String) {
        match (&self.divergence, &self.fault) {
            (Some(found), _) => (Some(found.rule.clone()), found.field.kind()),
            (None, Some(fault)) => (None, kind_of_fault(&fault.what)),
            (None, None) => (None, String::new()),
        }
    }

    /// Returns whether another occurrence has the same cause.
    pub fn is_like(&self, other: &Self) -> bool {
        self.key() == other.key()
    }

    /// Returns a measure of size; smaller examples are easier to understand.
    fn size(&self) -> (usize, usize) {
        let written = |value: &serde_json::Value| value.to_string().len();
        (
            self.divergence.as_ref().map_or(self.request.ops.len(), |found| found.op),
            written(&self.request.config),
        )
    }
}

/// Returns the description of a misbehaviour without numbers and quoted answers.
fn kind_of_fault(what: &str) -> String {
    let head = what.split(": `").next().unwrap_or(what);
    let words = head.split_whitespace().filter(|word| !word.contains(|letter: char| letter.is_ascii_digit()));
    words.collect::<Vec<_>>().join(" ").replace(" (exit status:", "").replace(" (signal:", "")
}

/// Adds an occurrence to the causes. `case_rule` is the rule of the hand-written case, if it is one.
pub fn add(causes: &mut Vec<Cause>, example: Example, case_rule: Option<&str>) {
    let known = causes.iter().position(|known| known.example.is_like(&example));
    let at = known.unwrap_or(causes.len());
    if known.is_none() {
        causes.push(Cause::of(example.clone()));
    }
    let cause = &mut causes[at];
    cause.times += 1;
    if let Some(rule) = case_rule {
        *cause.cases.entry(rule.to_owned()).or_default() += 1;
    }
    if example.size() < cause.example.size() {
        cause.example = example;
    }
}
