//! Requests to an implementation and its answers, in the same JSON format for every implementation.

use pogema_core::{Action, Cell, Change, Error, Map, Observed, Padded, Snapshot, TraceStep};
use pogema_maps::{GridConfig, InstanceSource};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A config and the operations on its environment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Request {
    /// An identifier that the response repeats.
    #[serde(default)]
    pub id: u64,
    /// POGEMA's config fields.
    pub config: Value,
    /// A map to register under a name before the config is read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub register: Option<Registered>,
    /// Whether to measure the density of agents.
    #[serde(default)]
    pub density: bool,
    /// Whether to count collisions. POGEMA itself does not count them.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub collisions: bool,
    /// The operations, in order.
    pub ops: Vec<Op>,
}

/// A map with a name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Registered {
    /// The name.
    pub name: String,
    /// Lines of `.` and `#`.
    pub rows: Vec<String>,
}

/// One operation, written as a list whose first element names it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Value>", into = "Vec<Value>")]
pub enum Op {
    /// A reset with an optional seed, which POGEMA 1.4.0 ignores.
    Reset(Option<u64>),
    /// One step.
    Step(Vec<i64>),
    /// One step of POGEMA's A* policy.
    Astar,
    /// One step of POGEMA's random policy.
    Sample,
    /// One step back.
    Back,
    /// The history so far.
    History,
}

/// One record per completed operation, and the error that ended the request early, if any.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Response {
    /// The identifier of the request.
    pub id: Option<u64>,
    /// The result of each operation.
    #[serde(default)]
    pub records: Vec<Record>,
    /// Warnings.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// The error that prevented the other operations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<Failure>,
}

/// An error and the moment when it occurred.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// The operation or phase.
    pub when: When,
    /// The class of the error.
    #[serde(rename = "type")]
    pub kind: String,
    /// The error's text.
    pub message: String,
}

impl Failure {
    pub(crate) fn new(when: When, error: &Error) -> Self {
        Self { when, kind: "Error".into(), message: error.to_string() }
    }
}

/// The operation or phase in which an error occurred.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum When {
    /// The operation at this index.
    Op(usize),
    /// `config`, `make` or another phase before the first operation.
    Phase(String),
}

/// The result of one operation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "op", rename_all = "lowercase")]
#[expect(missing_docs, reason = "each variant is the operation with the same name")]
pub enum Record {
    Reset(Box<ResetRecord>),
    Step(Box<StepRecord>),
    Astar(Box<StepRecord>),
    Sample(Box<StepRecord>),
    Back(Back),
    History(History),
    /// A value that matches none of these.
    #[serde(untagged)]
    Odd(Value),
}

/// The instance and the state after a reset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResetRecord {
    /// The derived config fields.
    pub derived: Derived,
    /// The map without its border.
    pub map: Vec<String>,
    /// The map with its border.
    pub padded: Padded,
    /// The state.
    #[serde(flatten)]
    pub state: Snapshot,
    /// The observations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observations: Option<Observed>,
    /// In lifelong mode, the foretold goals of each agent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub goal_lists: Option<Vec<Vec<Cell>>>,
    /// The reason why `goal_lists` is missing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub goal_lists_error: Option<String>,
}

/// The fields of a config that are derived from others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "each field is the config field with the same name")]
pub struct Derived {
    pub width: usize,
    pub height: usize,
    pub size: usize,
    pub density: f64,
    pub num_agents: usize,
}

/// A step and its results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// The step.
    #[serde(flatten)]
    pub step: TraceStep,
    /// The caller's action list after the step; `soft` replaces each move it reverts with 0.
    pub actions_after: Vec<i64>,
    /// The `is_active` of each agent's info.
    pub infos_active: Vec<bool>,
}

/// The state after a step back.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Back {
    /// Whether there was a step to take back.
    pub moved: bool,
    /// The state.
    #[serde(flatten)]
    pub state: Snapshot,
}

/// The history that a persistent environment keeps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct History {
    /// The state of each agent at every step.
    pub full: Vec<Vec<Change>>,
    /// The first state of each agent and every later state that differs from the one before.
    pub changes: Vec<Vec<Change>>,
}

impl Record {
    /// Returns the results of the step, if the operation was a step.
    pub fn step(&self) -> Option<&StepRecord> {
        match self {
            Self::Step(step) | Self::Astar(step) | Self::Sample(step) => Some(step),
            Self::Reset(_) | Self::Back(_) | Self::History(_) | Self::Odd(_) => None,
        }
    }

    /// Returns the state after the operation, if recorded.
    pub fn state(&self) -> Option<&Snapshot> {
        match self {
            Self::Reset(reset) => Some(&reset.state),
            Self::Step(step) | Self::Astar(step) | Self::Sample(step) => Some(&step.step.state),
            Self::Back(back) => Some(&back.state),
            Self::History(_) | Self::Odd(_) => None,
        }
    }
}

impl Request {
    /// Returns the source of the instances of the config.
    ///
    /// # Errors
    /// If the registered map cannot be read, or the config names a different map.
    pub(crate) fn source(&self, config: &GridConfig) -> Result<InstanceSource, Error> {
        let named = self.register.as_ref().filter(|map| config.map_name.as_ref() == Some(&map.name));
        let registered = named.map(|map| Map::from_rows(&map.rows)).transpose()?;
        InstanceSource::new(config.clone(), registered)
    }
}

impl Response {
    /// Creates an answer to a request, without records.
    pub(crate) fn to(request: &Request) -> Self {
        Self { id: Some(request.id), ..Self::default() }
    }

    /// Records the result of each operation of a request, up to the first error.
    pub(crate) fn record(
        &mut self,
        request: &Request,
        mut perform: impl FnMut(usize, &Op) -> Result<Record, Error>,
    ) {
        for (index, op) in request.ops.iter().enumerate() {
            match perform(index, op) {
                Ok(record) => self.records.push(record),
                Err(error) => {
                    self.error = Some(Failure::new(When::Op(index), &error));
                    return;
                }
            }
        }
    }

    /// Returns the longest side of all maps, without their borders.
    pub(crate) fn longest_side(&self) -> usize {
        let sides = self.records.iter().filter_map(|record| match record {
            Record::Reset(reset) => Some(reset.map.len().max(reset.map.first().map_or(0, String::len))),
            _ => None,
        });
        sides.max().unwrap_or(0)
    }

    /// Returns the map of the episode that contains an operation.
    pub fn map_at(&self, op: usize) -> Option<Map> {
        let mut resets = self.records.iter().take(op + 1).rev().filter_map(|record| match record {
            Record::Reset(reset) => Some(&reset.map),
            _ => None,
        });
        resets.next().and_then(|rows| Map::from_rows(rows).ok())
    }

    /// Returns the last state before an operation.
    pub fn state_before(&self, op: usize) -> Option<&Snapshot> {
        self.records.iter().take(op).rev().find_map(Record::state)
    }
}

impl Derived {
    /// Returns the derived fields of a config.
    pub(crate) fn of(config: &GridConfig) -> Self {
        let GridConfig { width, height, size, density, num_agents, .. } = *config;
        Self { width, height, size, density, num_agents }
    }
}

/// Returns NumPy's name of the element type of the map with its border.
pub(crate) fn padded_dtype(config: &GridConfig) -> &'static str {
    if config.empty_outside { "float64" } else { "int64" }
}

/// Converts the action numbers of a request to actions.
pub(crate) fn actions_of(numbers: &[i64]) -> Result<Vec<Action>, Error> {
    numbers.iter().enumerate().map(|(agent, &number)| Action::from_number(agent, number)).collect()
}

/// Converts actions to the numbers that a request contains.
pub fn numbers(actions: &[Action]) -> Vec<i64> {
    actions.iter().map(|&action| action as i64).collect()
}

impl Op {
    /// The operations without an argument.
    const PLAIN: [Self; 4] = [Self::Astar, Self::Sample, Self::Back, Self::History];

    /// Returns the operation with the given name, if it needs no argument. A reset then has no seed.
    pub(crate) fn of_word(word: &str) -> Option<Self> {
        Self::PLAIN.into_iter().chain([Self::Reset(None)]).find(|op| op.word() == word)
    }

    /// Returns the name of the operation.
    pub(crate) fn word(&self) -> &'static str {
        match self {
            Self::Reset(_) => "reset",
            Self::Step(_) => "step",
            Self::Astar => "astar",
            Self::Sample => "sample",
            Self::Back => "back",
            Self::History => "history",
        }
    }
}

impl TryFrom<Vec<Value>> for Op {
    type Error = String;

    fn try_from(parts: Vec<Value>) -> Result<Self, String> {
        let unknown = || {
            let expected =
                r#"["reset", SEED], ["step", ACTIONS], ["astar"], ["sample"], ["back"] or ["history"]"#;
            format!("invalid operation {}, expected {expected}", Value::Array(parts.clone()))
        };
        let name = parts.first().and_then(Value::as_str).ok_or_else(unknown)?;
        match (name, &parts[1..]) {
            ("reset", [Value::Null]) => Ok(Self::Reset(None)),
            ("reset", [seed]) => seed.as_u64().map(|seed| Self::Reset(Some(seed))).ok_or_else(unknown),
            ("step", [actions]) => {
                serde_json::from_value(actions.clone()).map(Self::Step).map_err(|error| error.to_string())
            }
            (word, []) => Self::PLAIN.into_iter().find(|op| op.word() == word).ok_or_else(unknown),
            _ => Err(unknown()),
        }
    }
}

impl From<Op> for Vec<Value> {
    fn from(op: Op) -> Self {
        let word = op.word().into();
        match op {
            Op::Reset(seed) => vec![word, seed.into()],
            Op::Step(actions) => vec![word, actions.into()],
            Op::Astar | Op::Sample | Op::Back | Op::History => vec![word],
        }
    }
}
