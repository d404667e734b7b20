//! Benchmark of placement: the time to generate an instance from a config.

#![allow(clippy::unwrap_used, reason = "a bench may panic")]

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pogema_benches::config;
use pogema_maps::InstanceSource;

/// Side of the map and number of agents, from a training map to the largest instance of POGEMA's paper.
const SIZES: [(usize, usize); 4] = [(32, 64), (256, 10_000), (1024, 100_000), (3072, 1_000_000)];

fn placement(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("placement");
    group.sample_size(10).measurement_time(Duration::from_secs(3)).warm_up_time(Duration::from_millis(500));
    for (side, num_agents) in SIZES {
        let mut source = InstanceSource::new(config(side, num_agents, 0).unwrap(), None).unwrap();
        group.throughput(Throughput::Elements(num_agents as u64));
        group.bench_function(format!("{side}x{side}, {num_agents} agents"), |bencher| {
            bencher.iter(|| black_box(source.generate()));
        });
    }
    group.finish();
}

criterion_group!(benches, placement);
criterion_main!(benches);
