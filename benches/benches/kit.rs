//! Benchmarks of the kit for ports: lockstep checks of an engine in this process, and of the template over a pipe.

#![allow(clippy::unwrap_used, reason = "a bench may panic")]

use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pogema_conformance::port::{Command, Link, Mode, Process, Server, judge};
use pogema_conformance::{Op, Request, play};
use pogema_core::Environment;
use serde_json::json;

const NUM_STEPS: usize = 128;
const NUM_AGENTS: usize = 8;

/// Returns an episode of eight agents that the engine and the template can both play.
fn request() -> Request {
    let step =
        |step: usize| (0..NUM_AGENTS).map(|agent| ((step * 3 + agent * 2 + step / 5) % 5) as i64).collect();
    let ops = std::iter::once(Op::Reset(None)).chain((0..NUM_STEPS).map(|at| Op::Step(step(at))));
    let config = json!({
        "size": 12, "num_agents": NUM_AGENTS, "density": 0.2, "seed": 0, "obs_radius": 5,
        "collision_system": "priority", "on_target": "restart", "max_episode_steps": NUM_STEPS,
    });
    Request { config, ops: ops.collect(), ..Request::default() }
}

/// Checks a port with one request. The measured time includes that of the reference, which gives the expected answer.
fn check(link: &mut dyn Link, request: &Request) {
    let hello = link.hello().unwrap();
    let judged = judge(link, &hello, Mode::Instance, request, &play(request));
    assert!(judged.is_played && judged.divergences.is_empty() && judged.fault.is_none());
}

fn kit(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("kit, steps of 8 agents");
    group.sample_size(20).measurement_time(Duration::from_secs(4)).warm_up_time(Duration::from_secs(1));
    group.throughput(Throughput::Elements(NUM_STEPS as u64));
    let request = request();
    group.bench_function("in this process", |bencher| {
        let make = |config| Ok(Box::new(pogema_fast::Engine::new(config)?) as Box<dyn Environment>);
        bencher.iter(|| check(&mut Server::with("fast", make), &request));
    });
    let template = concat!(env!("CARGO_MANIFEST_DIR"), "/../conformance/ports/template.py");
    let command = Command::new(&format!("python3 '{template}'"), Duration::from_secs(10)).unwrap();
    let mut process = Process::start(&command).unwrap();
    group.bench_function("over a pipe", |bencher| bencher.iter(|| check(&mut process, &request)));
    group.finish();
}

criterion_group!(benches, kit);
criterion_main!(benches);
