//! The claims that a vector requires of an implementation.

use pogema_core::{Collision, Observation, Occupancy, OnGoal, Reward, Words as _};
use pogema_maps::GridConfig;
use serde::Serialize;

use crate::port::{Mode, Profile, ReplyKey, keys_needed_by, metrics_of, profile_of};
use crate::request::{Op, Request, Response};
use crate::tally::rules_of;

/// The claims that a vector requires, under the keys of an answer to `hello`.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Needs {
    profiles: Vec<Profile>,
    #[serde(flatten)]
    rules: Option<Rules>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    metrics: Vec<&'static str>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    tells: Vec<ReplyKey>,
}

/// The rules and sizes of a valid config.
#[derive(Clone, Debug, Serialize)]
struct Rules {
    collision: [Collision; 1],
    on_goal: [OnGoal; 1],
    observation: [Observation; 1],
    occupancy: [Occupancy; 1],
    reward: [Reward; 1],
    noise: bool,
    max_agents: usize,
    max_side: usize,
    max_radius: usize,
}

impl Needs {
    /// Returns the claims that a request requires when it tests a rule in a mode.
    pub fn of(rule: &str, mode: Mode, request: &Request, played: &Response) -> Self {
        let has = |ops: &[Op]| request.ops.iter().any(|op| ops.contains(op));
        let mut profiles = vec![Profile::Core, profile_of(rule)];
        profiles.extend((mode == Mode::Config).then_some(Profile::Seeding));
        profiles.extend(has(&[Op::Back, Op::History]).then_some(Profile::History));
        profiles.extend(has(&[Op::Astar, Op::Sample]).then_some(Profile::Policies));
        let config = GridConfig::from_value(&request.config).ok();
        let mut metrics = Vec::new();
        if let Some(config) = config.as_ref().filter(|config| rules_of(config).metrics == rule) {
            metrics.extend(metrics_of(config.on_target));
        }
        metrics.extend(request.density.then_some("avg_agents_density"));
        metrics.extend(request.collisions.then_some(["a_collisions", "o_collisions"]).into_iter().flatten());
        profiles.extend((!metrics.is_empty()).then_some(Profile::Metrics));
        let profiles = Profile::all().filter(|profile| profiles.contains(profile)).collect();
        let tells = keys_needed_by(rule).map(|(key, _)| key).collect();
        Self { profiles, rules: config.map(|config| Rules::of(&config, played)), metrics, tells }
    }
}

impl Rules {
    fn of(config: &GridConfig, played: &Response) -> Self {
        let rules = config.rules();
        Self {
            collision: [rules.collision],
            on_goal: [rules.on_goal],
            observation: [rules.observation],
            occupancy: [rules.occupancy],
            reward: [rules.reward],
            noise: !config.empty_outside,
            max_agents: rules.num_agents,
            max_side: played.longest_side(),
            max_radius: config.obs_radius,
        }
    }
}
