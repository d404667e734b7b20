//! POGEMA's `GridConfig`: the complete description of an environment.

mod check;
mod fields;
mod parse;
mod placement;
mod read;
mod write;

use pogema_core::{Cell, Collision, Config, Map, Observation, Occupancy, OnGoal, Reward, words};
use serde::Serialize;

pub(crate) use fields::cells as cells_of;
pub use fields::{FIELDS, did_you_mean};
pub use parse::{value_from_json, value_from_yaml, yaml_document};
pub(crate) use read::read_targets;

/// A checked config under POGEMA's field names, with the values that POGEMA derives.
///
/// Created by [`GridConfig::from_yaml`], [`GridConfig::from_json`] or [`GridConfig::from_value`].
///
/// Rule: config/fields, config/size, config/map, config/agents
///
/// Source: POGEMA 1.4.0, `grid_config.py`, `GridConfig`
#[derive(Clone, Debug, PartialEq)]
pub struct GridConfig {
    /// What happens when an agent reaches its goal.
    pub on_target: OnGoal,
    /// Seed of every random stream. If `None`, each stream takes a fresh seed from the operating system when it opens.
    pub seed: Option<u64>,
    /// Number of columns; requires `height`, unless a map is given [default: `size`]. A given map replaces it.
    pub width: usize,
    /// Number of rows; requires `width`, unless a map is given [default: `size`]. A given map replaces it.
    pub height: usize,
    /// Number of rows and columns if `width` and `height` are absent. After reading, it holds the larger of the two.
    pub size: usize,
    /// Share of obstacles: the requested share, or that of the given map.
    pub density: f64,
    /// Number of cells that an agent sees in each direction.
    pub obs_radius: usize,
    /// Explicit starts. Used only together with `targets_xy`; otherwise starts are drawn.
    pub agents_xy: Option<Vec<Cell>>,
    /// Explicit goals. First goals are drawn unless `agents_xy` is given, too.
    pub targets_xy: Option<Targets>,
    /// Number of agents. If absent, the number of explicit starts, else 1. Start letters in the map take precedence.
    pub num_agents: usize,
    /// Cells that starts are drawn from. The cells that a map text marks replace them.
    pub possible_agents_xy: Option<Vec<Cell>>,
    /// Cells that goals are drawn from. The cells that a map text marks replace them.
    pub possible_targets_xy: Option<Vec<Cell>>,
    /// How conflicts are resolved.
    pub collision_system: Collision,
    /// Whether steps are kept and can be undone.
    pub persistent: bool,
    /// What agents observe.
    pub observation_type: Observation,
    /// An explicit map. The map of `map_name` replaces it; if neither is given, the map is random.
    pub map: Option<Map>,
    /// Name of a registered map.
    pub map_name: Option<String>,
    /// The framework to wrap the environment for; used only by the Python package. `rllib` is an error, as in POGEMA.
    pub integration: Option<Integration>,
    /// Maximum length of an episode. Units: steps.
    pub max_episode_steps: i64,
    /// Whether the `SampleFactory` wrapper resets automatically. If absent, it does.
    pub auto_reset: Option<bool>,
    /// Whether the cells beyond the wall are free rather than random obstacles.
    pub empty_outside: bool,
    /// Extension of POGEMA's config: what the occupancy grid shows.
    pub occupancy: Occupancy,
    /// Extension of POGEMA's config: which agents are rewarded.
    pub reward: Reward,
    /// Extension of POGEMA's config: limits on the sides of maps and the number of agents.
    pub limits: Limits,
}

/// Explicit goals: one per agent, or a sequence per agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum Targets {
    /// One goal per agent.
    Single(Vec<Cell>),
    /// At least two goals per agent, repeated cyclically.
    Sequences(Vec<Vec<Cell>>),
}

impl Default for Targets {
    /// No agents.
    fn default() -> Self {
        Self::Single(Vec::new())
    }
}

impl Targets {
    /// Returns the number of agents that have goals.
    pub fn len(&self) -> usize {
        match self {
            Self::Single(goals) => goals.len(),
            Self::Sequences(sequences) => sequences.len(),
        }
    }

    /// Returns whether no agent has goals.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the first goal of each agent.
    pub fn first(&self) -> Vec<Cell> {
        match self {
            Self::Single(goals) => goals.clone(),
            Self::Sequences(sequences) => {
                sequences.iter().filter_map(|goals| goals.first().copied()).collect()
            }
        }
    }

    /// Returns all goals of all agents.
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
    /// Limits on the sides of maps and the number of agents.
    ///
    /// Rule: config/limits
    #[derive(Default)]
    pub enum Limits {
        /// The limits of POGEMA 1.4.0: sides up to 4096, up to 10,000,000 agents.
        #[default]
        AsReleased = "as_released",
        /// The limits of our data types: sides up to [`Map::LONGEST_SIDE`], agents up to 2³²−1.
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
    /// Returns the part that the engines need: rules and sizes.
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
