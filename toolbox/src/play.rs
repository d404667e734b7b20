//! One episode on the fast engine, measured.

use std::time::{Duration, Instant};

use pogema_core::{Environment as _, EpisodeMeter, Error, Metrics, StepOut};
use pogema_fast::Engine;
use pogema_maps::numpy::Generator;
use pogema_maps::{GridConfig, InstanceSource};
use pogema_planners::NamedPolicy;

use crate::built_in::BuiltIn;
use crate::witness::Witness;

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
    engine.reset(&instance)?;
    let dice = Generator::seeded(config.seed.unwrap_or_default());
    let began = Instant::now();
    let mut policy = NamedPolicy::new(&algorithm.name, &algorithm.settings, &rules, &instance, dice)?;
    let mut runtime = began.elapsed();
    let (mut meter, mut witness) = (EpisodeMeter::new(&rules), Witness::default());
    let num_agents = rules.num_agents;
    let (mut rewards, mut terminated, mut truncated) =
        (vec![0.0; num_agents], vec![false; num_agents], vec![false; num_agents]);
    witness.begin(&engine)?;
    loop {
        let began = Instant::now();
        let actions = policy.act(&engine, instance.map())?;
        runtime += began.elapsed();
        witness.before(&engine);
        let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
        engine.step(&actions, out)?;
        witness.after(&engine, instance.map(), &actions)?;
        if let Some(figures) = meter.feed(engine.on_goal(), &terminated, &truncated) {
            let collisions = witness.collisions();
            let metrics = Metrics {
                avg_agents_density: Some(witness.density()),
                a_collisions: Some(collisions.with_agents as f64),
                o_collisions: Some(collisions.with_obstacles as f64),
                ..figures
            };
            return Ok(Played { metrics, runtime });
        }
    }
}
