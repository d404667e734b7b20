//! Benchmark of MATS-LP: one decision of 64 agents on a map like those of the paper's set `01-random`.
//!
//! Reads `cost-tracer.onnx` from the folder of [`pogema_benches::weights`]; without this folder, the benchmark is
//! skipped.

#![allow(clippy::unwrap_used, reason = "a bench may panic")]

use criterion::{
    BatchSize, BenchmarkId, Criterion, SamplingMode, Throughput, criterion_group, criterion_main,
};
use pogema_core::{Environment, OnGoal};
use pogema_fast::Engine;
use pogema_policies::{MatsLp, MatsLpParams, Network, NetworkPrior};

const NUM_AGENTS: usize = 64;

fn decisions(criterion: &mut Criterion) {
    let Some(folder) = pogema_benches::weights("MATS-LP") else { return };
    let network = Network::read(folder.join("cost-tracer.onnx")).unwrap();
    let prior = NetworkPrior::new(network).unwrap();
    let (rules, instance) = pogema_benches::episode(20, NUM_AGENTS, 0).unwrap();
    let mut engine = Engine::new(rules).unwrap();
    engine.reset(&instance).unwrap();
    let mut group = criterion.benchmark_group("decision of MATS-LP");
    group
        .sampling_mode(SamplingMode::Flat)
        .sample_size(10)
        .throughput(Throughput::Elements(NUM_AGENTS as u64));
    for threads in [1, 2] {
        // Each decision begins with an empty cache.
        let begin = || {
            let mut policy = MatsLp::new(&prior, MatsLpParams::default(), threads).unwrap();
            policy.begin(&instance, OnGoal::Restart);
            policy
        };
        let name = BenchmarkId::new(format!("{NUM_AGENTS} agents"), format!("{threads} threads"));
        group.bench_function(name, |bencher| {
            bencher.iter_batched(
                begin,
                |mut policy| policy.act(engine.state()).unwrap(),
                BatchSize::PerIteration,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, decisions);
criterion_main!(benches);
