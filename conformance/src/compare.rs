//! The first place where two answers to one request differ.

use std::fmt::{Debug, Write as _};

use pogema_core::{Map, Metrics, Observed, Snapshot, picture};
use pogema_maps::GridConfig;
use serde::Serialize;

use crate::port::{Scope, Told, resolve_hashes};
use crate::request::{Back, History, Op, Record, Request, ResetRecord, Response, StepRecord};
use crate::tally::{Families, Tally, families_of};

/// Two answers differ: where, in what, and which rule that breaks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Divergence {
    /// Index of the operation after which they differ.
    pub op: usize,
    /// What differs, with the index of the agent or list element.
    pub field: String,
    /// What was expected.
    pub expected: String,
    /// What came instead.
    pub got: String,
    /// The rule that says what is right.
    pub rule: String,
    /// The state before the operation, as expected after it, and as it came.
    pub picture: String,
}

impl std::fmt::Display for Divergence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "operation {}: {} differs (rule {})", self.op, self.field, self.rule)?;
        writeln!(f, "  expected {}", self.expected)?;
        writeln!(f, "  got      {}", self.got)?;
        write!(f, "{}", self.picture)
    }
}

/// Finds the first difference between the expected answer and the one that came, counting every comparison.
pub fn compare(
    request: &Request,
    expected: &Response,
    got: &Response,
    tally: &mut Tally,
) -> Option<Divergence> {
    compare_in(&Scope::ALL, request, expected, got, tally)
}

/// The same, for an answer that does not hold everything.
pub fn compare_in(
    scope: &Scope,
    request: &Request,
    expected: &Response,
    got: &Response,
    tally: &mut Tally,
) -> Option<Divergence> {
    let Ok(config) = GridConfig::from_value(&request.config) else {
        let holds = expected.error.is_some() == got.error.is_some();
        tally.count("config/fields", holds);
        return (!holds).then(|| ends_differently("config/fields", 0, expected, got));
    };
    let side = config.rules().side();
    let mut comparison = Comparison { scope, side, families: families_of(&config), tally, found: None };
    let pairs = expected.records.iter().zip(&got.records);
    for (op, (expected_record, got_record)) in pairs.enumerate() {
        comparison.records(expected_record, got_record);
        if let Some(found) = comparison.found.take() {
            return Some(Divergence { op, picture: draw(expected, got, op), ..found });
        }
    }
    let op = expected.records.len().min(got.records.len());
    let holds =
        expected.records.len() == got.records.len() && expected.error.is_some() == got.error.is_some();
    let rule = refusal_rule(request.ops.get(op), expected.error.is_some());
    comparison.tally.count(rule, holds);
    (!holds).then(|| ends_differently(rule, op, expected, got))
}

/// The rule that says whether an operation is to be refused.
fn refusal_rule(op: Option<&Op>, is_refused: bool) -> &'static str {
    match op {
        Some(Op::Step(_)) if is_refused => "move/invalid",
        Some(Op::Step(_)) => "move/actions",
        Some(Op::Astar) => "policy/astar",
        Some(Op::Sample) => "seed/actions",
        Some(Op::Back) => "history/step-back",
        Some(Op::History) => "history/changes",
        Some(Op::Reset(_)) | None => "config/fields",
    }
}

fn ends_differently(rule: &str, op: usize, expected: &Response, got: &Response) -> Divergence {
    let tell = |response: &Response| match (&response.error, response.records.get(op)) {
        (_, Some(Record::Odd(odd))) => odd.to_string(),
        (Some(error), _) => format!("{}: {}", error.kind, error.message),
        (None, _) => "no error".into(),
    };
    Divergence {
        op,
        field: "error".into(),
        expected: tell(expected),
        got: tell(got),
        rule: rule.into(),
        picture: String::new(),
    }
}

struct Comparison<'a> {
    scope: &'a Scope,
    side: usize,
    families: Families,
    tally: &'a mut Tally,
    found: Option<Divergence>,
}

impl Comparison<'_> {
    fn records(&mut self, expected: &Record, got: &Record) {
        match (expected, got) {
            (Record::Reset(expected), Record::Reset(got)) => self.resets(expected, got),
            (Record::Step(expected), Record::Step(got)) => self.steps(expected, got, "move/actions"),
            (Record::Astar(expected), Record::Astar(got)) => self.steps(expected, got, "policy/astar"),
            (Record::Sample(expected), Record::Sample(got)) => self.steps(expected, got, "seed/actions"),
            (Record::Back(expected), Record::Back(got)) => self.backs(expected, got),
            (Record::History(expected), Record::History(got)) => self.histories(expected, got),
            _ => self.value("config/fields", "operation", expected, got),
        }
    }

    fn resets(&mut self, expected: &ResetRecord, got: &ResetRecord) {
        let place = self.families.place;
        if self.scope.drawn {
            if self.scope.tells(Told::Derived) {
                self.value("config/size", "derived", &expected.derived, &got.derived);
            }
            self.list("place/obstacles", "map", &expected.map, &got.map);
        }
        if self.scope.tells(Told::Padded) {
            self.list("border/ring", "padded", &expected.padded.rows, &got.padded.rows);
        }
        if self.scope.is_whole() {
            self.value("border/outside", "padded dtype", &expected.padded.dtype, &got.padded.dtype);
        }
        self.list(place, "start", &expected.state.cells, &got.state.cells);
        self.list(place, "goal", &expected.state.goals, &got.state.goals);
        self.state("goal/finish/start-on-goal", &expected.state, &got.state);
        self.seen(expected.observations.as_ref(), got.observations.as_ref());
        if self.scope.drawn
            && self.scope.tells(Told::Foretold)
            && let (Some(expected), Some(got)) = (&expected.goal_lists, &got.goal_lists)
        {
            self.list("goal/restart/foretold", "foretold goals", expected, got);
        }
    }

    fn steps(&mut self, expected: &StepRecord, got: &StepRecord, policy: &str) {
        let (families, one, other) = (self.families, &expected.step, &got.step);
        self.list(policy, "action", &one.actions, &other.actions);
        self.list(families.collide, "cell", &one.state.cells, &other.state.cells);
        self.list(families.goal, "goal", &one.state.goals, &other.state.goals);
        self.state(families.goal, &one.state, &other.state);
        self.list("reward/own", "reward", &one.rewards, &other.rewards);
        self.list("end/terminated", "terminated", &one.terminated, &other.terminated);
        self.list("end/truncated", "truncated", &one.truncated, &other.truncated);
        if self.scope.is_whole() {
            self.list("goal/finish/leave", "is_active", &expected.infos_active, &got.infos_active);
        }
        self.seen(one.observations.as_ref(), other.observations.as_ref());
        self.figures(one.metrics.as_ref(), other.metrics.as_ref());
        if families.collide == "collide/soft" && self.scope.tells(Told::ActionsAfter) {
            self.list("collide/soft/rewrite", "caller's action", &expected.actions_after, &got.actions_after);
        }
    }

    fn figures(&mut self, expected: Option<&Metrics>, got: Option<&Metrics>) {
        let rule = self.families.metrics;
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
        self.list(rule, "cell", &expected.state.cells, &got.state.cells);
        self.list(rule, "goal", &expected.state.goals, &got.state.goals);
        self.state(rule, &expected.state, &got.state);
    }

    fn histories(&mut self, expected: &History, got: &History) {
        self.list("history/changes", "changes", &expected.changes, &got.changes);
        self.list("history/changes", "full history", &expected.full, &got.full);
    }

    fn state(&mut self, goal_rule: &str, expected: &Snapshot, got: &Snapshot) {
        if self.scope.tells(Told::OnGoal) {
            self.list(goal_rule, "on goal", &expected.on_goal, &got.on_goal);
        }
        self.list(goal_rule, "active", &expected.active, &got.active);
        if self.scope.tells(Told::Occupied) {
            self.value(self.families.occupancy, "occupied cells", &expected.occupied, &got.occupied);
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
            (expected, got) => self.value(self.families.observe, "observations", &expected, &got),
        }
    }

    fn observations(&mut self, expected: &Observed, got: &Observed) {
        let rule = self.families.observe;
        match (expected, got) {
            (Observed::Default { windows: one, .. }, Observed::Default { windows: other, .. }) => {
                self.windows(rule, "observation", one, other);
            }
            (Observed::Pomapf(one), Observed::Pomapf(other)) => {
                self.windows(rule, "obstacles window", &one.obstacles, &other.obstacles);
                self.windows(rule, "agents window", &one.agents, &other.agents);
                self.list(rule, "xy", &one.xy, &other.xy);
                self.list(rule, "target_xy", &one.target_xy, &other.target_xy);
            }
            (Observed::Mapf(one), Observed::Mapf(other)) => {
                self.windows(rule, "obstacles window", &one.pomapf.obstacles, &other.pomapf.obstacles);
                self.windows(rule, "agents window", &one.pomapf.agents, &other.pomapf.agents);
                self.list(rule, "global_xy", &one.global_xy, &other.global_xy);
                self.list(rule, "global_target_xy", &one.global_target_xy, &other.global_target_xy);
            }
            _ => {}
        }
        // Whatever no line above named: element types, the global map, and what fits no form at all.
        self.value(rule, "observations", expected, got);
    }

    fn windows(&mut self, rule: &str, what: &str, expected: &[String], got: &[String]) {
        let differing = expected.iter().zip(got).position(|(one, other)| one != other);
        let Some(agent) = differing else { return self.list(rule, what, expected, got) };
        // Of a hash that differs nothing else can be said.
        let place = match got[agent].contains(':') {
            true => String::new(),
            false => format!(", value {} row by row", first_differing_bit(&expected[agent], &got[agent])),
        };
        let field = format!("{what} of agent {agent}{place}");
        self.value(rule, &field, &expected[agent], &got[agent]);
    }

    fn list<T: PartialEq + Debug>(&mut self, rule: &str, what: &str, expected: &[T], got: &[T]) {
        let holds = expected == got;
        self.tally.count(rule, holds);
        if holds || self.found.is_some() {
            return;
        }
        if expected.len() != got.len() {
            let field = format!("number of {what} entries");
            return self.report(rule, field, &expected.len(), &got.len());
        }
        if let Some(index) = expected.iter().zip(got).position(|(one, other)| one != other) {
            self.report(rule, format!("{what} {index}"), &expected[index], &got[index]);
        }
    }

    fn value<T: PartialEq + Debug>(&mut self, rule: &str, what: &str, expected: &T, got: &T) {
        let holds = expected == got;
        self.tally.count(rule, holds);
        if !holds {
            self.report(rule, what.into(), expected, got);
        }
    }

    fn report(&mut self, rule: &str, field: String, expected: &impl Debug, got: &impl Debug) {
        if self.found.is_none() {
            self.found = Some(Divergence {
                op: 0,
                field,
                expected: format!("{expected:?}"),
                got: format!("{got:?}"),
                rule: rule.into(),
                picture: String::new(),
            });
        }
    }
}

fn first_differing_bit(one: &str, other: &str) -> usize {
    let digits = one.chars().zip(other.chars()).enumerate();
    let digit = |character: char| character.to_digit(16).unwrap_or(0);
    digits
        .map(|(index, (one, other))| (index, digit(one) ^ digit(other)))
        .find(|(_, difference)| *difference != 0)
        .map_or(4 * one.len().min(other.len()), |(index, difference)| {
            4 * index + difference.leading_zeros() as usize - 28
        })
}

/// Before, expected and got, below each other.
fn draw(expected: &Response, got: &Response, op: usize) -> String {
    let map = expected.records[..=op].iter().rev().find_map(|record| match record {
        Record::Reset(reset) => Map::from_rows(&reset.map).ok(),
        _ => None,
    });
    let Some(map) = map else { return String::new() };
    let before = expected.records[..op].iter().rev().find_map(Record::state);
    let states =
        [("before", before), ("expected", expected.records[op].state()), ("got", got.records[op].state())];
    let mut text = String::new();
    for (what, state) in states {
        let Some(state) = state else { continue };
        let occupancy = picture::occupancy_picture(&map, state);
        let _ = writeln!(text, "  {what}: agents and goals, then occupancy");
        for (agents, occupied) in picture::picture(&map, state).lines().zip(occupancy.lines()) {
            let _ = writeln!(text, "    {agents}   {occupied}");
        }
    }
    text
}
