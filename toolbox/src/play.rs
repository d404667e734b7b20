//! Plays one episode on the fast engine, measures it, and records it on request.

use std::time::{Duration, Instant};

use pogema_core::{Episode, Error, Metrics, Trace};
use pogema_fast::Engine;
use pogema_maps::{GridConfig, InstanceSource};
use pogema_numpy::Generator;
use pogema_planners::Outcome;
use pogema_policies::NamedPolicy;

use crate::built_in::BuiltIn;
use crate::results::Proof;

/// The result of an episode.
#[derive(Clone, Debug, PartialEq)]
pub struct Played {
    /// Its metrics.
    pub metrics: Metrics,
    /// Total time of the policy: its construction and its choice of actions in all steps.
    ///
    /// Source: POGEMA 1.4.0, `wrappers/metrics.py`, `RuntimeMetricWrapper`
    pub runtime: Duration,
    /// Time spent in the policy's network; with several threads, the longest time that one of them spent there. `None`
    /// for a policy without a network.
    pub network_time: Option<Duration>,
    /// What a one-shot planner proved about the episode, if anything.
    pub proof: Proof,
}

/// Plays an episode to its end.
///
/// # Errors
/// If no instance can be generated, or the algorithm cannot play it; [`Error::Cancelled`] if the algorithm's budget is
/// cancelled.
pub fn play(config: &GridConfig, algorithm: &BuiltIn) -> Result<Played, Error> {
    run(config, algorithm, false).map(|(played, _)| played)
}

/// Plays an episode to its end and records it.
///
/// # Errors
/// Those of [`play`].
pub fn record(config: &GridConfig, algorithm: &BuiltIn) -> Result<(Played, Trace), Error> {
    let (played, episode) = run(config, algorithm, true)?;
    Ok((played, episode.trace()?))
}

fn run(
    config: &GridConfig,
    algorithm: &BuiltIn,
    is_recorded: bool,
) -> Result<(Played, Episode<Engine>), Error> {
    let instance = InstanceSource::new(config.clone(), None)?.generate()?.instance;
    let rules = config.rules();
    let mut episode = Episode::new(Engine::new(rules)?).with_density().with_collisions();
    episode.record(is_recorded);
    episode.start(instance)?;
    let rng = Generator::seeded(config.seed.unwrap_or_default());
    let began = Instant::now();
    let BuiltIn { name, settings, .. } = algorithm;
    let mut policy = NamedPolicy::new(name, settings, &rules, episode.instance()?, rng)?;
    let mut runtime = began.elapsed();
    while !episode.is_over() {
        if settings.budget.is_cancelled() {
            return Err(Error::Cancelled);
        }
        let began = Instant::now();
        let actions = policy.act(&episode)?;
        runtime += began.elapsed();
        episode.step(&actions)?;
    }
    let proof = policy.first_outcome().map(proof).unwrap_or_default();
    let network_time = policy.network_time();
    Ok((Played { metrics: episode.metrics(), runtime, network_time, proof }, episode))
}

/// Returns what a planner proved, whether or not it found a plan.
fn proof(outcome: &Outcome) -> Proof {
    let unsolvable = match outcome {
        Outcome::Impossible { reason } => Some(reason.clone()),
        _ => None,
    };
    Proof { lower_bound: outcome.lower_bound(), unsolvable }
}
