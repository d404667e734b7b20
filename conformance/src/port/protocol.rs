//! The protocol `pogema-conform/1`: questions to a port and its answers, one JSON object per line.
//!
//! docs/PORTING.md explains it to authors of ports.

use pogema_core::{Collision, Metrics, Observation, Occupancy, OnGoal, Reward, TraceHeader, words};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

use crate::request::{Derived, Registered};

/// The version of the protocol.
pub const PROTOCOL: &str = "pogema-conform/1";

/// One question to a port.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
#[expect(missing_docs, reason = "the questions describe their fields")]
pub enum Ask {
    /// Asks for the port's name and claims, and names the runner's protocol. Always the first question.
    Hello { protocol: String },
    /// Begins an episode.
    Reset(Box<Beginning>),
    /// Plays one step, with one number per agent.
    Step { actions: Vec<i64> },
    /// Plays one step with the actions that the port's own policy chooses.
    Act { policy: Policy },
    /// Asks for the observations, if an answer left them out.
    Observe,
    /// Asks for the metrics of the episode, if an answer left them out.
    Metrics,
    /// Undoes the last step.
    Back,
    /// Asks for the recorded history of the episode.
    History,
    /// Ends the conversation. There is no answer.
    Bye,
}

/// The origin of an episode: an instance, a config, or the existing environment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Beginning {
    /// The complete instance, as in the first line of a trace.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instance: Option<TraceHeader>,
    /// POGEMA's config fields, for a new environment that draws its instances.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub config: Option<Value>,
    /// A map to register under a name before the config is read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub register: Option<Registered>,
    /// The argument `seed` of `reset`, which POGEMA 1.4.0 ignores.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Optional metrics to measure.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub measure: Vec<String>,
}

/// POGEMA's own policies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Policy {
    /// POGEMA's A* policy. Rule: policy/astar
    Astar,
    /// The random actions of `sample_actions`. Rule: seed/actions
    Sample,
}

/// A port's answer to [`Ask::Hello`]: its name and claims. The runner does not check what is not claimed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// Must be [`PROTOCOL`].
    pub protocol: String,
    /// The port's name.
    pub name: String,
    /// The port's version.
    #[serde(default)]
    pub version: String,
    /// The claimed profiles.
    pub profiles: Vec<Profile>,
    /// The supported collision systems.
    pub collision: Vec<Collision>,
    /// The supported modes of a reached goal.
    pub on_goal: Vec<OnGoal>,
    /// The supported types of observations; required for the profile `observations`.
    #[serde(default)]
    pub observation: Vec<Observation>,
    /// The supported modes of the occupancy grid.
    #[serde(default = "as_released")]
    pub occupancy: Vec<Occupancy>,
    /// The supported reward modes.
    #[serde(default = "own")]
    pub reward: Vec<Reward>,
    /// Whether the port supports instances with noise beyond the wall.
    #[serde(default)]
    pub noise: bool,
    /// The supported metrics; required for the profile `metrics`.
    #[serde(default)]
    pub metrics: Vec<String>,
    /// The optional keys in its answers.
    #[serde(default)]
    pub tells: Vec<ReplyKey>,
    /// The maximum number of agents [default: no limit].
    #[serde(default = "any_number")]
    pub max_agents: usize,
    /// The maximum side of a map [default: no limit].
    #[serde(default = "any_number")]
    pub max_side: usize,
    /// The maximum radius [default: no limit].
    #[serde(default = "any_number")]
    pub max_radius: usize,
}

fn as_released() -> Vec<Occupancy> {
    vec![Occupancy::AsReleased]
}

fn own() -> Vec<Reward> {
    vec![Reward::Own]
}

fn any_number() -> usize {
    usize::MAX
}

words! {
    /// A named set of rules that a port claims.
    pub enum Profile {
        /// Moves of agents, next goals, rewards and the end of the episode.
        Core = "core",
        /// Observations.
        Observations = "observations",
        /// Metrics of an episode.
        Metrics = "metrics",
        /// Maps, starts and goals drawn from a config and its seed.
        Seeding = "seeding",
        /// Undoing steps, and the list of changes.
        History = "history",
        /// POGEMA's own policies.
        Policies = "policies",
    }
}

words! {
    /// An optional key of an answer.
    pub enum ReplyKey {
        /// Whether each agent is on its goal, before goals change. Rule: goal/finish
        OnGoal = "on_goal",
        /// The cells that the occupancy grid marks. Rule: occupancy/as-released
        Occupied = "occupied",
        /// The map with its border. Rule: border/ring
        Padded = "padded",
        /// The derived config fields. Rule: config/size
        Derived = "derived",
        /// The foretold goals of each agent. Rule: goal/restart/foretold
        Foretold = "foretold",
        /// The caller's action list after the step. Rule: collide/soft/rewrite
        ActionsAfter = "actions_after",
    }
}

/// A port's answer to any question except [`Ask::Hello`].
///
/// The question and the port's claims determine the required keys.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[expect(missing_docs, reason = "each field is the key with the same name, explained in docs/PORTING.md")]
pub struct Reply {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cells: Option<Vec<WireCell>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub goals: Option<Vec<WireCell>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub active: Option<Vec<bool>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub on_goal: Option<Vec<bool>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub occupied: Option<Vec<WireCell>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rewards: Option<Vec<f32>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terminated: Option<Vec<bool>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truncated: Option<Vec<bool>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub observations: Option<Value>,
    /// `null` means that there are no metrics yet.
    #[serde(skip_serializing_if = "Key::is_left_out")]
    pub metrics: Key<Metrics>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub actions: Option<Vec<i64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub actions_after: Option<Vec<i64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub map: Option<Vec<String>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub padded: Option<Vec<String>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub derived: Option<Derived>,
    #[serde(skip_serializing_if = "Key::is_left_out")]
    pub foretold: Key<Vec<Vec<WireCell>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moved: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub full: Option<Vec<Vec<WireChange>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub changes: Option<Vec<Vec<WireChange>>>,
}

/// A row and a column. A faulty port may give numbers outside the map.
pub type WireCell = [i64; 2];

/// Row, column, row and column of the goal, step, and whether the agent is active. As in [`WireCell`],
/// numbers may be out of range.
pub type WireChange = (i64, i64, i64, i64, i64, bool);

/// A key that may be absent. `null` differs from an absent key.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Key<T> {
    /// The key is absent.
    #[default]
    LeftOut,
    /// The key is present, with the value `null`.
    Null,
    /// The key is present, with a value.
    Given(T),
}

impl<T> Key<T> {
    /// Returns whether the key is absent.
    pub fn is_left_out(&self) -> bool {
        matches!(self, Self::LeftOut)
    }

    /// Returns the value, if any.
    pub fn given(self) -> Option<T> {
        match self {
            Self::LeftOut | Self::Null => None,
            Self::Given(value) => Some(value),
        }
    }
}

impl<T> From<Option<T>> for Key<T> {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Null, Self::Given)
    }
}

impl<T: Serialize> Serialize for Key<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::LeftOut | Self::Null => serializer.serialize_none(),
            Self::Given(value) => value.serialize(serializer),
        }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Key<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Option::deserialize(deserializer).map(Self::from)
    }
}
