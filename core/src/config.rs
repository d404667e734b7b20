//! What fixes every shape and every rule of an episode.

use serde::{Deserialize, Serialize};

use crate::Error;

crate::words! {
    /// How conflicting moves are resolved.
    #[derive(Default)]
    pub enum Collision {
        /// One agent after another, lowest index first. Rule: collide/priority
        #[default]
        Priority = "priority",
        /// No agent enters a cell that is occupied or wanted by two. Rule: collide/block-both
        BlockBoth = "block_both",
        /// All at once; only impossible moves are taken back. Rule: collide/soft
        Soft = "soft",
    }
}

crate::words! {
    /// What happens when an agent reaches its goal.
    #[derive(Default)]
    pub enum OnGoal {
        /// The agent leaves the map. Rule: goal/finish
        #[default]
        Finish = "finish",
        /// Nothing, until all agents are on their goals at once. Rule: goal/nothing
        Nothing = "nothing",
        /// The agent gets its next goal. Rule: goal/restart
        Restart = "restart",
    }
}

crate::words! {
    /// What the occupancy grid shows after a step.
    #[derive(Default)]
    pub enum Occupancy {
        /// As POGEMA 1.4.0 leaves it, which under `soft` loses agents. Rule: occupancy/as-released
        #[default]
        AsReleased = "as_released",
        /// Every active agent's cell. Rule: occupancy/exact
        Exact = "exact",
    }
}

crate::words! {
    /// Which arrays an agent observes.
    #[derive(Default)]
    pub enum Observation {
        /// Three windows: obstacles, agents, goal. Rule: observe/default
        #[default]
        Default = "default",
        /// Two windows and positions relative to the start. Rule: observe/pomapf
        Pomapf = "POMAPF",
        /// The same and the whole map. Rule: observe/mapf
        Mapf = "MAPF",
    }
}

crate::words! {
    /// Which agents are rewarded for a goal.
    #[derive(Default)]
    pub enum Reward {
        /// As POGEMA 1.4.0 pays it. Rule: reward/own
        #[default]
        Own = "own",
        /// The share of agents on their goals, to every agent. Rule: reward/shared
        Shared = "shared",
    }
}

/// The rules and sizes of an episode; with an [`crate::Instance`] and actions it fixes every array.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Number of agents, at least 1.
    pub num_agents: usize,
    /// How far an agent sees in each direction, 1 to 128.
    pub radius: usize,
    /// Units: steps. The episode is cut off after so many; 0 and less mean after the first.
    pub max_steps: i64,
    /// How conflicts are resolved.
    pub collision: Collision,
    /// What reaching a goal does.
    pub on_goal: OnGoal,
    /// What agents observe.
    pub observation: Observation,
    /// What the occupancy grid shows.
    #[serde(default)]
    pub occupancy: Occupancy,
    /// Who is rewarded.
    #[serde(default)]
    pub reward: Reward,
    /// Whether steps are kept, so that they can be taken back. Rule: history/step-back
    #[serde(default)]
    pub persistent: bool,
}

impl Config {
    /// Largest radius POGEMA accepts.
    pub const LARGEST_RADIUS: usize = 128;

    /// Side of an agent's window.
    pub fn side(&self) -> usize {
        2 * self.radius + 1
    }

    /// Number of values in the `default` observation of all agents: `[agents, 3, side, side]`.
    pub fn num_observed(&self) -> usize {
        self.num_agents * 3 * self.side() * self.side()
    }

    /// Passes if every field is in its range.
    ///
    /// # Errors
    /// [`Error::Config`] naming the first field that is not.
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
