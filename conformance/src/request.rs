//! What is asked of an implementation, and what it answers: the same JSON for every implementation.

use pogema_core::{Action, Cell, Change, Error, Map, Observed, Padded, Snapshot, TraceStep};
use pogema_maps::{GridConfig, InstanceSource};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A config and what to do with an environment of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Request {
    /// Comes back in the response.
    #[serde(default)]
    pub id: u64,
    /// POGEMA's config fields.
    pub config: Value,
    /// A map to register under a name first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub register: Option<Registered>,
    /// Whether to measure the density of agents.
    #[serde(default)]
    pub density: bool,
    /// Whether to count collisions, which POGEMA itself does not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub collisions: bool,
    /// What to do, in order.
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
    /// Reset, with the seed that POGEMA 1.4.0 ignores.
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

/// One record per operation done, and why it ended early if it did.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Response {
    /// The request's.
    pub id: Option<u64>,
    /// What each operation gave.
    #[serde(default)]
    pub records: Vec<Record>,
    /// What was warned of.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// Why not all was done.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<Failure>,
}

/// An error and when it came.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// During what.
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

/// During what an error came.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum When {
    /// The operation of this index.
    Op(usize),
    /// `config`, `make` or another phase before the first operation.
    Phase(String),
}

/// What one operation gave.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "op", rename_all = "lowercase")]
#[expect(missing_docs, reason = "each is the operation of its name")]
pub enum Record {
    Reset(Box<ResetRecord>),
    Step(Box<StepRecord>),
    Astar(Box<StepRecord>),
    Sample(Box<StepRecord>),
    Back(Back),
    History(History),
    /// What fits none of these.
    #[serde(untagged)]
    Odd(Value),
}

/// The instance and the state after a reset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResetRecord {
    /// What the config derived.
    pub derived: Derived,
    /// The map without its border.
    pub map: Vec<String>,
    /// The map with its border.
    pub padded: Padded,
    /// The state.
    #[serde(flatten)]
    pub state: Snapshot,
    /// What agents see.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observations: Option<Observed>,
    /// In lifelong mode, the goals foretold for each agent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub goal_lists: Option<Vec<Vec<Cell>>>,
    /// Why there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub goal_lists_error: Option<String>,
}

/// The fields of a config that are derived from others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "each is the config field of its name")]
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
    /// The caller's action list after the step: `soft` writes 0 for every move it takes back.
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

/// What a persistent environment has kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct History {
    /// For each agent its state at every step.
    pub full: Vec<Vec<Change>>,
    /// For each agent its first state and every later one that differs.
    pub changes: Vec<Vec<Change>>,
}

impl Record {
    /// The results of a step, if the operation was one.
    pub fn step(&self) -> Option<&StepRecord> {
        match self {
            Self::Step(step) | Self::Astar(step) | Self::Sample(step) => Some(step),
            Self::Reset(_) | Self::Back(_) | Self::History(_) | Self::Odd(_) => None,
        }
    }

    /// The state after the operation.
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
    /// The source of the instances of its config.
    ///
    /// # Errors
    /// If the registered map cannot be read, or the config names another.
    pub(crate) fn source(&self, config: &GridConfig) -> Result<InstanceSource, Error> {
        let named = self.register.as_ref().filter(|map| config.map_name.as_ref() == Some(&map.name));
        let registered = named.map(|map| Map::from_rows(&map.rows)).transpose()?;
        InstanceSource::new(config.clone(), registered)
    }
}

impl Response {
    /// An answer to a request, without a record.
    pub(crate) fn to(request: &Request) -> Self {
        Self { id: Some(request.id), ..Self::default() }
    }

    /// Records what each operation of a request gives, up to the first error.
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

    /// The map of the episode that an operation belongs to.
    pub fn map_at(&self, op: usize) -> Option<Map> {
        self.records.iter().take(op + 1).rev().find_map(|record| match record {
            Record::Reset(reset) => Map::from_rows(&reset.map).ok(),
            _ => None,
        })
    }

    /// The last state before an operation.
    pub fn state_before(&self, op: usize) -> Option<&Snapshot> {
        self.records.iter().take(op).rev().find_map(Record::state)
    }
}

impl Derived {
    /// The fields of a config.
    pub(crate) fn of(config: &GridConfig) -> Self {
        let GridConfig { width, height, size, density, num_agents, .. } = *config;
        Self { width, height, size, density, num_agents }
    }
}

/// NumPy's name of the element type of the map with its border.
pub(crate) fn padded_dtype(config: &GridConfig) -> &'static str {
    if config.empty_outside { "float64" } else { "int64" }
}

/// The actions of a request.
pub(crate) fn actions_of(numbers: &[i64]) -> Result<Vec<Action>, Error> {
    numbers.iter().enumerate().map(|(agent, &number)| Action::from_number(agent, number)).collect()
}

/// Actions as a request writes them.
pub fn numbers(actions: &[Action]) -> Vec<i64> {
    actions.iter().map(|&action| action as i64).collect()
}

impl Op {
    /// The operations without an argument.
    const PLAIN: [Self; 4] = [Self::Astar, Self::Sample, Self::Back, Self::History];

    /// The operation of a word, if it needs no argument; a reset then has no seed.
    pub(crate) fn of_word(word: &str) -> Option<Self> {
        Self::PLAIN.into_iter().chain([Self::Reset(None)]).find(|op| op.word() == word)
    }

    /// The word that names the operation.
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
        let unknown = || format!("unknown operation {}", Value::Array(parts.clone()));
        let name = parts.first().and_then(Value::as_str).ok_or_else(unknown)?;
        match (name, &parts[1..]) {
            ("reset", [seed]) => Ok(Self::Reset(seed.as_u64())),
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
