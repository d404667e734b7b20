//! One episode on the fast engine, measured, and recorded if wanted.

use std::time::{Duration, Instant};

use pogema_core::{
    Action, Environment as _, EpisodeMeter, Error, Instance, Metrics, StepOut, Trace, TraceHeader,
    TraceStart, TraceStep,
};
use pogema_fast::Engine;
use pogema_maps::{GridConfig, InstanceSource};
use pogema_numpy::Generator;
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
    run(config, algorithm, None)
}

/// Plays an episode to its end, and keeps all of it.
///
/// # Errors
/// As for [`play`].
pub fn record(config: &GridConfig, algorithm: &BuiltIn) -> Result<(Played, Trace), Error> {
    let mut trace = None;
    let played = run(config, algorithm, Some(&mut trace))?;
    // INVARIANT: whoever asks for a trace gets one.
    let trace = trace.ok_or_else(|| Error::State { reason: "no episode was recorded".into() })?;
    Ok((played, trace))
}

fn run(config: &GridConfig, algorithm: &BuiltIn, trace: Option<&mut Option<Trace>>) -> Result<Played, Error> {
    let instance = InstanceSource::new(config.clone(), None)?.generate()?.instance;
    let rules = config.rules();
    let mut engine = Engine::new(rules)?;
    engine.reset(&instance)?;
    let dice = Generator::seeded(config.seed.unwrap_or_default());
    let began = Instant::now();
    let mut policy = NamedPolicy::new(&algorithm.name, &algorithm.settings, &rules, &instance, dice)?;
    let mut runtime = began.elapsed();
    let (mut meter, mut witness) = (EpisodeMeter::new(&rules), Witness::default());
    let mut ends = Ends::of(rules.num_agents);
    let mut recorder = trace.as_ref().map(|_| Recorder::begin(&engine));
    witness.begin(&engine)?;
    loop {
        let began = Instant::now();
        let actions = policy.act(&engine, instance.map())?;
        runtime += began.elapsed();
        witness.before(&engine);
        engine.step(&actions, ends.out())?;
        witness.after(&engine, instance.map(), &actions)?;
        let figures = meter.feed(engine.on_goal(), &ends.terminated, &ends.truncated);
        let metrics = figures.map(|figures| whole(figures, &witness));
        if let Some(recorder) = &mut recorder {
            recorder.step(actions, &engine, &ends, metrics);
        }
        if let Some(metrics) = metrics {
            if let (Some(trace), Some(recorder)) = (trace, recorder) {
                *trace = Some(recorder.trace(&engine, &instance));
            }
            return Ok(Played { metrics, runtime });
        }
    }
}

/// The figures of an episode with those for which every step had to be seen.
fn whole(figures: Metrics, witness: &Witness) -> Metrics {
    let collisions = witness.collisions();
    Metrics {
        avg_agents_density: Some(witness.density()),
        a_collisions: Some(collisions.with_agents as f64),
        o_collisions: Some(collisions.with_obstacles as f64),
        ..figures
    }
}

/// What a step tells each agent.
struct Ends {
    rewards: Vec<f32>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
}

impl Ends {
    fn of(num_agents: usize) -> Self {
        Self {
            rewards: vec![0.0; num_agents],
            terminated: vec![false; num_agents],
            truncated: vec![false; num_agents],
        }
    }

    fn out(&mut self) -> StepOut<'_> {
        StepOut {
            rewards: &mut self.rewards,
            terminated: &mut self.terminated,
            truncated: &mut self.truncated,
        }
    }
}

/// Keeps every step.
struct Recorder {
    start: TraceStart,
    steps: Vec<TraceStep>,
}

impl Recorder {
    fn begin(engine: &Engine) -> Self {
        Self { start: TraceStart { state: engine.snapshot(), observations: None }, steps: Vec::new() }
    }

    fn step(&mut self, actions: Vec<Action>, engine: &Engine, ends: &Ends, metrics: Option<Metrics>) {
        self.steps.push(TraceStep {
            actions,
            state: engine.snapshot(),
            rewards: ends.rewards.clone(),
            terminated: ends.terminated.clone(),
            truncated: ends.truncated.clone(),
            observations: None,
            metrics,
        });
    }

    fn trace(self, engine: &Engine, instance: &Instance) -> Trace {
        // An agent can reach at most one goal in a step.
        let header = TraceHeader::new(*engine.config(), instance, self.steps.len() + 1);
        Trace { header, start: self.start, steps: self.steps }
    }
}
