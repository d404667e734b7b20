//! Traces: recorded episodes, the common input of tests, reports, drawings and replays.

mod file;

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use crate::{Action, Cell, Config, Error, GoalStream, Instance, Map, Metrics, Outside, Snapshot};

/// The format of a header in memory, and of files of earlier versions, which lack the last line with the hash.
const FORMAT: &str = "pogema-trace/1";
/// The version of the spec whose rules this workspace follows.
pub const SPEC: &str = "pogema-1.4.0/1";

/// A recorded episode.
///
/// Its file format is JSON Lines: the header, the start, one line per step, then the number of steps and a hash.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Versions, rules and instance.
    pub header: TraceHeader,
    /// The state after the reset.
    pub start: TraceStart,
    /// Actions and results of each step.
    pub steps: Vec<TraceStep>,
}

/// The first line of a trace: versions, rules and instance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TraceHeader {
    format: String,
    spec: String,
    /// The rules and sizes.
    pub config: Config,
    /// The map without its border.
    pub map: Map,
    /// The area beyond the wall.
    #[serde(default)]
    pub outside: Outside,
    /// The start of each agent.
    pub starts: Vec<Cell>,
    /// The goals of each agent, as many as the episode could use.
    pub goals: Vec<Vec<Cell>>,
}

/// The second line of a trace: the state after the reset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TraceStart {
    /// The state.
    #[serde(flatten)]
    pub state: Snapshot,
    /// The observations of the agents, if they were recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observations: Option<Observed>,
}

/// Each further line of a trace except the last: one step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TraceStep {
    /// The action of each agent.
    pub actions: Vec<Action>,
    /// The state after the step.
    #[serde(flatten)]
    pub state: Snapshot,
    /// The reward of each agent.
    pub rewards: Vec<f32>,
    /// Which agents were terminated.
    pub terminated: Vec<bool>,
    /// Which agents were truncated.
    pub truncated: Vec<bool>,
    /// The observations of the agents, if they were recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observations: Option<Observed>,
    /// The metrics, on steps that end an episode.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metrics: Option<Metrics>,
}

/// All observation arrays of one frame, without loss.
///
/// A window of zeros and ones is one string of hex digits: two digits encode eight cells, with the first cell in the
/// highest bit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "type")]
pub enum Observed {
    /// The arrays of the `default` observation.
    ///
    /// Rule: observe/default
    #[serde(rename = "default")]
    Default {
        /// NumPy's name of the element type.
        dtype: String,
        /// One string per agent, over `[3, side, side]`.
        windows: Vec<String>,
        /// Descriptions of the values that do not fit this form.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        odd: Vec<String>,
    },
    /// The arrays of the `POMAPF` observation.
    ///
    /// Rule: observe/pomapf
    #[serde(rename = "POMAPF")]
    Pomapf(ObservedPomapf),
    /// The arrays of the `MAPF` observation.
    ///
    /// Rule: observe/mapf
    #[serde(rename = "MAPF")]
    Mapf(ObservedMapf),
}

/// The arrays of `POMAPF`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ObservedPomapf {
    /// NumPy's name of the windows' element type.
    pub dtype: String,
    /// One string per agent, over `[side, side]`.
    pub obstacles: Vec<String>,
    /// One string per agent, over `[side, side]`.
    pub agents: Vec<String>,
    /// The cell of each agent minus its start.
    pub xy: Vec<[i32; 2]>,
    /// The goal of each agent minus its start.
    pub target_xy: Vec<[i32; 2]>,
    /// Descriptions of the values that do not fit this form.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub odd: Vec<String>,
}

/// The arrays of `MAPF`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ObservedMapf {
    /// The arrays that `POMAPF` also has.
    #[serde(flatten)]
    pub pomapf: ObservedPomapf,
    /// The map with its border; absent if it is the same as at the start.
    pub global_obstacles: Option<Padded>,
    /// The cell of each agent, counted from the border's top left corner.
    pub global_xy: Vec<[i32; 2]>,
    /// The goal of each agent, counted from the border's top left corner.
    pub global_target_xy: Vec<[i32; 2]>,
}

/// A map with its border, and the element type that POGEMA stores it in.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Padded {
    /// NumPy's name of the element type: `float64` if the outside is free, `int64` if it is noise.
    pub dtype: String,
    /// Lines of `.` and `#`.
    pub rows: Vec<String>,
}

impl TraceHeader {
    /// Creates the header of an episode, with `num_goals` goals listed for each agent.
    pub fn new(config: Config, instance: &Instance, num_goals: usize) -> Self {
        Self {
            format: FORMAT.into(),
            spec: SPEC.into(),
            config,
            map: instance.map().clone(),
            outside: instance.outside().clone(),
            starts: instance.starts().to_vec(),
            goals: instance.goals().iter().map(|stream| stream.list(num_goals.max(1))).collect(),
        }
    }

    /// Returns the instance for playing the trace again. Each list of goals repeats cyclically.
    ///
    /// # Errors
    /// If the instance of the header cannot be played.
    pub fn instance(&self) -> Result<Instance, Error> {
        let mut streams = Vec::with_capacity(self.goals.len());
        for (agent, goals) in self.goals.iter().enumerate() {
            let first = *goals.first().ok_or_else(|| Error::agent(agent, "has no goal"))?;
            streams.push(GoalStream::sequence(first, goals.clone().into()));
        }
        Instance::new(self.map.clone(), self.outside.clone(), self.starts.clone(), streams)
    }

    /// Checks that an engine can play the config and instance of the header.
    fn check(&self) -> Result<(), Error> {
        self.config.check()?;
        self.instance()?.check_fits(&self.config)
    }
}

impl Trace {
    /// Creates a trace without steps, which shows an instance.
    ///
    /// Its state is that after a reset, except that `on_goal` is false and `occupied` is empty.
    pub fn still(config: Config, instance: &Instance) -> Self {
        let num_agents = instance.starts().len();
        let state = Snapshot {
            cells: instance.starts().to_vec(),
            goals: instance.first_goals(),
            active: vec![true; num_agents],
            on_goal: vec![false; num_agents],
            occupied: Vec::new(),
        };
        let start = TraceStart { state, observations: None };
        Self { header: TraceHeader::new(config, instance, 1), start, steps: Vec::new() }
    }

    /// Returns the state after the reset and after each step: one state more than the number of steps.
    pub fn states(&self) -> impl Iterator<Item = &Snapshot> {
        std::iter::once(&self.start.state).chain(self.steps.iter().map(|step| &step.state))
    }

    /// Returns the state at a frame: 0 is after the reset, 1 after the first step.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the episode ends earlier.
    pub fn state(&self, frame: usize) -> Result<&Snapshot, Error> {
        let state = match frame.checked_sub(1) {
            None => Some(&self.start.state),
            Some(step) => self.steps.get(step).map(|step| &step.state),
        };
        state.ok_or_else(|| Error::out_of_range("frame", frame, format!("0 to {}", self.steps.len())))
    }

    /// Returns the part of the episode from one frame to another, both included.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the range is empty or the episode ends earlier.
    pub fn part(&self, frames: RangeInclusive<usize>) -> Result<Self, Error> {
        let (first, last) = (*frames.start(), *frames.end());
        if first > last {
            let expected = "a first frame that is not after the last";
            return Err(Error::out_of_range("range of frames", format!("{first}..{last}"), expected));
        }
        self.state(last)?;
        let start = TraceStart { state: self.state(first)?.clone(), observations: None };
        Ok(Self { header: self.header.clone(), start, steps: self.steps[first..last].to_vec() })
    }
}
