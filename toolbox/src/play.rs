//! One episode on the fast engine, measured.

use std::time::{Duration, Instant};

use pogema_core::{
    CollisionMeter, Config, DensityMeter, Environment as _, EpisodeMeter, Error, Metrics, StepOut,
};
use pogema_fast::{Engine, words_per_agent};
use pogema_maps::numpy::Generator;
use pogema_maps::{GridConfig, InstanceSource};
use pogema_planners::NamedPolicy;

use crate::built_in::BuiltIn;

/// What came of an episode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Played {
    /// Its figures.
    pub metrics: Metrics,
    /// Time that the policy took, all steps together.
    ///
    /// Source: POGEMA 1.4.0, `wrappers/metrics.py`, `RuntimeMetricWrapper`
    pub runtime: Duration,
}

/// Plays an episode to its end.
///
/// # Errors
/// If there is no such episode, or the algorithm cannot play it.
pub fn play(config: &GridConfig, algorithm: &BuiltIn) -> Result<Played, Error> {
    let instance = InstanceSource::new(config.clone(), None)?.generate()?.instance;
    let rules = config.rules();
    let mut engine = Engine::new(rules)?;
    pogema_core::Environment::reset(&mut engine, &instance)?;
    let dice = Generator::seeded(config.seed.unwrap_or_default());
    let began = Instant::now();
    let mut policy = NamedPolicy::new(&algorithm.name, &algorithm.settings, &rules, &instance, dice)?;
    let mut runtime = began.elapsed();
    let mut meters = Meters::new(&rules);
    meters.look(&engine)?;
    loop {
        let began = Instant::now();
        let actions = policy.act(&engine, instance.map())?;
        runtime += began.elapsed();
        meters.before.clone_from_slice(engine.cells());
        meters.active.clone_from_slice(engine.active());
        engine.step(&actions, meters.out())?;
        meters.collisions.feed(instance.map(), &meters.before, &meters.active, &actions, engine.cells());
        meters.look(&engine)?;
        if let Some(figures) = meters.episode.feed(engine.on_goal(), &meters.terminated, &meters.truncated) {
            return Ok(Played { metrics: meters.figures(figures), runtime });
        }
    }
}

/// All that is measured of an episode, and the room for it.
struct Meters {
    episode: EpisodeMeter,
    density: DensityMeter,
    collisions: CollisionMeter,
    before: Vec<pogema_core::Cell>,
    active: Vec<bool>,
    rewards: Vec<f32>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    windows: Vec<u64>,
    area: usize,
}

impl Meters {
    fn new(rules: &Config) -> Self {
        let num_agents = rules.num_agents;
        Self {
            episode: EpisodeMeter::new(rules),
            density: DensityMeter::default(),
            collisions: CollisionMeter::default(),
            before: vec![pogema_core::Cell::new(0, 0); num_agents],
            active: vec![false; num_agents],
            rewards: vec![0.0; num_agents],
            terminated: vec![false; num_agents],
            truncated: vec![false; num_agents],
            windows: vec![0; num_agents * words_per_agent(rules.radius)],
            area: rules.side() * rules.side(),
        }
    }

    fn out(&mut self) -> StepOut<'_> {
        StepOut {
            rewards: &mut self.rewards,
            terminated: &mut self.terminated,
            truncated: &mut self.truncated,
        }
    }

    /// Looks how crowded the agents find it.
    fn look(&mut self, engine: &Engine) -> Result<(), Error> {
        engine.observe_bits(0..self.rewards.len(), &mut self.windows)?;
        let area = self.area;
        let windows = self.windows.chunks_exact(self.windows.len() / self.rewards.len());
        self.density.feed(windows.map(|words| {
            let free = area as u32 - ones(words, 0, area);
            (ones(words, area, 2 * area), free)
        }));
        Ok(())
    }

    fn figures(&self, figures: Metrics) -> Metrics {
        Metrics {
            avg_agents_density: Some(self.density.mean()),
            a_collisions: Some(self.collisions.with_agents as f64),
            o_collisions: Some(self.collisions.with_obstacles as f64),
            ..figures
        }
    }
}

/// Number of bits set among those from `first` to before `end`.
fn ones(words: &[u64], first: usize, end: usize) -> u32 {
    let (head, tail) = (first / 64, end / 64);
    let below = |bit: usize| (1u64 << (bit % 64)) - 1;
    let whole: u32 = words[head..tail].iter().map(|word| word.count_ones()).sum();
    let last = if end.is_multiple_of(64) { 0 } else { (words[tail] & below(end)).count_ones() };
    whole + last - (words[head] & below(first)).count_ones()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ones_are_counted_within_their_bounds() {
        let words = [u64::MAX, 0b1011, u64::MAX];
        let is_set = |bit: usize| words[bit / 64] >> (bit % 64) & 1 == 1;
        for first in 0..190 {
            for end in first..=190 {
                let wanted = (first..end).filter(|&bit| is_set(bit)).count();
                assert_eq!(ones(&words, first, end) as usize, wanted, "{first}..{end}");
            }
        }
    }
}
