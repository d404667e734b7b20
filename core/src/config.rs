//! The config of an episode, which determines its rules and, with the size of the map, the shape of every array.

use serde::{Deserialize, Serialize};

use crate::Error;

crate::words! {
    /// How conflicting moves are resolved.
    #[derive(Default)]
    pub enum Collision {
        /// Agents move one after another, lowest index first.
        ///
        /// Rule: collide/priority
        #[default]
        Priority = "priority",
        /// No agent enters a cell that is occupied or that another agent also requests.
        ///
        /// Rule: collide/block-both
        BlockBoth = "block_both",
        /// All agents move simultaneously, and only impossible moves are reverted.
        ///
        /// Rule: collide/soft
        Soft = "soft",
    }
}

crate::words! {
    /// The effect of reaching a goal.
    #[derive(Default)]
    pub enum OnGoal {
        /// The agent leaves the map.
        ///
        /// Rule: goal/finish
        #[default]
        Finish = "finish",
        /// Nothing happens until all agents are on their goals in the same step.
        ///
        /// Rule: goal/nothing
        Nothing = "nothing",
        /// The agent gets its next goal.
        ///
        /// Rule: goal/restart
        Restart = "restart",
    }
}

crate::words! {
    /// The cells that the occupancy grid marks after a step.
    #[derive(Default)]
    pub enum Occupancy {
        /// The cells that POGEMA 1.4.0 marks; under `soft`, some agents are not marked.
        ///
        /// Rule: occupancy/as-released
        #[default]
        AsReleased = "as_released",
        /// The cell of every active agent.
        ///
        /// Rule: occupancy/exact
        Exact = "exact",
    }
}

crate::words! {
    /// The arrays that an agent observes.
    #[derive(Default)]
    pub enum Observation {
        /// Three windows: obstacles, agents, goal.
        ///
        /// Rule: observe/default
        #[default]
        Default = "default",
        /// Two windows, and positions relative to the start.
        ///
        /// Rule: observe/pomapf
        Pomapf = "POMAPF",
        /// The arrays of POMAPF, the absolute positions of the agent and its goal, and the whole map.
        ///
        /// Rule: observe/mapf
        Mapf = "MAPF",
    }
}

crate::words! {
    /// The reward of each agent after a step.
    #[derive(Default)]
    pub enum Reward {
        /// The rewards of POGEMA 1.4.0.
        ///
        /// An agent gets 1 when it reaches its goal; under `nothing`, every agent gets 1 when all are on their goals.
        ///
        /// Rule: reward/own
        #[default]
        Own = "own",
        /// Every agent gets the share of agents on their goals.
        ///
        /// Rule: reward/shared
        Shared = "shared",
    }
}

/// The rules and sizes of an episode; together with an [`crate::Instance`] and the actions they determine every array.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Number of agents, at least 1.
    pub num_agents: usize,
    /// Number of cells that an agent sees in each direction, 1 to 128.
    pub radius: usize,
    /// The number of steps after which the episode is truncated; values ≤ 0 mean after the first step.
    pub max_steps: i64,
    /// The collision system.
    pub collision: Collision,
    /// The effect of reaching a goal.
    pub on_goal: OnGoal,
    /// The arrays that an agent observes.
    pub observation: Observation,
    /// The cells that the occupancy grid marks.
    #[serde(default)]
    pub occupancy: Occupancy,
    /// The reward of each agent after a step.
    #[serde(default)]
    pub reward: Reward,
    /// Whether steps are kept, so that they can be undone. Rule: history/step-back
    #[serde(default)]
    pub persistent: bool,
}

impl Config {
    /// Largest radius that POGEMA accepts.
    pub const LARGEST_RADIUS: usize = 128;

    /// Returns the side of an agent's window. Units: cells.
    pub fn side(&self) -> usize {
        2 * self.radius + 1
    }

    /// Returns the number of values in the `default` observation of all agents: `[agents, 3, side, side]`.
    pub fn num_observed(&self) -> usize {
        self.num_agents * 3 * self.side() * self.side()
    }

    /// Checks that every field is in its range.
    ///
    /// # Errors
    /// [`Error::Config`] naming the first field that is out of range.
    pub fn check(&self) -> Result<(), Error> {
        if self.num_agents == 0 {
            return Err(Error::config("num_agents", self.num_agents, "at least 1"));
        }
        if !(1..=Self::LARGEST_RADIUS).contains(&self.radius) {
            return Err(Error::config("radius", self.radius, format!("1 to {}", Self::LARGEST_RADIUS)));
        }
        Ok(())
    }
}

impl Default for Config {
    fn default() -> Self {
        Self {
            num_agents: 1,
            radius: 5,
            max_steps: 64,
            collision: Collision::default(),
            on_goal: OnGoal::default(),
            observation: Observation::default(),
            occupancy: Occupancy::default(),
            reward: Reward::default(),
            persistent: false,
        }
    }
}
