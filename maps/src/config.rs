//! POGEMA's `GridConfig`: one file that says everything about an environment.

mod check;
mod fields;
mod parse;
mod read;
mod write;

use pogema_core::{Cell, Collision, Config, Map, Observation, Occupancy, OnGoal, Reward, words};
use serde::Serialize;

pub(crate) use fields::cells as cells_of;
pub use fields::{FIELDS, nearest};
pub use parse::{value_from_json, value_from_yaml, yaml_document};
pub(crate) use read::read_targets;

/// A config under POGEMA's names, checked and with everything derived that POGEMA derives.
///
/// Made by [`GridConfig::from_yaml`], [`GridConfig::from_json`] or [`GridConfig::from_value`].
///
/// Rule: config/fields, config/size, config/map, config/agents
///
/// Source: POGEMA 1.4.0, `grid_config.py`, `GridConfig`
#[derive(Clone, Debug, PartialEq)]
pub struct GridConfig {
    /// What reaching a goal does.
    pub on_target: OnGoal,
    /// Seed of every random stream; none means a fresh one from the system at each reset.
    pub seed: Option<u64>,
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// The longer side.
    pub size: usize,
    /// Share of obstacles: the wanted one, or that of the given map.
    pub density: f64,
    /// How far agents see.
    pub obs_radius: usize,
    /// Explicit starts.
    pub agents_xy: Option<Vec<Cell>>,
    /// Explicit goals.
    pub targets_xy: Option<Targets>,
    /// Number of agents.
    pub num_agents: usize,
    /// Cells that starts are drawn from.
    pub possible_agents_xy: Option<Vec<Cell>>,
    /// Cells that goals are drawn from.
    pub possible_targets_xy: Option<Vec<Cell>>,
    /// How conflicts are resolved.
    pub collision_system: Collision,
    /// Whether steps are kept and can be taken back.
    pub persistent: bool,
    /// What agents observe.
    pub observation_type: Observation,
    /// An explicit map.
    pub map: Option<Map>,
    /// Name of a registered map.
    pub map_name: Option<String>,
    /// The framework to wrap for; meaningful to the Python package alone.
    pub integration: Option<Integration>,
    /// Units: steps.
    pub max_episode_steps: i64,
    /// Whether the `SampleFactory` wrapper resets by itself.
    pub auto_reset: Option<bool>,
    /// Whether there are free cells, and not random obstacles, beyond the wall.
    pub empty_outside: bool,
    /// Ours, not POGEMA's: what the occupancy grid shows.
    pub occupancy: Occupancy,
    /// Ours, not POGEMA's: who is rewarded.
    pub reward: Reward,
    /// Ours, not POGEMA's: how large maps and crowds may be.
    pub limits: Limits,
}

/// Explicit goals: one per agent, or a sequence per agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum Targets {
    /// One goal per agent.
    Single(Vec<Cell>),
    /// At least two goals per agent, gone through round and round.
    Sequences(Vec<Vec<Cell>>),
}

impl Targets {
    /// Number of agents that have goals.
    pub fn len(&self) -> usize {
        match self {
            Self::Single(goals) => goals.len(),
            Self::Sequences(sequences) => sequences.len(),
        }
    }

    /// Whether no agent has goals.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The first goal of each agent.
    pub fn first(&self) -> Vec<Cell> {
        match self {
            Self::Single(goals) => goals.clone(),
            Self::Sequences(sequences) => {
                sequences.iter().filter_map(|goals| goals.first().copied()).collect()
            }
        }
    }

    /// The goals of all agents.
    pub(crate) fn all(&self) -> Vec<Cell> {
        match self {
            Self::Single(goals) => goals.clone(),
            Self::Sequences(sequences) => sequences.concat(),
        }
    }
}

words! {
    /// The frameworks POGEMA can wrap an environment for.
    pub enum Integration {
        /// Sample Factory.
        SampleFactory = "SampleFactory",
        /// PyMARL.
        PyMarl = "PyMARL",
        /// RLlib.
        Rllib = "rllib",
        /// Gymnasium.
        Gymnasium = "gymnasium",
        /// PettingZoo.
        PettingZoo = "PettingZoo",
    }
}

words! {
    /// The largest maps and crowds.
    ///
    /// Rule: config/limits
    #[derive(Default)]
    pub enum Limits {
        /// As POGEMA 1.4.0: sides up to 4096, up to 10,000,000 agents.
        #[default]
        AsReleased = "as_released",
        /// As our types: sides up to [`Map::LONGEST_SIDE`], agents up to 2³²−1.
        Extended = "extended",
    }
}

impl Default for GridConfig {
    fn default() -> Self {
        Self {
            on_target: OnGoal::Finish,
            seed: None,
            width: 8,
            height: 8,
            size: 8,
            density: 0.3,
            obs_radius: 5,
            agents_xy: None,
            targets_xy: None,
            num_agents: 1,
            possible_agents_xy: None,
            possible_targets_xy: None,
            collision_system: Collision::Priority,
            persistent: false,
            observation_type: Observation::Default,
            map: None,
            map_name: None,
            integration: None,
            max_episode_steps: 64,
            auto_reset: None,
            empty_outside: true,
            occupancy: Occupancy::AsReleased,
            reward: Reward::Own,
            limits: Limits::AsReleased,
        }
    }
}

impl GridConfig {
    /// The part that the engines need: rules and sizes.
    pub fn rules(&self) -> Config {
        Config {
            num_agents: self.num_agents,
            radius: self.obs_radius,
            max_steps: self.max_episode_steps,
            collision: self.collision_system,
            on_goal: self.on_target,
            observation: self.observation_type,
            occupancy: self.occupancy,
            reward: self.reward,
            persistent: self.persistent,
        }
    }
}
