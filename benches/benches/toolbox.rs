//! An evaluation of the random policy, beside the same episodes without the toolbox: what measuring them costs.

#![allow(clippy::unwrap_used, reason = "a bench may panic")]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pogema_core::{Environment as _, StepOut};
use pogema_fast::Engine;
use pogema_maps::numpy::Generator;
use pogema_maps::{GridConfig, InstanceSource};
use pogema_planners::{NamedPolicy, PolicySettings, sample};
use pogema_toolbox::{BuiltIn, play};

const NUM_AGENTS: usize = 64;
const NUM_STEPS: usize = 256;

fn config() -> GridConfig {
    let text = format!(
        "{{num_agents: {NUM_AGENTS}, size: 32, density: 0.3, obs_radius: 5, seed: 0, on_target: restart, \
         collision_system: soft, max_episode_steps: {NUM_STEPS}}}"
    );
    GridConfig::from_yaml(&text).unwrap()
}

/// Instance, reset, and for each step actions, moves and what agents see.
fn without(config: &GridConfig) -> f32 {
    let instance = InstanceSource::new(config.clone(), None).unwrap().generate().unwrap().instance;
    let mut engine = Engine::new(config.rules()).unwrap();
    engine.reset(&instance).unwrap();
    let mut observations = vec![0.0; config.rules().num_observed()];
    let (mut rewards, mut terminated, mut truncated) =
        ([0.0; NUM_AGENTS], [false; NUM_AGENTS], [false; NUM_AGENTS]);
    let mut dice = Generator::seeded(0);
    let mut total = 0.0;
    for _ in 0..NUM_STEPS {
        let actions = sample(&mut dice, NUM_AGENTS);
        let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
        engine.step(&actions, out).unwrap();
        engine.observe(&mut observations).unwrap();
        total += rewards.iter().sum::<f32>() + observations[0];
    }
    total
}

fn evaluation(criterion: &mut Criterion) {
    let config = config();
    let settings = PolicySettings::default();
    let random = BuiltIn { name: "random".into(), settings };
    assert!(NamedPolicy::all().iter().any(|(name, _)| *name == random.name));
    let mut group = criterion.benchmark_group("episode of 64 agents, 256 steps");
    group.throughput(Throughput::Elements((NUM_AGENTS * NUM_STEPS) as u64));
    group.bench_function("engine, seen as f32", |bench| bench.iter(|| without(black_box(&config))));
    group.bench_function("toolbox", |bench| bench.iter(|| play(black_box(&config), &random).unwrap()));
    group.finish();
}

criterion_group!(benches, evaluation);
criterion_main!(benches);
