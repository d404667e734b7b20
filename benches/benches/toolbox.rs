//! Benchmarks of evaluations: whole suites of the random policy, compared with the same episodes on the engine alone,
//! and the time until the first episode of a large suite.

#![allow(clippy::unwrap_used, reason = "a bench may panic")]

use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pogema_core::{Environment as _, StepOut};
use pogema_fast::Engine;
use pogema_maps::{GridConfig, InstanceSource};
use pogema_numpy::Generator;
use pogema_planners::sample;
use pogema_toolbox::{Begin, EpisodeConfigs, RunOptions, Store, Suite, run};

const NUM_AGENTS: usize = 64;
const NUM_STEPS: usize = 256;
const NUM_EPISODES: usize = 32;

/// Number of episodes of a suite that starts quickly only if it does not create all environments in advance.
const MANY: usize = 100_000;

fn suite(num_episodes: usize) -> Suite {
    let seeds: Vec<String> = (0..num_episodes).map(|seed| seed.to_string()).collect();
    let text = format!(
        "environment: {{num_agents: {NUM_AGENTS}, size: 32, density: 0.3, obs_radius: 5, on_target: restart, \
         collision_system: soft, max_episode_steps: {NUM_STEPS}, seed: {{grid_search: [{}]}}}}\n\
         algorithms: {{Random: {{name: random}}}}\n",
        seeds.join(", ")
    );
    Suite::parse(Path::new("suite.yaml"), &text).unwrap()
}

fn environments(suite: &Suite) -> EpisodeConfigs {
    suite.environments(&[]).unwrap().0
}

/// Evaluates all episodes on one thread and stores the results in a folder.
fn evaluate(suite: &Suite) {
    let folder = tempfile::tempdir().unwrap();
    let environments = environments(suite);
    let store = Arc::new(Store::open(folder.path(), suite, &environments, Begin::New).unwrap());
    let running = RunOptions { threads: 1, stop: &Arc::<AtomicBool>::default(), watch: &|_| {} };
    assert!(run(suite, &environments, &store, running).unwrap().is_whole);
}

/// Plays an episode on the engine: instance, reset, and for each step actions, moves and observations.
fn play(config: &GridConfig) -> f32 {
    let instance = InstanceSource::new(config.clone(), None).unwrap().generate().unwrap().instance;
    let mut engine = Engine::new(config.rules()).unwrap();
    engine.reset(&instance).unwrap();
    let mut observations = vec![0.0; config.rules().num_observed()];
    let (mut rewards, mut terminated, mut truncated) =
        ([0.0; NUM_AGENTS], [false; NUM_AGENTS], [false; NUM_AGENTS]);
    let mut generator = Generator::seeded(config.seed.unwrap());
    let mut total = 0.0;
    for _ in 0..NUM_STEPS {
        let actions = sample(&mut generator, NUM_AGENTS);
        let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
        engine.step(&actions, out).unwrap();
        engine.observe(&mut observations).unwrap();
        total += rewards.iter().sum::<f32>() + observations[0];
    }
    total
}

fn evaluation(criterion: &mut Criterion) {
    let suite = suite(NUM_EPISODES);
    let all = environments(&suite);
    let configs: Vec<GridConfig> = (0..all.len()).map(|index| all.at(index).unwrap().config).collect();
    let mut group = criterion.benchmark_group("episodes of 64 agents, 256 steps");
    group.throughput(Throughput::Elements((NUM_EPISODES * NUM_AGENTS * NUM_STEPS) as u64));
    group.bench_function("engine, observed as f32", |bench| {
        bench.iter(|| configs.iter().map(|config| play(black_box(config))).sum::<f32>());
    });
    group.bench_function("evaluation", |bench| bench.iter(|| evaluate(black_box(&suite))));
    group.finish();
}

fn first_episode(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("grid of 100,000 episodes");
    group.sample_size(10);
    let start = || {
        let suite = suite(MANY);
        let environments = environments(&suite);
        let to_do = environments.by_cost((0..environments.len()).collect());
        environments.at(to_do[0]).unwrap()
    };
    group.bench_function("until its first episode", |bench| bench.iter(start));
    group.finish();
}

criterion_group!(benches, evaluation, first_episode);
criterion_main!(benches);
