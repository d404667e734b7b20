//! Deviations that somebody knows of and bears for now: which they are, and which of them still occur.

use std::collections::BTreeSet;
use std::path::Path;

use jiff::civil::Date;
use pogema_conformance::port::{Cause, Plan, PortReport};
use pogema_conformance::{cases, golden};
use pogema_core::Error;
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use super::summary::name_of;

/// What stands in the place of a rule for what breaks the protocol.
const PROTOCOL: &str = "protocol";

/// The known deviations of a file.
#[derive(Debug, Default)]
pub struct Known {
    deviations: Vec<Deviation>,
}

/// One known deviation, named as the report names causes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, expecting = "fields and values such as `rule: collide/soft`")]
struct Deviation {
    /// None for the protocol.
    #[serde(default)]
    rule: Option<String>,
    what: String,
    #[serde(deserialize_with = "text")]
    since: String,
    reason: String,
    /// The port that deviates; any, if none is named.
    #[serde(default)]
    port: Option<String>,
}

/// A number too as a text, to be refused as no date.
fn text<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    let value = Value::deserialize(deserializer)?;
    Ok(value.as_str().map_or_else(|| value.to_string(), str::to_owned))
}

/// Deviations that a run did not show, in words.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Leftover {
    /// Their rules were played.
    pub stopped: Vec<String>,
    /// Nothing can be said of them.
    pub not_played: Vec<String>,
}

impl Known {
    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::Io`] with the entry that is wrong.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let failed = |reason: String| {
            let line = reason.lines().next().unwrap_or("unreadable");
            Error::io(path, line.strip_prefix("error: ").unwrap_or(line))
        };
        let text = std::fs::read_to_string(path).map_err(|error| failed(error.to_string()))?;
        let entries = match serde_saphyr::from_str(&text).map_err(|error| failed(error.to_string()))? {
            Value::Array(entries) => entries,
            Value::Null => Vec::new(),
            _ => return Err(failed("expected a list of entries".into())),
        };
        let rules = rules()?;
        let mut deviations: Vec<Deviation> = Vec::new();
        for (index, entry) in entries.into_iter().enumerate() {
            let failed = |reason: String| failed(format!("entry {}: {reason}", index + 1));
            let deviation = Deviation::new(entry, &rules).map_err(failed)?;
            if let Some(at) = deviations.iter().position(|earlier| earlier.key() == deviation.key()) {
                return Err(failed(format!("says the same as entry {}", at + 1)));
            }
            deviations.push(deviation);
        }
        Ok(Self { deviations })
    }

    /// Marks the causes that are known.
    pub fn mark(&self, reports: &mut [PortReport]) {
        for report in reports {
            let port = name_of(report).to_owned();
            for cause in &mut report.causes {
                let deviation =
                    self.deviations.iter().find(|known| known.is_of(&port) && known.explains(cause));
                cause.known = deviation.map(|known| format!("since {}: {}", known.since, known.reason));
            }
        }
    }

    /// The deviations that did not occur.
    pub fn leftover(&self, reports: &[PortReport], plan: &Plan) -> Leftover {
        let mut leftover = Leftover::default();
        for known in &self.deviations {
            let mut ports = reports.iter().filter(|report| known.is_of(name_of(report)));
            if ports.clone().any(|report| report.causes.iter().any(|cause| known.explains(cause))) {
                continue;
            }
            let was_played = ports.any(|report| known.was_played(report, plan));
            if was_played { &mut leftover.stopped } else { &mut leftover.not_played }.push(known.title());
        }
        leftover
    }
}

/// The rules that there are: each has a case.
fn rules() -> Result<BTreeSet<String>, Error> {
    let paths = golden::files(&cases::folder(), ".yaml")?;
    paths.iter().map(|path| cases::read(path).map(|case| case.rule)).collect()
}

impl Deviation {
    fn new(entry: Value, rules: &BTreeSet<String>) -> Result<Self, String> {
        let mut deviation: Self = serde_json::from_value(entry).map_err(|error| error.to_string())?;
        deviation.rule.take_if(|rule| rule == PROTOCOL);
        if let Some(rule) = deviation.rule.as_ref().filter(|rule| !rules.contains(*rule)) {
            let likeness = |known: &&String| (strsim::jaro_winkler(known, rule) * 1e6) as u64;
            let nearest = rules.iter().max_by_key(likeness).map_or(PROTOCOL, String::as_str);
            return Err(format!("unknown rule `{rule}`, the nearest known one is `{nearest}`"));
        }
        // One way to write a date, so that lists can be sorted and searched by it.
        let is_date = deviation.since.parse::<Date>().is_ok_and(|date| date.to_string() == deviation.since);
        if !is_date {
            return Err(format!("`since` is `{}`, expected a date such as 2026-11-22", deviation.since));
        }
        for (name, text) in [("what", &mut deviation.what), ("reason", &mut deviation.reason)] {
            // A line each, however it was folded.
            *text = text.split_whitespace().collect::<Vec<_>>().join(" ");
            if text.is_empty() {
                return Err(format!("`{name}` is empty"));
            }
        }
        Ok(deviation)
    }

    fn key(&self) -> (&Option<String>, &str, &Option<String>) {
        (&self.rule, &self.what, &self.port)
    }

    fn is_of(&self, port: &str) -> bool {
        self.port.as_ref().is_none_or(|name| name == port)
    }

    fn explains(&self, cause: &Cause) -> bool {
        (&self.rule, &self.what) == (&cause.rule, &cause.what)
    }

    /// Whether the deviation would have shown itself if it were still there: not in single cases, nor in a run that
    /// was cut short, nor where its rule was left out or is not claimed.
    fn was_played(&self, report: &PortReport, plan: &Plan) -> bool {
        let is_whole = plan.files.is_empty() && plan.parts.is_empty() && report.num_not_run == 0;
        is_whole
            && match &self.rule {
                Some(rule) => report.rules.get(rule).is_some_and(|row| row.passed + row.failed > 0),
                // Any question may break the protocol, so that none may be left out.
                None => report.num_played > 0 && plan.rules.is_none() && plan.profiles.is_empty(),
            }
    }

    fn title(&self) -> String {
        let Self { what, since, reason, .. } = self;
        let port = self.port.as_ref().map_or(String::new(), |port| format!(" of {port}"));
        format!("{}: {what}{port}, known since {since}: {reason}", self.rule.as_deref().unwrap_or(PROTOCOL))
    }
}
