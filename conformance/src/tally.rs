//! Counts of comparisons and divergences, rule by rule.

use std::collections::BTreeMap;

use pogema_core::{Collision, Observation, Occupancy, OnGoal, Reward};
use pogema_maps::GridConfig;
use serde::Serialize;

/// The number of comparisons and divergences of each rule.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// The counts by rule name.
    pub rules: BTreeMap<String, Count>,
}

/// Numbers of comparisons and divergences.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Count {
    /// Comparisons made.
    pub checked: u64,
    /// Comparisons that failed.
    pub diverged: u64,
}

impl Tally {
    /// Counts one comparison under a rule.
    pub fn count(&mut self, rule: &str, holds: bool) {
        // Most rules exist already, so the name is only copied for a new rule.
        if !self.rules.contains_key(rule) {
            self.rules.insert(rule.to_owned(), Count::default());
        }
        if let Some(count) = self.rules.get_mut(rule) {
            count.checked += 1;
            count.diverged += u64::from(!holds);
        }
    }

    /// Adds another tally.
    pub fn add(&mut self, other: &Self) {
        for (rule, count) in &other.rules {
            let sum = self.rules.entry(rule.clone()).or_default();
            sum.checked += count.checked;
            sum.diverged += count.diverged;
        }
    }
}

/// The rules that apply to a config, one for each compared aspect.
#[derive(Clone, Copy, Debug)]
pub struct ConfigRules {
    /// The rule of starts and goals.
    pub place: &'static str,
    /// The rule of conflicting moves.
    pub collide: &'static str,
    /// The rule of a reached goal.
    pub goal: &'static str,
    /// The rule of the rewards.
    pub reward: &'static str,
    /// The rule of observations.
    pub observe: &'static str,
    /// The rule of the occupancy grid.
    pub occupancy: &'static str,
    /// The rule of the metrics.
    pub metrics: &'static str,
}

/// Returns the rules that apply to a config.
pub fn rules_of(config: &GridConfig) -> ConfigRules {
    let place = match (config.explicit_placement().is_some(), config.pools().is_some()) {
        (true, _) => "place/explicit",
        (false, true) => "place/pools",
        (false, false) => "place/pairs",
    };
    let collide = match config.collision_system {
        Collision::Priority => "collide/priority",
        Collision::BlockBoth => "collide/block-both",
        Collision::Soft => "collide/soft",
    };
    let (goal, metrics) = match config.on_target {
        OnGoal::Finish => ("goal/finish", "metrics/finish"),
        OnGoal::Nothing => ("goal/nothing", "metrics/nothing"),
        OnGoal::Restart => ("goal/restart", "metrics/restart"),
    };
    let observe = match config.observation_type {
        Observation::Default => "observe/default",
        Observation::Pomapf => "observe/pomapf",
        Observation::Mapf => "observe/mapf",
    };
    let occupancy = match config.occupancy {
        Occupancy::AsReleased => "occupancy/as-released",
        Occupancy::Exact => "occupancy/exact",
    };
    let reward = match config.reward {
        Reward::Own => "reward/own",
        Reward::Shared => "reward/shared",
    };
    ConfigRules { place, collide, goal, reward, observe, occupancy, metrics }
}
