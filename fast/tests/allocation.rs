//! No allocations after a reset, and the reported number of allocated bytes.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use allocation_counter::measure;
use pogema_core::{
    Action, Cell, Collision, Config, Environment, GoalStream, Instance, Map, Occupancy, OnGoal, Outside,
    Reward, Seen, StepOut, Words,
};
use pogema_fast::{Engine, SimdPath, words_per_agent};

const NUM_AGENTS: usize = 24;
const SIDE: usize = 9;
const NUM_STEPS: usize = 40;

/// Returns an instance with agents in the upper half of a small map, each with `num_goals` goals.
fn instance(num_goals: usize) -> Instance {
    let obstacles = (0..SIDE * SIDE).map(|index| index % 11 == 3).collect();
    let map = Map::new(SIDE, SIDE, obstacles).unwrap();
    let cells = (0..SIDE * SIDE).map(|index| map.cell_at(index));
    let free: Vec<Cell> = cells.filter(|&cell| !map.is_obstacle(cell)).collect();
    let stream = |agent: usize| {
        let goals: Vec<Cell> = (1..=num_goals).map(|index| free[(agent + index) % free.len()]).collect();
        if num_goals == 1 {
            GoalStream::single(goals[0])
        } else {
            GoalStream::sequence(goals[0], goals.into())
        }
    };
    let goals = (0..NUM_AGENTS).map(stream).collect();
    Instance::new(map, Outside::Free, free[..NUM_AGENTS].to_vec(), goals).unwrap()
}

/// The buffers of a caller.
struct Buffers {
    rewards: Vec<f32>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    values: Vec<f32>,
    bytes: Vec<u8>,
    words: Vec<u64>,
    windows: [Vec<f32>; 2],
    global_obstacles: Vec<u8>,
    seen: Vec<Seen>,
}

impl Buffers {
    fn new(config: &Config) -> Self {
        let padded = SIDE + 2 * config.radius;
        let windows = vec![0.0; config.num_observed() / 3];
        Self {
            rewards: vec![0.0; NUM_AGENTS],
            terminated: vec![false; NUM_AGENTS],
            truncated: vec![false; NUM_AGENTS],
            values: vec![0.0; config.num_observed()],
            bytes: vec![0; config.num_observed()],
            words: vec![0; NUM_AGENTS * words_per_agent(config.radius)],
            windows: [windows.clone(), windows],
            global_obstacles: vec![0; padded * padded],
            seen: Vec::with_capacity(NUM_AGENTS),
        }
    }
}

/// Plays some steps with every kind of observation, and returns the sum of all rewards.
fn play(engine: &mut Engine, buffers: &mut Buffers) -> f32 {
    let mut sum_of_rewards = 0.0;
    for step in 0..NUM_STEPS {
        let mut actions = [Action::Stay; NUM_AGENTS];
        for (agent, action) in actions.iter_mut().enumerate() {
            *action = Action::ALL[(agent * 7 + step * step + agent * step) % 5];
        }
        let Buffers { rewards, terminated, truncated, .. } = buffers;
        engine.step(&actions, StepOut { rewards, terminated, truncated }).unwrap();
        sum_of_rewards += buffers.rewards.iter().sum::<f32>();
        observe(engine, buffers);
    }
    sum_of_rewards
}

fn observe(engine: &Engine, buffers: &mut Buffers) {
    let (per_agent, words) = (buffers.values.len() / NUM_AGENTS, buffers.words.len() / NUM_AGENTS);
    engine.observe(&mut buffers.values).unwrap();
    engine.observe_agents(0..NUM_AGENTS, &mut buffers.bytes).unwrap();
    engine.observe_bits(0..NUM_AGENTS, &mut buffers.words).unwrap();
    engine.observe_agents(3..5, &mut buffers.values[per_agent..3 * per_agent]).unwrap();
    engine.observe_agents(7..23, &mut buffers.bytes[1..=16 * per_agent]).unwrap();
    engine.observe_bits(1..2, &mut buffers.words[..words]).unwrap();
    let [obstacles, agents] = &mut buffers.windows;
    engine.observe_windows(obstacles, agents).unwrap();
    engine.observe_map(&mut buffers.global_obstacles).unwrap();
    engine.count_seen(&mut buffers.seen).unwrap();
}

fn check(config: Config, path: SimdPath) {
    for num_goals in [1, 3] {
        let mut engine = Engine::with_path(config, path).unwrap();
        engine.reset(&instance(num_goals)).unwrap();
        let mut buffers = Buffers::new(&config);
        let mut sum_of_rewards = 0.0;
        let info = measure(|| sum_of_rewards = play(&mut engine, &mut buffers));
        assert_eq!(info.count_total, 0, "{path} {num_goals} goals {config:?}");
        // If no goal is reached, the test does not cover the effects of reaching goals.
        assert!(config.on_goal == OnGoal::Nothing || sum_of_rewards > 0.0, "{config:?}");
    }
}

#[test]
fn nothing_is_allocated_after_a_reset() {
    assert_ne!(
        measure(|| drop(std::hint::black_box(vec![0u8; 100]))).count_total,
        0,
        "the counter misses allocations"
    );
    for path in SimdPath::available() {
        for collision in Collision::all() {
            for on_goal in OnGoal::all() {
                for (radius, occupancy, reward) in [
                    (1, Occupancy::Exact, Reward::Own),
                    (5, Occupancy::AsReleased, Reward::Shared),
                    (17, Occupancy::Exact, Reward::Own),
                ] {
                    let num_agents = NUM_AGENTS;
                    check(
                        Config {
                            num_agents,
                            radius,
                            collision,
                            on_goal,
                            occupancy,
                            reward,
                            ..Config::default()
                        },
                        path,
                    );
                }
            }
        }
    }
}

#[test]
fn num_bytes_matches_the_allocated_bytes() {
    for (num_agents, radius) in [(1, 1), (2, 1), (NUM_AGENTS, 1), (NUM_AGENTS, 17)] {
        let config = Config { num_agents, radius, ..Config::default() };
        let instance = {
            let all = instance(1);
            let (starts, goals) = (all.starts()[..num_agents].to_vec(), all.goals()[..num_agents].to_vec());
            Instance::new(all.map().clone(), Outside::Free, starts, goals).unwrap()
        };
        let mut reported = 0;
        let mut engine = None;
        let info = measure(|| {
            let engine = engine.insert(Engine::with_path(config, SimdPath::Scalar).unwrap());
            engine.reset(&instance).unwrap();
            reported = engine.num_bytes();
        });
        assert_eq!(info.bytes_current, (reported - size_of::<Engine>()) as i64, "{num_agents} {radius}");
    }
}

#[test]
fn a_cell_takes_at_most_ten_bytes() {
    let (side, radius) = (700, 17);
    let map = Map::new(side, side, vec![false; side * side]).unwrap();
    let (start, goal) = (map.cell_at(0), map.cell_at(1));
    let instance = Instance::new(map, Outside::Free, vec![start], vec![GoalStream::single(goal)]).unwrap();
    let mut engine = Engine::new(Config { num_agents: 1, radius, ..Config::default() }).unwrap();
    engine.reset(&instance).unwrap();
    assert!(engine.num_bytes() < 10 * (side + 2 * radius) * (side + 2 * radius));
}
