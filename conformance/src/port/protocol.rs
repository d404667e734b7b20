//! `pogema-conform/1`: what is asked of a port and what it answers, one JSON object a line.
//!
//! docs/PORTING.md explains it to those who write ports.

use pogema_core::{
    Cell, Change, Collision, Metrics, Observation, Occupancy, OnGoal, Reward, TraceHeader, words,
};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

use crate::request::{Derived, Registered};

/// The protocol that this version speaks.
pub const PROTOCOL: &str = "pogema-conform/1";

/// One question to a port.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
#[expect(missing_docs, reason = "the questions describe their fields")]
pub enum Ask {
    /// Who are you, and what do you claim? Always the first. Names the protocol that the runner speaks.
    Hello { protocol: String },
    /// Begin an episode.
    Reset(Box<Beginning>),
    /// Play one step, with one number for each agent.
    Step { actions: Vec<i64> },
    /// Play one step with the actions that a policy of your own chooses.
    Act { policy: Policy },
    /// What do the agents see? Asked where an answer left it out.
    Observe,
    /// What are the figures of the episode? Asked where an answer left them out.
    Metrics,
    /// Take the last step back.
    Back,
    /// What have you kept of the episode?
    History,
    /// The end; no answer is awaited.
    Bye,
}

/// What an episode begins from: an instance, a config, or the environment that is there already.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Beginning {
    /// Everything but the actions, as in the first line of a trace.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instance: Option<TraceHeader>,
    /// POGEMA's config fields, for a new environment that draws everything itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub config: Option<Value>,
    /// A map to register under a name before the config is read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub register: Option<Registered>,
    /// The seed handed to `reset`, which POGEMA 1.4.0 ignores.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Figures that are only measured when asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub measure: Vec<String>,
}

/// POGEMA's own policies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Policy {
    /// Its A* policy. Rule: policy/astar
    Astar,
    /// What `sample_actions` draws. Rule: seed/actions
    Sample,
}

/// A port's answer to [`Ask::Hello`]: who it is and what it claims. What is not claimed is not asked.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// Must be [`PROTOCOL`].
    pub protocol: String,
    /// The port's name.
    pub name: String,
    /// The port's version.
    #[serde(default)]
    pub version: String,
    /// The named sets of rules that it claims.
    pub profiles: Vec<Profile>,
    /// How it can resolve conflicts.
    pub collision: Vec<Collision>,
    /// What reaching a goal can do.
    pub on_goal: Vec<OnGoal>,
    /// What its agents can see; needed for the profile `observations`.
    #[serde(default)]
    pub observation: Vec<Observation>,
    /// What its occupancy grid can show.
    #[serde(default = "as_released")]
    pub occupancy: Vec<Occupancy>,
    /// Who can be rewarded.
    #[serde(default = "own")]
    pub reward: Vec<Reward>,
    /// Whether an instance may have noise beyond the wall.
    #[serde(default)]
    pub noise: bool,
    /// The figures it measures; needed for the profile `metrics`.
    #[serde(default)]
    pub metrics: Vec<String>,
    /// The further keys that its answers hold.
    #[serde(default)]
    pub tells: Vec<Told>,
    /// The most agents it can play with.
    #[serde(default = "any_number")]
    pub max_agents: usize,
    /// The longest side of a map it can play on.
    #[serde(default = "any_number")]
    pub max_side: usize,
    /// The largest radius.
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
        /// Which agents move, the next goals, rewards and the end of the episode.
        Core = "core",
        /// What agents see.
        Observations = "observations",
        /// The figures of an episode.
        Metrics = "metrics",
        /// Maps, starts and goals drawn from a config and its seed.
        Seeding = "seeding",
        /// Steps taken back, and the list of changes.
        History = "history",
        /// POGEMA's own policies.
        Policies = "policies",
    }
}

words! {
    /// A key of an answer that not every port can give.
    pub enum Told {
        /// The agents on their goals, before goals change. Rule: goal/finish
        OnGoal = "on_goal",
        /// The cells that the occupancy grid marks. Rule: occupancy/as-released
        Occupied = "occupied",
        /// The map with its border. Rule: border/ring
        Padded = "padded",
        /// The fields that the config derives. Rule: config/size
        Derived = "derived",
        /// The goals foretold for each agent. Rule: goal/restart/foretold
        Foretold = "foretold",
        /// The caller's list of actions after the step. Rule: collide/soft/rewrite
        ActionsAfter = "actions_after",
    }
}

/// A port's answer to anything else; which keys it needs depends on the question and on what the port claims.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[expect(missing_docs, reason = "each is the key of its name, explained in docs/PORTING.md")]
pub struct Reply {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cells: Option<Vec<ToldCell>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub goals: Option<Vec<ToldCell>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub active: Option<Vec<bool>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub on_goal: Option<Vec<bool>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub occupied: Option<Vec<ToldCell>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rewards: Option<Vec<f32>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terminated: Option<Vec<bool>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truncated: Option<Vec<bool>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub observations: Option<Value>,
    /// `null` is an answer: there are no figures yet.
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
    pub foretold: Key<Vec<Vec<Cell>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moved: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub full: Option<Vec<Vec<Change>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub changes: Option<Vec<Vec<Change>>>,
}

/// A row and a column, which a wrong port may count off the map.
pub type ToldCell = [i64; 2];

/// A key that may be left out, and may be `null`, which is an answer too.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Key<T> {
    /// It is not there.
    #[default]
    LeftOut,
    /// It is there, and says that there is nothing.
    Null,
    /// It is there.
    Given(T),
}

impl<T> Key<T> {
    /// Whether it is not there.
    pub fn is_left_out(&self) -> bool {
        matches!(self, Self::LeftOut)
    }

    /// What it gives, if anything.
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
