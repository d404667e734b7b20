//! Benchmarks of steps, observations and resets of one environment, and of batches.

#![allow(clippy::unwrap_used, reason = "a bench may panic")]

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use pogema_benches::episode;
use pogema_core::{Action, Environment, StepOut};
use pogema_fast::{Batch, Engine, Observations, SimdPath, words_per_agent};
use pogema_numpy::Generator;
use pogema_planners::sample;

/// Side of the map and number of agents.
const SIZES: [(usize, usize); 3] = [(32, 64), (64, 64), (256, 10_000)];

/// Returns the actions of many steps, because processors learn to predict the branches of a short repeated sequence.
fn random_actions(num_agents: usize) -> Vec<Vec<Action>> {
    let mut generator = Generator::seeded(0);
    let num_steps = 16.max((1 << 20) / num_agents);
    (0..num_steps).map(|_| sample(&mut generator, num_agents)).collect()
}

type Group<'a> = BenchmarkGroup<'a, criterion::measurement::WallTime>;

fn group<'a>(criterion: &'a mut Criterion, name: &str) -> Group<'a> {
    let mut group = criterion.benchmark_group(name);
    group.sample_size(10).measurement_time(Duration::from_secs(1)).warm_up_time(Duration::from_millis(200));
    group
}

fn step(criterion: &mut Criterion) {
    let mut group = group(criterion, "step");
    for (size, num_agents) in SIZES {
        let (config, instance) = episode(size, num_agents, 0).unwrap();
        let mut engine = Engine::new(config).unwrap();
        engine.reset(&instance).unwrap();
        let actions = random_actions(num_agents);
        let (mut rewards, mut terminated) = (vec![0.0; num_agents], vec![false; num_agents]);
        let (mut truncated, mut index) = (vec![false; num_agents], 0);
        group.throughput(Throughput::Elements(num_agents as u64));
        group.bench_function(format!("{size}x{size}, {num_agents} agents"), |bencher| {
            bencher.iter(|| {
                index += 1;
                let (rewards, terminated) = (&mut rewards[..], &mut terminated[..]);
                let out = StepOut { rewards, terminated, truncated: &mut truncated };
                engine.step(&actions[index % actions.len()], out)
            });
        });
    }
}

fn observe(criterion: &mut Criterion) {
    let mut group = group(criterion, "observe");
    for (size, num_agents) in SIZES {
        let (config, instance) = episode(size, num_agents, 0).unwrap();
        group.throughput(Throughput::Elements(num_agents as u64));
        for path in SimdPath::available() {
            let mut engine = Engine::with_path(config, path).unwrap();
            engine.reset(&instance).unwrap();
            let name = |dtype: &str| format!("{size}x{size}, {num_agents} agents, {dtype}, {path}");
            let mut floats = vec![0f32; config.num_observed()];
            group.bench_function(name("f32"), |bencher| {
                bencher.iter(|| engine.observe_agents(0..num_agents, black_box(&mut floats)));
            });
            let mut bytes = vec![0u8; config.num_observed()];
            group.bench_function(name("u8"), |bencher| {
                bencher.iter(|| engine.observe_agents(0..num_agents, black_box(&mut bytes)));
            });
            let mut words = vec![0; num_agents * words_per_agent(config.radius)];
            group.bench_function(name("bits"), |bencher| {
                bencher.iter(|| engine.observe_bits(0..num_agents, black_box(&mut words)));
            });
        }
    }
}

fn reset(criterion: &mut Criterion) {
    let mut group = group(criterion, "reset");
    for (size, num_agents) in SIZES {
        let (config, instance) = episode(size, num_agents, 0).unwrap();
        let mut engine = Engine::new(config).unwrap();
        group.bench_function(format!("{size}x{size}, {num_agents} agents"), |bencher| {
            bencher.iter(|| engine.reset(black_box(&instance)));
        });
    }
}

fn batch(criterion: &mut Criterion) {
    let mut group = group(criterion, "batch");
    let (config, _) = episode(32, 64, 0).unwrap();
    for (num_lanes, num_threads) in [(1, 1), (64, 1), (64, 2)] {
        let source = |lane, instance| Ok(episode(32, 64, lane as u64 + 1000 * instance)?.1);
        let mut batch = Batch::new(config, num_lanes, num_threads, source).unwrap();
        batch.reset().unwrap();
        let num_agents = 64 * num_lanes;
        let actions = random_actions(num_agents);
        let (mut rewards, mut terminated) = (vec![0.0; num_agents], vec![false; num_agents]);
        let (mut truncated, mut index) = (vec![false; num_agents], 0);
        let mut observed = vec![0u8; num_lanes * config.num_observed()];
        group.throughput(Throughput::Elements(num_agents as u64));
        group.bench_function(format!("{num_lanes} lanes, {num_threads} threads, step + u8"), |bencher| {
            bencher.iter(|| {
                index += 1;
                let (rewards, terminated) = (&mut rewards[..], &mut terminated[..]);
                let out = StepOut { rewards, terminated, truncated: &mut truncated };
                batch.step(&actions[index % actions.len()], out, Observations::U8(&mut observed))
            });
        });
    }
}

criterion_group!(benches, step, observe, reset, batch);
criterion_main!(benches);
