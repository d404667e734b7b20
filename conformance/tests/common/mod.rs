//! Helpers for the tests of batches.

#![allow(dead_code, reason = "each test uses a part")]

use pogema_core::{Action, Config, Environment, EpisodeMeter, Error, Instance, Metrics, StepOut};
use pogema_fast::Autoreset;
use pogema_reference::Reference;

pub fn error_of<T>(result: Result<T, Error>) -> String {
    result.err().unwrap().to_string()
}

/// A lane that is played alone, on a reference that is reset by hand.
pub struct ManualLane {
    pub environment: Reference,
    pub instance: Instance,
    pub episode: u64,
    meter: EpisodeMeter,
    /// `terminated` and `truncated` after the last step, if the episode is over.
    last: Option<[Vec<bool>; 2]>,
}

/// The results of a step of a lane.
pub struct LaneStep {
    pub rewards: Vec<f32>,
    pub terminated: Vec<bool>,
    pub truncated: Vec<bool>,
    /// The metrics and the last observations of the episode, if this step ended it.
    pub ended: Option<(Metrics, Vec<f32>)>,
}

impl ManualLane {
    /// Begins an episode.
    pub fn new(config: Config, instance: Instance, episode: u64) -> Self {
        let mut environment = Reference::new(config).unwrap();
        environment.reset(&instance).unwrap();
        Self { environment, instance, episode, meter: EpisodeMeter::new(&config), last: None }
    }

    pub fn is_over(&self) -> bool {
        self.last.is_some()
    }

    pub fn observed(&self) -> Vec<f32> {
        let mut observed = vec![0.5; self.environment.config().num_observed()];
        self.environment.observe(&mut observed).unwrap();
        observed
    }

    /// Plays a step, or does what the autoreset mode does instead of a step. `begin` begins the episode with the given
    /// number.
    pub fn step(
        &mut self,
        autoreset: Autoreset,
        actions: &[Action],
        begin: impl FnOnce(u64) -> Self,
    ) -> LaneStep {
        if self.is_over() && autoreset == Autoreset::NextStep {
            *self = begin(self.episode + 1);
            let num_agents = self.environment.config().num_agents;
            let ends = vec![false; num_agents];
            return LaneStep {
                rewards: vec![0.0; num_agents],
                terminated: ends.clone(),
                truncated: ends,
                ended: None,
            };
        }
        let num_agents = self.environment.config().num_agents;
        let mut rewards = vec![0.0; num_agents];
        if let Some([terminated, truncated]) = self.last.clone() {
            return LaneStep { rewards, terminated, truncated, ended: None };
        }
        let (mut terminated, mut truncated) = (vec![false; num_agents], vec![false; num_agents]);
        let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
        self.environment.step(actions, out).unwrap();
        let metrics = self.meter.feed(&self.environment.snapshot().on_goal, &terminated, &truncated);
        let ended = metrics.map(|metrics| (metrics, self.observed()));
        if ended.is_some() {
            self.last = Some([terminated.clone(), truncated.clone()]);
            if autoreset == Autoreset::SameStep {
                *self = begin(self.episode + 1);
            }
        }
        LaneStep { rewards, terminated, truncated, ended }
    }
}
