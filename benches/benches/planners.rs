//! Benchmarks of LaCAM's first plan and of lifelong PIBT.
//!
//! LaCAM plans for 256 agents on the paper's tiles of cities and for 1,000 agents on its whole city maps. PIBT moves
//! 192 agents in the paper's warehouse.
//!
//! Set `POGEMA_MAPS` to the folder with the paper's city maps; otherwise the benchmark of LaCAM is skipped.

#![allow(clippy::panic, clippy::unwrap_used, reason = "a bench may panic")]

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use pogema_core::Instance;
use pogema_maps::{GridConfig, InstanceSource};
use pogema_planners::{
    Budget, Graph, Lacam, LacamParams, Lifelong, PibtLifelong, PibtParams, Planner, Problem, validate,
};
use pogema_toolbox::Suite;

/// Returns the instances of a suite with seed 0, each map once, with `num_agents` agents instead of the suite's number.
fn instances(suite: &str, maps: &[PathBuf], num_agents: usize) -> Vec<Instance> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../suites").join(suite);
    let suite = Suite::read(&path).unwrap();
    let (environments, _) = suite.environments(maps).unwrap();
    let first = environments.at(0).unwrap().config.num_agents;
    let configs = (0..environments.len()).map(|index| environments.at(index).unwrap().config);
    let configs = configs.filter(|config| config.seed == Some(0) && config.num_agents == first);
    let instance = |config| InstanceSource::new(config, None).unwrap().generate().unwrap().instance;
    configs.map(|config| instance(GridConfig { num_agents, ..config })).collect()
}

/// Returns the time until the first plan of an instance, or `None` if LaCAM finds none. The plan is validated.
fn time_first_plan(instance: &Instance) -> Option<Duration> {
    let problem = Problem::of(instance).unwrap();
    let mut planner = Lacam::new(LacamParams { refine: false, ..LacamParams::default() });
    let start = Instant::now();
    let outcome = planner.plan(&problem, &Budget::of_time(Duration::from_secs(60)));
    let time = start.elapsed();
    let plan = outcome.solution()?;
    validate(instance.map(), instance.starts(), Some(&instance.first_goals()), plan).unwrap();
    Some(time)
}

fn first_plans(criterion: &mut Criterion) {
    let Some(maps) = std::env::var_os("POGEMA_MAPS").filter(|folder| !folder.is_empty()) else {
        eprintln!(
            "SKIPPED: first plans of LaCAM: POGEMA_MAPS is not set, expected the folder with the paper's maps"
        );
        return;
    };
    let mut group = criterion.benchmark_group("first plan of LaCAM");
    group.sampling_mode(SamplingMode::Flat).sample_size(10).warm_up_time(Duration::from_millis(1));
    for (suite, num_agents) in [("mapf/04-movingai.yaml", 256), ("mapf/06-pathfinding.yaml", 1000)] {
        let name = BenchmarkId::new(suite, format!("{num_agents} agents"));
        let mut instances = instances(suite, &[PathBuf::from(&maps)], num_agents);
        let mut times: Vec<Duration> = Vec::new();
        // A separate round, independent of criterion, measures the spread over instances.
        instances.retain(|instance| time_first_plan(instance).inspect(|time| times.push(*time)).is_some());
        times.sort_unstable();
        let (median, longest) = (times[times.len() / 2], times[times.len() - 1]);
        eprintln!(
            "{suite}, {num_agents} agents: {} plans, median {median:.1?}, longest {longest:.1?}",
            times.len()
        );
        let mut all = instances.iter().cycle();
        group.bench_function(name, |bencher| {
            bencher.iter_custom(|count| all.by_ref().take(count as usize).filter_map(time_first_plan).sum());
        });
    }
    group.finish();
}

/// Number of steps in an episode of PIBT.
const NUM_STEPS: u64 = 256;

/// Returns the time that PIBT takes for an episode, including its cost-to-go tables.
fn time_episode(instance: &Instance) -> Duration {
    let graph = Arc::new(Graph::new(instance.map()));
    let mut streams = instance.goals().to_vec();
    let mut now = graph.vertices_of("start", instance.starts()).unwrap();
    let mut goals = graph.vertices_of("goal", &instance.first_goals()).unwrap();
    let mut pibt = PibtLifelong::new(graph.clone(), PibtParams::default());
    let mut time = Duration::ZERO;
    for _ in 0..NUM_STEPS {
        let start = Instant::now();
        now = pibt.next(&now, &goals, &Budget::default()).unwrap();
        time += start.elapsed();
        for ((&vertex, goal), stream) in now.iter().zip(&mut goals).zip(&mut streams) {
            if vertex == *goal {
                *goal = graph.vertices_of("goal", &[stream.advance(graph.cell(vertex))]).unwrap()[0];
            }
        }
    }
    time
}

fn steps(criterion: &mut Criterion) {
    const NUM_AGENTS: usize = 192;
    let found = instances("lmapf/03-warehouse.yaml", &[], NUM_AGENTS);
    let [instance] = &found[..] else {
        panic!("found {} instances of the warehouse, expected one", found.len())
    };
    let mut group = criterion.benchmark_group("agent steps of PIBT");
    group.throughput(Throughput::Elements(NUM_AGENTS as u64 * NUM_STEPS));
    group.bench_function(
        BenchmarkId::new("lmapf/03-warehouse.yaml", format!("{NUM_AGENTS} agents")),
        |bencher| {
            bencher.iter_custom(|count| (0..count).map(|_| time_episode(instance)).sum());
        },
    );
    group.finish();
}

criterion_group!(benches, first_plans, steps);
criterion_main!(benches);
