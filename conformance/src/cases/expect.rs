//! The expectations of a case at one moment. Keys that are left out are not checked.

use std::collections::BTreeMap;

use pogema_core::{Cell, Change, Map, Metrics, Observed, ObservedMapf, Snapshot, picture};
use serde::Deserialize;
use serde_json::Value;

use crate::digits::{lines, windows};
use crate::request::{Derived, Record, ResetRecord, StepRecord};

/// Expectations after one operation. Blank lines at the end of a picture are ignored.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct Expect {
    /// The map with the active agents (`a`…) and their goals (`A`…).
    pub picture: Option<String>,
    /// The map with `o` at each cell that the occupancy grid marks.
    pub occupied: Option<String>,
    /// The cell of each agent.
    pub cells: Option<Vec<Cell>>,
    /// The goal of each agent.
    pub goals: Option<Vec<Cell>>,
    /// Whether each agent is active.
    pub active: Option<Vec<bool>>,
    /// Whether each agent was on its goal.
    pub on_goal: Option<Vec<bool>>,
    /// The reward of each agent.
    pub rewards: Option<Vec<f32>>,
    /// Whether each agent is terminated.
    pub terminated: Option<Vec<bool>>,
    /// Whether each agent is truncated.
    pub truncated: Option<Vec<bool>>,
    /// The actions that a policy chose.
    pub actions: Option<Vec<u8>>,
    /// The caller's action list after the step.
    pub actions_after: Option<Vec<i64>>,
    /// The metrics of the episode; `{}` for none.
    pub metrics: Option<Metrics>,
    /// The windows of one agent.
    pub sees: Option<Sees>,
    /// Cells relative to the starts.
    pub xy: Option<Vec<[i32; 2]>>,
    /// Goals relative to the starts.
    pub target_xy: Option<Vec<[i32; 2]>>,
    /// Cells counted from the corner of the border.
    pub global_xy: Option<Vec<[i32; 2]>>,
    /// Goals counted from the corner of the border.
    pub global_target_xy: Option<Vec<[i32; 2]>>,
    /// The map with its border.
    pub padded: Option<String>,
    /// NumPy's name of the element type of the map with its border.
    pub padded_dtype: Option<String>,
    /// Derived config fields: any of `width`, `height`, `size`, `density`, `num_agents`.
    pub derived: Option<BTreeMap<String, Value>>,
    /// The foretold goals of each agent.
    pub foretold: Option<Vec<Vec<Cell>>>,
    /// Whether a step was taken back.
    pub moved: Option<bool>,
    /// The changes of each agent: row, column, goal row, goal column, step, active.
    pub changes: Option<Vec<Vec<Change>>>,
    /// Unknown keys. Each is a mismatch, so that a misspelt expectation does not pass unnoticed.
    #[serde(flatten)]
    pub unknown: BTreeMap<String, Value>,
}

/// The windows of one agent, as lines of `.` for 0 and any other character for 1.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sees {
    /// The index of the agent.
    pub agent: usize,
    /// Its obstacles window.
    pub obstacles: Option<String>,
    /// Its agents window.
    pub agents: Option<String>,
    /// Its goal window, in `default` observations only.
    pub goal: Option<String>,
}

impl Expect {
    /// Returns whether there is no expectation.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Describes the first deviation from the expectations.
    pub fn mismatch(&self, record: &Record, map: &Map) -> Option<String> {
        if let Some(key) = self.unknown.keys().next() {
            return Some(format!("unknown expectation `{key}`"));
        }
        if let Some(key) = self.misplaced(record) {
            return Some(format!("`{key}` is expected, but this operation does not report it"));
        }
        let state = record.state().map(|state| self.of_state(state, map));
        let rest = match record {
            Record::Reset(reset) => self.of_reset(reset),
            Record::Step(step) | Record::Astar(step) | Record::Sample(step) => self.of_step(step),
            Record::Back(back) => differ("moved", self.moved.as_ref(), &back.moved),
            Record::History(history) => differ("changes", self.changes.as_ref(), &history.changes),
            Record::Odd(record) => Some(format!("the record does not match its operation: {record}")),
        };
        state.flatten().or(rest)
    }

    /// Returns the first expected key that this kind of record does not report.
    fn misplaced(&self, record: &Record) -> Option<&'static str> {
        let reset = if let Record::Reset(reset) = record { Some(reset) } else { None };
        let (step, has_state) = (record.step(), record.state().is_some());
        let observed = reset.and_then(|reset| reset.observations.as_ref());
        let observed = observed.or_else(|| step.and_then(|step| step.step.observations.as_ref()));
        let has_cells = matches!(observed, Some(Observed::Pomapf(_) | Observed::Mapf(_)));
        let has_global_cells = matches!(observed, Some(Observed::Mapf(_)));
        let (is_reset, is_step) = (reset.is_some(), step.is_some());
        let expected = [
            ("picture", self.picture.is_some(), has_state),
            ("occupied", self.occupied.is_some(), has_state),
            ("cells", self.cells.is_some(), has_state),
            ("goals", self.goals.is_some(), has_state),
            ("active", self.active.is_some(), has_state),
            ("on_goal", self.on_goal.is_some(), has_state),
            ("rewards", self.rewards.is_some(), is_step),
            ("terminated", self.terminated.is_some(), is_step),
            ("truncated", self.truncated.is_some(), is_step),
            ("actions", self.actions.is_some(), is_step),
            ("actions_after", self.actions_after.is_some(), is_step),
            ("metrics", self.metrics.is_some(), is_step),
            ("sees", self.sees.is_some(), observed.is_some()),
            ("xy", self.xy.is_some(), has_cells),
            ("target_xy", self.target_xy.is_some(), has_cells),
            ("global_xy", self.global_xy.is_some(), has_global_cells),
            ("global_target_xy", self.global_target_xy.is_some(), has_global_cells),
            ("padded", self.padded.is_some(), is_reset),
            ("padded_dtype", self.padded_dtype.is_some(), is_reset),
            ("derived", self.derived.is_some(), is_reset),
            ("foretold", self.foretold.is_some(), reset.is_some_and(|reset| reset.goal_lists.is_some())),
            ("moved", self.moved.is_some(), matches!(record, Record::Back(_))),
            ("changes", self.changes.is_some(), matches!(record, Record::History(_))),
        ];
        expected.into_iter().find(|(_, is_given, is_reported)| *is_given && !is_reported).map(|(key, ..)| key)
    }

    fn of_state(&self, state: &Snapshot, map: &Map) -> Option<String> {
        differ_in_lines("picture", self.picture.as_deref(), &picture::picture(map, state))
            .or_else(|| {
                differ_in_lines("occupied", self.occupied.as_deref(), &picture::occupancy_picture(map, state))
            })
            .or_else(|| differ("cells", self.cells.as_ref(), &state.cells))
            .or_else(|| differ("goals", self.goals.as_ref(), &state.goals))
            .or_else(|| differ("active", self.active.as_ref(), &state.active))
            .or_else(|| differ("on_goal", self.on_goal.as_ref(), &state.on_goal))
    }

    fn of_reset(&self, reset: &ResetRecord) -> Option<String> {
        differ_in_lines("padded", self.padded.as_deref(), &reset.padded.rows.join("\n"))
            .or_else(|| differ("padded_dtype", self.padded_dtype.as_ref(), &reset.padded.dtype))
            .or_else(|| self.of_derived(&reset.derived))
            .or_else(|| differ("foretold", self.foretold.as_ref(), reset.goal_lists.as_ref()?))
            .or_else(|| self.of_observations(reset.observations.as_ref()?))
    }

    fn of_derived(&self, derived: &Derived) -> Option<String> {
        let derived = serde_json::to_value(derived).unwrap_or_default();
        let mut expected = self.derived.iter().flatten();
        expected.find_map(|(field, value)| {
            let got = &derived[field.as_str()];
            (got.as_f64() != value.as_f64() || got.is_null())
                .then(|| format!("derived {field}: expected {value}, got {got}"))
        })
    }

    fn of_step(&self, record: &StepRecord) -> Option<String> {
        let step = &record.step;
        let actions: Vec<u8> = step.actions.iter().map(|&action| action.into()).collect();
        differ("rewards", self.rewards.as_ref(), &step.rewards)
            .or_else(|| differ("terminated", self.terminated.as_ref(), &step.terminated))
            .or_else(|| differ("truncated", self.truncated.as_ref(), &step.truncated))
            .or_else(|| differ("actions", self.actions.as_ref(), &actions))
            .or_else(|| differ("actions_after", self.actions_after.as_ref(), &record.actions_after))
            .or_else(|| differ("metrics", self.metrics.as_ref(), &step.metrics.unwrap_or_default()))
            .or_else(|| self.of_observations(step.observations.as_ref()?))
    }

    fn of_observations(&self, observed: &Observed) -> Option<String> {
        if let Some(sees) = &self.sees
            && let Some(mismatch) = sees.mismatch(observed)
        {
            return Some(mismatch);
        }
        let (Observed::Pomapf(pomapf) | Observed::Mapf(ObservedMapf { pomapf, .. })) = observed else {
            return None;
        };
        let own = differ("xy", self.xy.as_ref(), &pomapf.xy)
            .or_else(|| differ("target_xy", self.target_xy.as_ref(), &pomapf.target_xy));
        let Observed::Mapf(mapf) = observed else { return own };
        own.or_else(|| differ("global_xy", self.global_xy.as_ref(), &mapf.global_xy))
            .or_else(|| differ("global_target_xy", self.global_target_xy.as_ref(), &mapf.global_target_xy))
    }
}

impl Sees {
    fn mismatch(&self, observed: &Observed) -> Option<String> {
        let agent = self.agent;
        let seen = match observed {
            Observed::Default { windows: all, .. } => all.get(agent).and_then(|digits| windows::<3>(digits)),
            Observed::Pomapf(pomapf) | Observed::Mapf(ObservedMapf { pomapf, .. }) => {
                let of = |all: &[String]| all.get(agent).and_then(|digits| windows::<1>(digits));
                let both = of(&pomapf.obstacles).zip(of(&pomapf.agents));
                both.map(|([obstacles], [agents])| [obstacles, agents, Vec::new()])
            }
        };
        let Some(seen) = seen else { return Some(format!("the windows of agent {agent} are missing")) };
        let expected = [("obstacles", &self.obstacles), ("agents", &self.agents), ("goal", &self.goal)];
        let mut pairs = expected.into_iter().zip(&seen);
        pairs.find_map(|((what, expected), window)| differ_in_window(what, expected.as_deref(), window))
    }
}

fn differ<T: PartialEq + std::fmt::Debug>(what: &str, expected: Option<&T>, got: &T) -> Option<String> {
    let expected = expected.filter(|&expected| expected != got)?;
    Some(format!("{what}: expected {expected:?}, got {got:?}"))
}

fn differ_in_lines(what: &str, expected: Option<&str>, got: &str) -> Option<String> {
    let expected = expected.filter(|text| text.trim_end() != got)?;
    Some(format!("{what}: expected\n{}\n  got\n{got}", expected.trim_end()))
}

fn differ_in_window(what: &str, expected: Option<&str>, got: &[bool]) -> Option<String> {
    let expected: Vec<&str> = expected?.split_whitespace().collect();
    let flags: Vec<bool> = expected.concat().chars().map(|character| character != '.').collect();
    let text = || format!("{what} window: expected\n{}\n  got\n{}", expected.join("\n"), lines(got));
    (flags != got).then(text)
}
