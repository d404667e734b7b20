//! Differences grouped by cause, so that one bug is one entry of a report.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use super::claims::Mode;
use super::judge::Judged;
use super::link::Misbehaviour;
use crate::compare::Divergence;
use crate::request::Request;

/// The largest number of occurrences of a cause that are kept. Without this limit, a port that fails in every case
/// would fill the memory.
const MAX_OCCURRENCES: usize = 1000;

/// A defect of a port, with all its occurrences.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cause {
    /// The broken rule; none if the port broke the protocol.
    pub rule: Option<String>,
    /// The field that differs, without its index, or the misbehaviour.
    pub what: String,
    /// The circumstances that the smallest counterexample needs; empty if it was not shrunk.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub when: String,
    /// Number of occurrences. If `share` is present, the number covers all causes with the same rule and field.
    pub times: u64,
    /// How many of the shrunk occurrences have this cause; present if they have several causes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share: Option<Share>,
    /// Number of occurrences in hand-written cases, by the rule of the case.
    pub cases: BTreeMap<String, u64>,
    /// The smallest occurrence.
    pub example: Example,
    /// The candidates for shrinking: up to [`MAX_OCCURRENCES`] occurrences, including the smallest.
    #[serde(skip)]
    pub(super) occurrences: Vec<Example>,
    /// The file of the smallest counterexample.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kept: Option<PathBuf>,
    /// The command that replays the smallest counterexample.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replay: Option<String>,
    /// Whether a replay showed the cause again; none if nothing was kept or the run was stopped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub is_repeated: Option<bool>,
    /// The reason why it is accepted for now, if it is a known deviation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub known: Option<String>,
}

/// The part of the shrunk occurrences that has one cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Share {
    /// Occurrences with this cause.
    pub alike: usize,
    /// All occurrences that were shrunk.
    pub shrunk: usize,
}

/// One occurrence of a defect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Example {
    /// The case, the line of a recording, or the number of a random episode.
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
        Self {
            rule: example.divergence.as_ref().map(|found| found.rule.clone()),
            what: example.what(),
            when: String::new(),
            times: 0,
            share: None,
            cases: BTreeMap::new(),
            example,
            occurrences: Vec::new(),
            kept: None,
            replay: None,
            is_repeated: None,
            known: None,
        }
    }
}

impl Example {
    /// Returns the differences and misbehaviours of a check as examples.
    pub fn all_of(name: &str, mode: Mode, judged: Judged) -> impl Iterator<Item = Self> + use<> {
        let Judged { request, divergences, fault, .. } = judged;
        let example = Self { name: name.to_owned(), mode, request, divergence: None, fault: None };
        let differing = divergences.into_iter().map({
            let example = example.clone();
            move |found| Self { divergence: Some(found), ..example.clone() }
        });
        differing.chain(fault.map(|fault| Self { fault: Some(fault), ..example }))
    }

    /// Returns the field that differs, without its index, or the misbehaviour.
    pub fn what(&self) -> String {
        match (&self.divergence, &self.fault) {
            (Some(found), _) => found.field.kind(),
            (None, Some(fault)) => fault.kind.to_string(),
            (None, None) => String::new(),
        }
    }

    /// Returns the operation that shows the defect; none if the port did not start.
    pub fn op(&self) -> Option<usize> {
        self.divergence.as_ref().map(|found| found.op).or(self.fault.as_ref().and_then(|fault| fault.op))
    }

    /// Returns whether another occurrence belongs to the same group.
    pub fn is_like(&self, other: &Self) -> bool {
        match ((&self.divergence, &self.fault), (&other.divergence, &other.fault)) {
            ((Some(one), _), (Some(other), _)) => {
                one.rule == other.rule && one.field.kind() == other.field.kind()
            }
            ((None, Some(one)), (None, Some(other))) => one.is_like(other),
            _ => false,
        }
    }

    /// Returns a measure of size; smaller examples are easier to understand.
    pub fn size(&self) -> (usize, usize) {
        let length = self.request.config.to_string().len();
        (self.op().unwrap_or(self.request.ops.len()), length)
    }
}

/// Adds an occurrence to the causes. If present, `case_rule` is the rule of the hand-written case with this occurrence.
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
    let is_smallest = example.size() < cause.example.size();
    if is_smallest {
        cause.example = example.clone();
    }
    if cause.occurrences.len() < MAX_OCCURRENCES {
        cause.occurrences.push(example);
    } else if is_smallest {
        cause.occurrences[0] = example;
    }
}
