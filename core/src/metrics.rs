//! The metrics of an episode, accumulated step by step.
//!
//! They are independent of the engines, because the same formulas apply to the episodes of every engine.

mod collisions;
mod density;

use serde::{Deserialize, Serialize};

use crate::{Config, OnGoal};

pub use collisions::CollisionMeter;
pub use density::{DensityMeter, Seen, pairwise_mean};

/// Defines the metrics, each with POGEMA's name for it.
macro_rules! define_metrics {
    ($(#[doc = $doc:literal] $field:ident = $name:literal,)+) => {
        /// The metrics of one episode, under POGEMA's names. A metric that does not apply to the mode is absent.
        ///
        /// Rule: metrics/finish, metrics/nothing, metrics/restart
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
        #[serde(default)]
        pub struct Metrics {
            $(
                #[doc = $doc]
                #[serde(rename = $name, skip_serializing_if = "Option::is_none")]
                pub $field: Option<f64>,
            )+
        }

        impl Metrics {
            /// Returns the metrics that are present, with their names.
            pub fn named(&self) -> Vec<(&'static str, f64)> {
                let all = [$(($name, self.$field)),+];
                all.into_iter().filter_map(|(name, value)| value.map(|value| (name, value))).collect()
            }
        }
    };
}

define_metrics! {
    /// Share of agents that reached their goals.
    isr = "ISR",
    /// 1 if all agents reached their goals, else 0.
    csr = "CSR",
    /// Episode length; under `finish`, the mean over agents of the steps to their goals or to the end. Units: steps.
    ep_length = "ep_length",
    /// Sum of costs. Units: steps.
    soc = "SoC",
    /// Makespan. Units: steps.
    makespan = "makespan",
    /// Throughput of all agents together. Units: goals per step.
    avg_throughput = "avg_throughput",
    /// Agents per free cell of a window.
    avg_agents_density = "avg_agents_density",
    /// Moves that another agent prevented.
    a_collisions = "a_collisions",
    /// Moves that an obstacle prevented.
    o_collisions = "o_collisions",
}

/// Counts goals and steps and computes the metrics of the episode when it ends.
///
/// Rule: metrics/finish, metrics/nothing, metrics/restart
///
/// Source: POGEMA 1.4.0, `wrappers/metrics.py`
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EpisodeMeter {
    on_goal_mode: OnGoal,
    max_steps: i64,
    step: u64,
    num_reached: u64,
    /// The 0-based step in which each agent reached its goal, or [`NEVER`].
    arrived: Vec<u64>,
}

/// The largest step count that a saved meter or engine state may hold. No episode is that long, and sums of 2²³
/// such numbers do not overflow.
pub const LARGEST_STEP: u64 = 1 << 40;

/// A number larger than any step.
const NEVER: u64 = u64::MAX;

impl EpisodeMeter {
    /// Creates a meter for episodes of this config.
    pub fn new(config: &Config) -> Self {
        Self {
            on_goal_mode: config.on_goal,
            max_steps: config.max_steps,
            step: 0,
            num_reached: 0,
            arrived: vec![NEVER; config.num_agents],
        }
    }

    /// Returns the number of agents that are measured.
    pub fn num_agents(&self) -> usize {
        self.arrived.len()
    }

    /// Returns whether an episode can have these counts. Counts that were read from a file may be anything.
    pub fn is_plausible(&self) -> bool {
        let arrivals = self.arrived.iter().filter(|&&arrived| arrived != NEVER);
        let counts = [&self.step, &self.num_reached].into_iter().chain(arrivals);
        counts.copied().all(|count| count <= LARGEST_STEP)
    }

    /// Sets the length of an episode over which throughput is measured, without resetting the counters. Units: steps.
    pub fn measure_over(&mut self, max_steps: i64) {
        self.max_steps = max_steps;
    }

    /// Discards an unfinished episode, which POGEMA 1.4.0 would count into the next one.
    pub fn reset(&mut self) {
        self.step = 0;
        self.num_reached = 0;
        self.arrived.fill(NEVER);
    }

    /// Counts one step and returns the metrics if it ended the episode.
    pub fn feed(&mut self, on_goal: &[bool], terminated: &[bool], truncated: &[bool]) -> Option<Metrics> {
        let finished = terminated.iter().all(|&ended| ended) || truncated.iter().all(|&cut| cut);
        self.num_reached += on_goal.iter().filter(|&&reached| reached).count() as u64;
        // An agent that leaves its goal loses its arrival. On the last step, however, an agent that has just left its
        // goal keeps its earlier arrival.
        let forgets = self.on_goal_mode == OnGoal::Nothing && !finished;
        for (arrived, &reached) in self.arrived.iter_mut().zip(on_goal) {
            let now = if reached || finished { self.step } else { NEVER };
            *arrived = if forgets && !reached { NEVER } else { now.min(*arrived) };
        }
        let metrics = finished.then(|| self.compute_metrics(on_goal));
        self.step += 1;
        if finished {
            self.reset();
        }
        metrics
    }

    fn compute_metrics(&self, on_goal: &[bool]) -> Metrics {
        let num_agents = self.arrived.len() as f64;
        let num_steps = self.step as f64 + 1.0;
        let arrived = || self.arrived.iter().copied();
        match self.on_goal_mode {
            OnGoal::Finish => Metrics {
                isr: Some(self.num_reached as f64 / num_agents),
                csr: Some(flag(self.num_reached == self.arrived.len() as u64)),
                ep_length: Some(arrived().sum::<u64>() as f64 / num_agents + 1.0),
                ..Metrics::default()
            },
            OnGoal::Nothing => Metrics {
                isr: Some(on_goal.iter().filter(|&&reached| reached).count() as f64 / num_agents),
                csr: Some(flag(on_goal.iter().all(|&reached| reached))),
                ep_length: Some(num_steps),
                soc: Some(arrived().sum::<u64>() as f64 + num_agents),
                makespan: Some(arrived().max().unwrap_or(0) as f64 + 1.0),
                ..Metrics::default()
            },
            OnGoal::Restart => Metrics {
                avg_throughput: Some(self.num_reached as f64 / self.max_steps as f64),
                ..Metrics::default()
            },
        }
    }
}

fn flag(holds: bool) -> f64 {
    if holds { 1.0 } else { 0.0 }
}
