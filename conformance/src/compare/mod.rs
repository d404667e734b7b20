//! Comparison of two answers to one request.

mod draw;
mod field;
pub mod panel;

use pogema_core::{Metrics, Observation, Observed, ObservedPomapf, OnGoal, Snapshot};
use pogema_maps::{GridConfig, Targets};
use serde::Serialize;
use serde_json::json;

pub use self::field::{Field, FieldPart};
use self::panel::{Limits, Panel, text_of_panels};
use crate::port::{ReplyKey, Scope, resolve_hashes};
use crate::request::{Back, History, Op, Record, Request, ResetRecord, Response, StepRecord, numbers};
use crate::tally::{ConfigRules, Tally, rules_of};

/// A difference between two answers, and the rule it breaks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Divergence {
    /// Index of the operation after which they differ.
    pub op: usize,
    /// The value that differs, with the index of the agent or list element.
    pub field: Field,
    /// The expected value.
    pub expected: String,
    /// The received value.
    pub got: String,
    /// The rule that defines the right value.
    pub rule: String,
    /// The state before the operation, the expected and received states after it, then the windows that differ.
    #[serde(serialize_with = "panel::serialize")]
    pub picture: Vec<Panel>,
}

impl std::fmt::Display for Divergence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "operation {}: {} differs (rule {})", self.op, self.field, self.rule)?;
        writeln!(f, "  expected {}", self.expected)?;
        writeln!(f, "  got      {}", self.got)?;
        f.write_str(&text_of_panels(&self.picture, Limits::NONE))
    }
}

/// Returns the first difference between the expected and the received answer, and counts every comparison.
pub fn compare(
    request: &Request,
    expected: &Response,
    got: &Response,
    tally: &mut Tally,
) -> Option<Divergence> {
    compare_in(&Scope::ALL, request, expected, got, tally).into_iter().next()
}

/// Returns the first difference of each kind, for an answer that may lack optional parts.
///
/// A difference in the state ends the comparison, since everything after it can differ too. If the scope is whole
/// ([`Scope::is_whole`]), any difference ends it after the operation. Otherwise, only a difference in the state ends
/// it.
pub fn compare_in(
    scope: &Scope,
    request: &Request,
    expected: &Response,
    got: &Response,
    tally: &mut Tally,
) -> Vec<Divergence> {
    let Ok(config) = GridConfig::from_value(&request.config) else {
        let holds = expected.error.is_some() == got.error.is_some();
        tally.count("config/fields", holds);
        let found = (!holds).then(|| ends_differently("config/fields", 0, expected, got));
        return found.into_iter().collect();
    };
    compare_played(scope, &config, request, expected, got, tally)
}

/// Compares like [`compare_in`], under the rules of a config that may be out of range in POGEMA.
pub fn compare_played(
    scope: &Scope,
    config: &GridConfig,
    request: &Request,
    expected: &Response,
    got: &Response,
    tally: &mut Tally,
) -> Vec<Divergence> {
    let side = config.rules().side();
    let (op, found, states_differ) = (0, Vec::new(), false);
    let config_rules = rules_of(config);
    let has_sequences = matches!(config.targets_xy, Some(Targets::Sequences(_)));
    // Instances give the goals, so a wrong goal is attributed to the drawing of goals only in config mode.
    let draws_goals =
        scope.drawn && !scope.is_whole() && config.on_target == OnGoal::Restart && !has_sequences;
    let mut comparison =
        Comparison { scope, side, config_rules, draws_goals, tally, op, found, states_differ };
    for (op, (one, other)) in expected.records.iter().zip(&got.records).enumerate() {
        comparison.op = op;
        comparison.records(one, other, request.ops.get(op));
        for found in comparison.found.iter_mut().filter(|found| found.op == op) {
            found.picture.splice(0..0, draw::states(expected, got, op));
        }
        if comparison.states_differ || (scope.is_whole() && !comparison.found.is_empty()) {
            return comparison.found;
        }
    }
    let op = expected.records.len().min(got.records.len());
    let holds =
        expected.records.len() == got.records.len() && expected.error.is_some() == got.error.is_some();
    let next = request.ops.get(op);
    let rule = refusal_rule(next, expected.error.is_some(), scope);
    // After the last operation, nothing is left to refuse.
    if next.is_some() || !holds {
        comparison.tally.count(rule, holds);
    }
    let mut found = comparison.found;
    found.extend((!holds).then(|| ends_differently(rule, op, expected, got)));
    found
}

/// Returns the rule that decides whether an operation is an error.
fn refusal_rule(op: Option<&Op>, is_refused: bool, scope: &Scope) -> &'static str {
    match op {
        Some(Op::Step(_)) if is_refused => "move/invalid",
        Some(Op::Step(_)) => "move/actions",
        Some(Op::Astar) => "policy/astar",
        Some(Op::Sample) => "seed/actions",
        Some(Op::Back) => "history/step-back",
        Some(Op::History) => "history/changes",
        Some(Op::Reset(_)) | None if scope.drawn => "config/fields",
        // An instance gives its starts and goals, so a refusal of it has nothing to do with a config.
        Some(Op::Reset(_)) | None => "place/explicit",
    }
}

/// Returns the divergence of observations that do not have the shape of their type, and counts it.
pub fn misshapen(request: &Request, op: usize, got: String, tally: &mut Tally) -> Divergence {
    let config = GridConfig::from_value(&request.config).unwrap_or_default();
    let (rule, side) = (rules_of(&config).observe, config.rules().side());
    let expected = match config.observation_type {
        Observation::Default => format!("for each agent a window of shape [3, {side}, {side}]"),
        _ => format!("for each agent two windows of shape [{side}, {side}] and its positions"),
    };
    tally.count(rule, false);
    let field = Field { name: "shape of observations", part: FieldPart::Whole };
    Divergence { op, field, expected, got, rule: rule.into(), picture: Vec::new() }
}

fn ends_differently(rule: &str, op: usize, expected: &Response, got: &Response) -> Divergence {
    let describe = |response: &Response| match (&response.error, response.records.get(op)) {
        (_, Some(Record::Odd(odd))) => odd.to_string(),
        (Some(error), _) => format!("{}: {}", error.kind, error.message),
        (None, _) => "no error".into(),
    };
    Divergence {
        op,
        field: Field { name: "error", part: FieldPart::Whole },
        expected: describe(expected),
        got: describe(got),
        rule: rule.into(),
        picture: draw::states(expected, got, op),
    }
}

/// A part of an answer that can be compared and printed.
trait Comparable: PartialEq + Serialize {}

impl<T: PartialEq + Serialize> Comparable for T {}

struct Comparison<'a> {
    scope: &'a Scope,
    side: usize,
    config_rules: ConfigRules,
    draws_goals: bool,
    tally: &'a mut Tally,
    op: usize,
    found: Vec<Divergence>,
    states_differ: bool,
}

impl Comparison<'_> {
    fn records(&mut self, expected: &Record, got: &Record, op: Option<&Op>) {
        match (expected, got) {
            (Record::Reset(expected), Record::Reset(got)) => self.resets(expected, got),
            (Record::Step(expected), Record::Step(got)) => self.steps(expected, got, "move/actions"),
            (Record::Astar(expected), Record::Astar(got)) => self.steps(expected, got, "policy/astar"),
            (Record::Sample(expected), Record::Sample(got)) => self.steps(expected, got, "seed/actions"),
            (Record::Back(expected), Record::Back(got)) => self.backs(expected, got),
            (Record::History(expected), Record::History(got)) => self.histories(expected, got),
            // The port played something else, so its state says nothing about later operations either.
            _ => {
                let rule = refusal_rule(op, false, self.scope);
                match (expected.step(), got) {
                    (Some(step), Record::Odd(odd)) if odd["played"].is_array() => {
                        self.value(rule, "actions", &json!(numbers(&step.step.actions)), &odd["played"]);
                    }
                    _ => self.value(rule, "operation", expected, got),
                }
                self.states_differ = true;
            }
        }
    }

    fn resets(&mut self, expected: &ResetRecord, got: &ResetRecord) {
        // If starts and goals are given, the rules of drawing them do not apply.
        let place = if self.scope.drawn { self.config_rules.place } else { "place/explicit" };
        if self.scope.drawn {
            if self.scope.tells(ReplyKey::Derived) {
                self.value("config/size", "derived", &expected.derived, &got.derived);
            }
            self.state_list("place/obstacles", "map", &expected.map, &got.map);
        }
        if self.scope.tells(ReplyKey::Padded) {
            self.list("border/ring", "padded", &expected.padded.rows, &got.padded.rows);
        }
        if self.scope.is_whole() {
            self.value("border/outside", "padded dtype", &expected.padded.dtype, &got.padded.dtype);
        }
        self.state_list(place, "start", &expected.state.cells, &got.state.cells);
        self.state_list(place, "goal", &expected.state.goals, &got.state.goals);
        self.state("goal/finish/start-on-goal", &expected.state, &got.state);
        self.seen(expected.observations.as_ref(), got.observations.as_ref());
        if self.scope.drawn
            && self.scope.tells(ReplyKey::Foretold)
            && let (Some(expected), Some(got)) = (&expected.goal_lists, &got.goal_lists)
        {
            self.list("goal/restart/foretold", "foretold goals", expected, got);
        }
    }

    fn steps(&mut self, expected: &StepRecord, got: &StepRecord, policy: &str) {
        let (config_rules, one, other) = (self.config_rules, &expected.step, &got.step);
        self.state_list(policy, "action", &one.actions, &other.actions);
        self.state_list(config_rules.collide, "cell", &one.state.cells, &other.state.cells);
        let goal_rule = if self.draws_goals { "goal/restart/draw" } else { config_rules.goal };
        self.state_list(goal_rule, "goal", &one.state.goals, &other.state.goals);
        self.state(config_rules.goal, &one.state, &other.state);
        self.list(config_rules.reward, "reward", &one.rewards, &other.rewards);
        self.list("end/terminated", "terminated", &one.terminated, &other.terminated);
        self.list("end/truncated", "truncated", &one.truncated, &other.truncated);
        if self.scope.is_whole() {
            self.list("goal/finish/leave", "is_active", &expected.infos_active, &got.infos_active);
        }
        self.seen(one.observations.as_ref(), other.observations.as_ref());
        self.metrics(one.metrics.as_ref(), other.metrics.as_ref());
        if self.scope.tells(ReplyKey::ActionsAfter) {
            self.list("collide/soft/rewrite", "caller's action", &expected.actions_after, &got.actions_after);
        }
    }

    fn metrics(&mut self, expected: Option<&Metrics>, got: Option<&Metrics>) {
        let rule = self.config_rules.metrics;
        let Some(names) = &self.scope.metrics else { return self.value(rule, "metrics", &expected, &got) };
        if names.is_empty() {
            return;
        }
        let claimed = |metrics: Option<&Metrics>| -> Vec<(&str, f64)> {
            let all = metrics.map(Metrics::named).unwrap_or_default();
            all.into_iter().filter(|(name, _)| names.iter().any(|known| known == name)).collect()
        };
        self.value(rule, "metrics", &claimed(expected), &claimed(got));
    }

    fn backs(&mut self, expected: &Back, got: &Back) {
        let rule = "history/step-back";
        self.value(rule, "moved", &expected.moved, &got.moved);
        self.state_list(rule, "cell", &expected.state.cells, &got.state.cells);
        self.state_list(rule, "goal", &expected.state.goals, &got.state.goals);
        self.state(rule, &expected.state, &got.state);
    }

    fn histories(&mut self, expected: &History, got: &History) {
        self.list("history/changes", "changes", &expected.changes, &got.changes);
        self.list("history/changes", "full history", &expected.full, &got.full);
    }

    fn state(&mut self, goal_rule: &str, expected: &Snapshot, got: &Snapshot) {
        if self.scope.tells(ReplyKey::OnGoal) {
            self.list(goal_rule, "on goal", &expected.on_goal, &got.on_goal);
        }
        self.state_list(goal_rule, "active", &expected.active, &got.active);
        if self.scope.tells(ReplyKey::Occupied) {
            self.value(self.config_rules.occupancy, "occupied cells", &expected.occupied, &got.occupied);
        }
    }

    fn seen(&mut self, expected: Option<&Observed>, got: Option<&Observed>) {
        match (expected, got) {
            _ if !self.scope.observations => {}
            (Some(expected), Some(got)) if self.scope.is_whole() => self.observations(expected, got),
            (Some(expected), Some(got)) => {
                let mut got = got.clone();
                resolve_hashes(expected, &mut got, self.side);
                self.observations(expected, &got);
            }
            (expected, got) => self.value(self.config_rules.observe, "observations", &expected, &got),
        }
    }

    fn observations(&mut self, expected: &Observed, got: &Observed) {
        let rule = self.config_rules.observe;
        let holds = match (expected, got) {
            (Observed::Default { windows: one, .. }, Observed::Default { windows: other, .. }) => {
                self.windows(rule, "observation", one, other)
            }
            (Observed::Pomapf(one), Observed::Pomapf(other)) => self.pomapf(one, other),
            (Observed::Mapf(one), Observed::Mapf(other)) => {
                self.pomapf(&one.pomapf, &other.pomapf)
                    && self.list(rule, "global_xy", &one.global_xy, &other.global_xy)
                    && self.list(rule, "global_target_xy", &one.global_target_xy, &other.global_target_xy)
            }
            _ => true,
        };
        if holds {
            // Everything else: element types, the global map, and values without a valid form.
            self.value(rule, "observations", expected, got);
        }
    }

    fn pomapf(&mut self, expected: &ObservedPomapf, got: &ObservedPomapf) -> bool {
        let rule = self.config_rules.observe;
        self.windows(rule, "obstacles window", &expected.obstacles, &got.obstacles)
            && self.windows(rule, "agents window", &expected.agents, &got.agents)
            && self.list(rule, "xy", &expected.xy, &got.xy)
            && self.list(rule, "target_xy", &expected.target_xy, &got.target_xy)
    }

    fn windows(&mut self, rule: &str, name: &'static str, expected: &[String], got: &[String]) -> bool {
        let differing = expected.iter().zip(got).position(|(one, other)| one != other);
        let Some(agent) = differing else { return self.list(rule, name, expected, got) };
        let (one, other) = (&expected[agent], &got[agent]);
        // A hash that differs does not show which value differs.
        let value = (!other.contains(':')).then(|| draw::first_differing_bit(one, other));
        let num_found = self.found.len();
        self.tally.count(rule, false);
        self.report(rule, Field { name, part: FieldPart::Window { agent, value } }, one, other);
        if let Some(found) = self.found.get_mut(num_found) {
            found.picture = draw::windows(one, other, self.side);
        }
        false
    }

    /// Compares a part of the state. After a difference here, nothing that follows can be compared.
    fn state_list<T: Comparable>(&mut self, rule: &str, name: &'static str, expected: &[T], got: &[T]) {
        self.list(rule, name, expected, got);
        self.states_differ |= expected != got;
    }

    fn list<T: Comparable>(&mut self, rule: &str, name: &'static str, expected: &[T], got: &[T]) -> bool {
        let holds = expected == got;
        self.tally.count(rule, holds);
        if expected.len() != got.len() {
            self.report(rule, Field { name, part: FieldPart::Length }, &expected.len(), &got.len());
        } else if let Some(index) = expected.iter().zip(got).position(|(one, other)| one != other) {
            self.report(rule, Field { name, part: FieldPart::Element(index) }, &expected[index], &got[index]);
        }
        holds
    }

    fn value<T: Comparable>(&mut self, rule: &str, name: &'static str, expected: &T, got: &T) {
        let holds = expected == got;
        self.tally.count(rule, holds);
        if !holds {
            self.report(rule, Field { name, part: FieldPart::Whole }, expected, got);
        }
    }

    fn report(&mut self, rule: &str, field: Field, expected: &impl Serialize, got: &impl Serialize) {
        let is_reported = |found: &Divergence| found.rule == rule && found.field.kind() == field.kind();
        if self.states_differ || self.found.iter().any(is_reported) {
            return;
        }
        let (expected, got) = (in_json(expected), in_json(got));
        let (op, rule, picture) = (self.op, rule.into(), Vec::new());
        self.found.push(Divergence { op, field, expected, got, rule, picture });
    }
}

/// Formats a value as JSON, the form that authors of ports see.
fn in_json(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_else(|error| error.to_string())
}
