//! Benchmarks of the encoders of learned policies.

#![allow(clippy::unwrap_used, reason = "a bench may panic")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pogema_core::{Episode, Snapshot};
use pogema_fast::Engine;
use pogema_maps::{GridConfig, InstanceSource};
use pogema_numpy::Generator;
use pogema_planners::sample;
use pogema_policies::{Channel, Encoder, EncoderSettings};

const NUM_LANES: usize = 64;
const NUM_AGENTS: usize = 64;
const NUM_STEPS: usize = 64;

/// A lane: its encoder, the states of an episode, and a buffer for the windows.
struct Lane {
    encoder: Encoder,
    episode: Episode<Engine>,
    states: Vec<Snapshot>,
    windows: Vec<f32>,
}

impl Lane {
    fn new(seed: usize, settings: &EncoderSettings) -> Self {
        let text = format!(
            "{{num_agents: {NUM_AGENTS}, size: 20, density: 0.2, seed: {seed}, on_target: restart, \
             collision_system: soft, max_episode_steps: {NUM_STEPS}}}"
        );
        let config = GridConfig::from_yaml(&text).unwrap();
        let mut episode = Episode::new(Engine::new(config.rules()).unwrap());
        episode.start(InstanceSource::new(config, None).unwrap().generate().unwrap().instance).unwrap();
        let mut generator = Generator::seeded(seed as u64);
        let mut states = Vec::new();
        while !episode.is_over() {
            states.push(episode.snapshot());
            episode.step(&sample(&mut generator, NUM_AGENTS)).unwrap();
        }
        let encoder = Encoder::new(settings.clone()).unwrap();
        Self { encoder, episode, states, windows: vec![0.0; NUM_AGENTS * settings.window_len()] }
    }

    /// Begins the episode in the encoder, and encodes the state before each step.
    fn encode(&mut self) {
        let instance = self.episode.instance().unwrap();
        let occupancy = self.episode.config().occupancy;
        self.encoder.begin(instance.map(), instance.outside(), occupancy, instance.starts());
        for (step, state) in (0..).zip(&self.states) {
            self.encoder.encode(state.state(step), &mut self.windows, &mut []).unwrap();
        }
    }
}

fn encoders(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("encoders");
    group.throughput(Throughput::Elements((NUM_LANES * NUM_AGENTS * NUM_STEPS) as u64));
    let all = [
        ("cost_to_go", vec![Channel::CostToGo]),
        ("cost_tracer", vec![Channel::AllAgents, Channel::CostTracer]),
        ("obstacles, agents", vec![Channel::Obstacles, Channel::Agents]),
        ("path", vec![Channel::Path]),
        ("seen_agents", vec![Channel::SeenAgents]),
        ("seen_obstacles", vec![Channel::SeenObstacles]),
    ];
    for (name, channels) in all {
        let settings = EncoderSettings::new(5, channels);
        let mut lanes: Vec<Lane> = (0..NUM_LANES).map(|seed| Lane::new(seed, &settings)).collect();
        group.bench_function(name, |bencher| {
            bencher.iter(|| lanes.iter_mut().for_each(Lane::encode));
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = encoders
}
criterion_main!(benches);
