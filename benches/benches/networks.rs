//! Benchmarks of the published networks, batched on one thread.
//!
//! Reads them from the folder of [`pogema_benches::weights`]; without this folder, the benchmarks are skipped.

#![allow(clippy::unwrap_used, reason = "a bench may panic")]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use pogema_policies::{Inputs, Network, RecurrentState};

fn forward(criterion: &mut Criterion) {
    let Some(folder) = pogema_benches::weights("networks") else { return };
    for name in ["follower-lite", "cost-tracer"] {
        let network = Network::read(folder.join(format!("{name}.onnx"))).unwrap();
        let mut group = criterion.benchmark_group(format!("networks/{name}"));
        for batch in [1usize, 8, 64, 256] {
            let windows = vec![1.0; batch * network.input_shape().iter().product::<usize>()];
            let inputs = Inputs { windows: &windows, scalars: &[], batch };
            let (mut state, mut workspace) = (RecurrentState::new(&network, batch), network.workspace());
            group.throughput(Throughput::Elements(batch as u64));
            group.bench_function(BenchmarkId::from_parameter(batch), |bencher| {
                bencher.iter(|| network.forward(inputs, &mut state, &mut workspace).is_ok());
            });
        }
    }
}

criterion_group!(benches, forward);
criterion_main!(benches);
