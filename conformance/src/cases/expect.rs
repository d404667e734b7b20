//! The expectations of a case at one moment. Keys that are left out are not checked.

use std::collections::BTreeMap;

use pogema_core::{Cell, Change, Map, Metrics, Observed, ObservedMapf, Snapshot, picture};
use serde::Deserialize;
use serde_json::Value;

use crate::digits::{area_of, unpack};
use crate::request::{Record, ResetRecord, StepRecord};

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
    pub derived: Option<Value>,
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
            .or_else(|| self.of_derived(reset))
            .or_else(|| differ("foretold", self.foretold.as_ref(), reset.goal_lists.as_ref()?))
            .or_else(|| self.of_observations(reset.observations.as_ref()?))
    }

    fn of_derived(&self, reset: &ResetRecord) -> Option<String> {
        let derived = serde_json::to_value(&reset.derived).ok()?;
        let expected = self.derived.as_ref()?.as_object()?;
        let wrong = expected.iter().find(|(field, value)| derived[field.as_str()].as_f64() != value.as_f64());
        wrong.map(|(field, value)| {
            format!("derived {field}: expected {value}, got {}", derived[field.as_str()])
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
        let windows: Vec<Vec<bool>> = match observed {
            Observed::Default { windows, .. } => {
                let flags = unpack(windows.get(agent)?);
                flags.chunks(area_of(flags.len())?).map(<[bool]>::to_vec).collect()
            }
            Observed::Pomapf(pomapf) | Observed::Mapf(ObservedMapf { pomapf, .. }) => {
                [&pomapf.obstacles[agent], &pomapf.agents[agent]].map(|window| unpack(window)).into()
            }
        };
        let expected = [("obstacles", &self.obstacles), ("agents", &self.agents), ("goal", &self.goal)];
        let mut pairs = expected.into_iter().zip(&windows);
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
    let lines: Vec<&str> = expected?.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    let flags: Vec<bool> = lines.concat().chars().map(|character| character != '.').collect();
    let holds = got.len() >= flags.len() && got.len() < flags.len() + 8 && got[..flags.len()] == flags[..];
    let side = lines.len().max(1);
    let drawn: Vec<String> = got
        .chunks(side)
        .take(side)
        .map(|row| row.iter().map(|&flag| if flag { '1' } else { '.' }).collect())
        .collect();
    (!holds).then(|| format!("{what} window: expected\n{}\n  got\n{}", lines.join("\n"), drawn.join("\n")))
}
