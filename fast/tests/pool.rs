//! An engine on several threads has the same results as an engine on one thread.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::sync::Arc;

use pogema_core::{
    Action, Cell, Collision, Config, Environment, GoalStream, Instance, Map, Occupancy, OnGoal, Outside,
    Snapshot, StepOut,
};
use pogema_fast::{Engine, words_per_agent};
use pogema_numpy::Generator;

const SIDE: usize = 150;
const NUM_AGENTS: usize = 9000;
const NUM_STEPS: usize = 20;
/// Agents that are also observed without the others, enough for several threads.
const SOME: std::ops::Range<usize> = 1234..8765;

fn below(generator: &mut Generator, limit: usize) -> usize {
    generator.integers(0, limit as i64).unwrap() as usize
}

/// Returns an instance with many agents and nearby goals, on a map with obstacles on a tenth of its cells.
fn instance(generator: &mut Generator) -> Instance {
    let obstacles = (0..SIDE * SIDE).map(|_| below(generator, 10) == 0).collect();
    let map = Map::new(SIDE, SIDE, obstacles).unwrap();
    let cells = (0..SIDE * SIDE).map(|index| map.cell_at(index));
    let mut free: Vec<Cell> = cells.filter(|&cell| !map.is_obstacle(cell)).collect();
    generator.shuffle(&mut free);
    let stream = |start: &Cell| {
        let near = Cell::new((start.row + 1).min(SIDE as u16 - 1), start.col.saturating_sub(1));
        GoalStream::sequence(near, vec![near, *start].into())
    };
    let starts = free[..NUM_AGENTS].to_vec();
    let goals = starts.iter().map(stream).collect();
    Instance::new(map, Outside::Free, starts, goals).unwrap()
}

/// All results and observations of a step.
#[derive(PartialEq)]
struct Seen {
    state: Snapshot,
    rewards: Vec<f32>,
    ended: [Vec<bool>; 2],
    values: Vec<f32>,
    bytes: Vec<u8>,
    words: Vec<u64>,
    some_bytes: Vec<u8>,
    some_words: Vec<u64>,
}

fn step(engine: &mut Engine, actions: &[Action]) -> Seen {
    let num_values = engine.config().num_observed();
    let (per_agent, num_words) = (num_values / NUM_AGENTS, words_per_agent(engine.config().radius));
    let flags = vec![true; NUM_AGENTS];
    let mut seen = Seen {
        state: Snapshot::default(),
        rewards: vec![-1.0; NUM_AGENTS],
        ended: [flags.clone(), flags],
        values: vec![-1.0; num_values],
        bytes: vec![9; num_values],
        words: vec![u64::MAX; NUM_AGENTS * num_words],
        some_bytes: vec![9; SOME.len() * per_agent],
        some_words: vec![u64::MAX; SOME.len() * num_words],
    };
    let [terminated, truncated] = &mut seen.ended;
    engine.step(actions, StepOut { rewards: &mut seen.rewards, terminated, truncated }).unwrap();
    engine.observe(&mut seen.values).unwrap();
    engine.observe_agents(0..NUM_AGENTS, &mut seen.bytes).unwrap();
    engine.observe_bits(0..NUM_AGENTS, &mut seen.words).unwrap();
    engine.observe_agents(SOME, &mut seen.some_bytes).unwrap();
    engine.observe_bits(SOME, &mut seen.some_words).unwrap();
    assert!(seen.some_bytes == seen.bytes[SOME.start * per_agent..SOME.end * per_agent]);
    seen.state = engine.snapshot();
    seen
}

fn check(config: Config, seed: u64) {
    let pool = Arc::new(rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap());
    let mut generator = Generator::seeded(seed);
    let instance = instance(&mut generator);
    let mut plain = Engine::new(config).unwrap();
    let mut shared = Engine::new(config).unwrap().with_pool(pool);
    plain.reset(&instance).unwrap();
    shared.reset(&instance).unwrap();
    let (mut num_moved, mut num_reached) = (0, 0.0);
    let mut cells = instance.starts().to_vec();
    for number in 0..NUM_STEPS {
        // Most agents move in the same direction, so that long queues form.
        let along = Action::ALL[1 + number / 3 % 4];
        let any = |generator: &mut Generator| Action::ALL.get(below(generator, 12)).copied().unwrap_or(along);
        let actions: Vec<Action> = (0..NUM_AGENTS).map(|_| any(&mut generator)).collect();
        let (expected, got) = (step(&mut plain, &actions), step(&mut shared, &actions));
        assert!(expected.state == got.state, "state, step {number}, {config:?}");
        assert!(expected == got, "results or observations, step {number}, {config:?}");
        num_moved +=
            cells.iter().zip(&expected.state.cells).filter(|(before, after)| before != after).count();
        num_reached += expected.rewards.iter().sum::<f32>();
        cells = expected.state.cells;
    }
    assert!(num_moved > NUM_AGENTS, "only {num_moved} moves, {config:?}");
    assert!(num_reached > 500.0, "only {num_reached} goals, {config:?}");
}

#[test]
fn threads_do_not_change_results() {
    let rules = [
        (Collision::Priority, OnGoal::Restart, Occupancy::AsReleased),
        (Collision::BlockBoth, OnGoal::Restart, Occupancy::AsReleased),
        (Collision::BlockBoth, OnGoal::Finish, Occupancy::Exact),
        (Collision::Soft, OnGoal::Restart, Occupancy::AsReleased),
        (Collision::Soft, OnGoal::Finish, Occupancy::AsReleased),
        (Collision::Soft, OnGoal::Restart, Occupancy::Exact),
    ];
    for (seed, (collision, on_goal, occupancy)) in rules.into_iter().enumerate() {
        let (num_agents, radius) = (NUM_AGENTS, 3);
        check(Config { num_agents, radius, collision, on_goal, occupancy, ..Config::default() }, seed as u64);
    }
}
