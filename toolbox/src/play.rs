//! One episode on the fast engine, measured, and recorded on request.

use std::time::{Duration, Instant};

use pogema_core::{Episode, Error, Metrics, Trace};
use pogema_fast::Engine;
use pogema_maps::{GridConfig, InstanceSource};
use pogema_numpy::Generator;
use pogema_planners::{NamedPolicy, Outcome};

use crate::built_in::BuiltIn;
use crate::results::Proof;

/// The result of an episode.
#[derive(Clone, Debug, PartialEq)]
pub struct Played {
    /// Its figures.
    pub metrics: Metrics,
    /// Time that the policy took, all steps together.
    ///
    /// Source: POGEMA 1.4.0, `wrappers/metrics.py`, `RuntimeMetricWrapper`
    pub runtime: Duration,
    /// What a one-shot planner proved about the episode.
    pub proof: Proof,
}

/// Plays an episode to its end.
///
/// # Errors
/// If there is no such episode, or the algorithm cannot play it.
pub fn play(config: &GridConfig, algorithm: &BuiltIn) -> Result<Played, Error> {
    run(config, algorithm, false).map(|(played, _)| played)
}

/// Plays an episode to its end and records it.
///
/// # Errors
/// As for [`play`].
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
    let dice = Generator::seeded(config.seed.unwrap_or_default());
    let began = Instant::now();
    let BuiltIn { name, settings, .. } = algorithm;
    let mut policy = NamedPolicy::new(name, settings, &rules, episode.instance()?, dice)?;
    let mut runtime = began.elapsed();
    while !episode.is_over() {
        let began = Instant::now();
        let actions = policy.act(&episode)?;
        runtime += began.elapsed();
        episode.step(&actions)?;
    }
    let proof = policy.first_outcome().map(proof).unwrap_or_default();
    Ok((Played { metrics: episode.metrics(), runtime, proof }, episode))
}

/// What a planner proved, whether it found a plan or not.
fn proof(outcome: &Outcome) -> Proof {
    let unsolvable = match outcome {
        Outcome::Impossible { reason } => Some(reason.clone()),
        _ => None,
    };
    Proof { lower_bound: outcome.lower_bound(), unsolvable }
}
