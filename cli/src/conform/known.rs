//! Known deviations: reads them from a file, marks the causes they explain, and finds those that no longer occur.

use std::path::Path;

use jiff::civil::Date;
use pogema_conformance::port::{Cause, PROTOCOL_RULE, Plan, PortReport};
use pogema_core::Error;
use pogema_maps::files::read_text;
use pogema_maps::{did_you_mean, value_from_yaml};
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use super::summary::{name_of, rule_names};

/// The known deviations listed in a file.
#[derive(Debug, Default)]
pub struct Known {
    deviations: Vec<Deviation>,
}

/// One known deviation, named as the report names causes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, expecting = "fields and values such as `rule: collide/soft`")]
struct Deviation {
    /// The rule; [`PROTOCOL_RULE`] for misbehaviour.
    #[serde(deserialize_with = "text")]
    rule: String,
    #[serde(deserialize_with = "text")]
    what: String,
    /// The circumstances; `None` accepts any, but only if all occurrences have one cause.
    #[serde(default)]
    when: Option<String>,
    #[serde(deserialize_with = "text")]
    since: String,
    #[serde(deserialize_with = "text")]
    reason: String,
    /// The name of the port; `None` for all ports.
    #[serde(default)]
    port: Option<String>,
}

/// Reads any value as text, so that `what: 3` is valid and the error for a number in `since` names the expected date.
fn text<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    let value = Value::deserialize(deserializer)?;
    Ok(value.as_str().map_or_else(|| value.to_string(), str::to_owned))
}

/// The titles of known deviations that did not occur in a run.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Leftover {
    /// Deviations whose rules were played.
    pub stopped: Vec<String>,
    /// Deviations that may still exist, because the run did not play all that could show them.
    pub not_played: Vec<String>,
}

impl Known {
    /// Reads a list of known deviations.
    ///
    /// # Errors
    /// [`Error::Io`] with the number of the first invalid entry.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let failed = |reason: String| Error::io(path, reason);
        let entries = match value_from_yaml(&read_text(path)?).map_err(|error| failed(error.reason()))? {
            Value::Array(entries) => entries,
            Value::Null => Vec::new(),
            _ => return Err(failed("expected a list of entries".into())),
        };
        let mut deviations: Vec<Deviation> = Vec::new();
        for (index, entry) in entries.into_iter().enumerate() {
            let failed = |reason: String| failed(format!("entry {}: {reason}", index + 1));
            let deviation = Deviation::new(entry).map_err(failed)?;
            if let Some(at) = deviations.iter().position(|earlier| earlier.key() == deviation.key()) {
                return Err(failed(format!("duplicates entry {}", at + 1)));
            }
            deviations.push(deviation);
        }
        Ok(Self { deviations })
    }

    /// Marks known causes with date and reason.
    pub fn mark(&self, reports: &mut [PortReport]) {
        for report in reports {
            let port = name_of(report).to_owned();
            for cause in &mut report.causes {
                let deviation =
                    self.deviations.iter().find(|known| known.applies_to(&port) && known.accepts(cause));
                cause.known = deviation.map(|known| format!("since {}: {}", known.since, known.reason));
            }
        }
    }

    /// Returns the deviations that did not occur.
    pub fn leftover(&self, reports: &[PortReport], plan: &Plan) -> Leftover {
        let mut leftover = Leftover::default();
        for known in &self.deviations {
            let mut ports = reports.iter().filter(|report| known.applies_to(name_of(report)));
            if ports.clone().any(|report| report.causes.iter().any(|cause| known.explains(cause))) {
                continue;
            }
            // A port whose run was cut short might have shown the deviation.
            let is_whole = ports.clone().all(|report| report.num_not_run + report.num_interrupted == 0);
            let was_played = is_whole && ports.any(|report| known.was_played(report, plan));
            if was_played { &mut leftover.stopped } else { &mut leftover.not_played }.push(known.title());
        }
        leftover
    }
}

impl Deviation {
    fn new(entry: Value) -> Result<Self, String> {
        let mut deviation: Self = serde_json::from_value(entry).map_err(|error| error.to_string())?;
        let rule = &deviation.rule;
        if rule != PROTOCOL_RULE && rule_names().all(|known| known != rule) {
            return Err(format!("unknown rule `{rule}`{}", did_you_mean(rule, rule_names())));
        }
        // Only one date format is accepted, so that lists can be sorted and searched by date.
        let is_date = deviation.since.parse::<Date>().is_ok_and(|date| date.to_string() == deviation.since);
        if !is_date {
            return Err(format!("`since` is `{}`, expected a date such as 2026-11-22", deviation.since));
        }
        let when = deviation.when.as_mut().map(|when| ("when", when));
        let texts = [("what", &mut deviation.what), ("reason", &mut deviation.reason)];
        for (name, text) in texts.into_iter().chain(when) {
            // Folded texts become one line.
            *text = text.split_whitespace().collect::<Vec<_>>().join(" ");
            if text.is_empty() {
                return Err(format!("`{name}` is empty"));
            }
        }
        Ok(deviation)
    }

    fn key(&self) -> (&str, &str, &Option<String>, &Option<String>) {
        (&self.rule, &self.what, &self.when, &self.port)
    }

    fn applies_to(&self, port: &str) -> bool {
        self.port.as_ref().is_none_or(|name| name == port)
    }

    /// Returns whether a cause has the rule and the field of this deviation.
    fn explains(&self, cause: &Cause) -> bool {
        (&*self.rule, &self.what) == (cause.rule.as_deref().unwrap_or(PROTOCOL_RULE), &cause.what)
    }

    /// Returns whether this deviation accepts a cause. Without `when`, it accepts no group that has several causes, so
    /// that one entry cannot hide two bugs.
    fn accepts(&self, cause: &Cause) -> bool {
        self.explains(cause) && self.when.as_ref().map_or(cause.share.is_none(), |when| *when == cause.when)
    }

    /// Returns whether the run would have shown the deviation if it still existed. The run would not have shown it if
    /// only single cases or parts were played, or if the rule was left out or is not claimed.
    fn was_played(&self, report: &PortReport, plan: &Plan) -> bool {
        plan.files.is_empty()
            && plan.parts.is_empty()
            && match &*self.rule {
                // The port may break the protocol on any request, so no rule may be left out.
                PROTOCOL_RULE => report.num_played > 0 && plan.rules.is_none() && plan.profiles.is_empty(),
                rule => report.rules.get(rule).is_some_and(|row| row.passed + row.failed > 0),
            }
    }

    fn title(&self) -> String {
        let Self { rule, what, since, reason, .. } = self;
        let when = self.when.as_ref().map_or(String::new(), |when| format!(" ({when})"));
        let port = self.port.as_ref().map_or(String::new(), |port| format!(" of {port}"));
        format!("{rule}: {what}{when}{port}, known since {since}: {reason}")
    }
}

#[cfg(test)]
mod tests {
    use pogema_conformance::port::Verdicts;

    use super::*;

    #[test]
    fn a_deviation_has_not_stopped_if_one_port_was_cut_short() {
        let entry = "{rule: reward/own, what: reward, since: 2026-01-31, reason: twice as much}";
        let known = Known { deviations: vec![Deviation::new(value_from_yaml(entry).unwrap()).unwrap()] };
        let verdicts = Verdicts { passed: 1, ..Verdicts::default() };
        let whole =
            PortReport { rules: [("reward/own".to_owned(), verdicts)].into(), ..PortReport::default() };
        let cut_short = PortReport { num_not_run: 1, ..whole.clone() };
        let plan = Plan::default();
        assert_eq!(known.leftover(&[whole.clone(), whole.clone()], &plan).stopped.len(), 1);
        assert_eq!(known.leftover(&[whole, cut_short], &plan).not_played.len(), 1);
    }
}
