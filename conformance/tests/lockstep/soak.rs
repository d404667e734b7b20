//! Long episodes of a crowd on one map, for errors that appear only after many steps.

use std::sync::Arc;

use pogema_core::{
    Action, Cell, Collision, Config, GoalStream, Instance, Map, OnGoal, Outside, Snapshot, Words,
};
use pogema_numpy::Generator;

use crate::pair::Pair;

const NUM_AGENTS: usize = 500;
const SIDE: usize = 40;
/// Number of steps between two comparisons of the observations.
const OBSERVATION_INTERVAL: u64 = 100;

fn below(generator: &mut Generator, limit: usize) -> usize {
    generator.integers(0, limit as i64).unwrap() as usize
}

/// Returns an instance whose map has obstacles on about a fifth of its cells; each agent has an endless cycle of goals
/// near its start.
fn crowd(generator: &mut Generator) -> Instance {
    let obstacles = (0..SIDE * SIDE).map(|_| below(generator, 5) == 0).collect();
    let map = Map::new(SIDE, SIDE, obstacles).unwrap();
    let cells = (0..SIDE * SIDE).map(|index| map.cell_at(index));
    let mut free: Vec<Cell> = cells.filter(|&cell| !map.is_obstacle(cell)).collect();
    generator.shuffle(&mut free);
    let mut stream = |&start: &Cell| {
        let is_near = |cell: &&Cell| cell.distance(start) < 6;
        let near: Vec<Cell> = free.iter().filter(is_near).copied().collect();
        let goals: Vec<Cell> = (0..5).map(|_| near[below(generator, near.len())]).collect();
        GoalStream::sequence(goals[0], Arc::from(goals))
    };
    let goals = free[..NUM_AGENTS].iter().map(&mut stream).collect();
    let starts = free[..NUM_AGENTS].to_vec();
    Instance::new(map, Outside::Free, starts, goals).unwrap()
}

/// Chooses actions: about half of them lead towards the goal, the others are random.
fn choose_actions(generator: &mut Generator, state: &Snapshot, actions: &mut [Action]) {
    for (agent, action) in actions.iter_mut().enumerate() {
        let (cell, goal) = (state.cells[agent], state.goals[agent]);
        *action = match below(generator, 10) {
            0..5 => Action::ALL[below(generator, 5)],
            5..8 if goal.row != cell.row => [Action::Up, Action::Down][usize::from(goal.row > cell.row)],
            _ if goal.col != cell.col => [Action::Left, Action::Right][usize::from(goal.col > cell.col)],
            _ => Action::Stay,
        };
    }
}

/// Plays a number of steps with each collision system.
fn soak(num_steps: u64) {
    for (seed, collision) in Collision::all().enumerate() {
        let mut generator = Generator::seeded(seed as u64);
        let on_goal = OnGoal::Restart;
        let config = Config { num_agents: NUM_AGENTS, collision, on_goal, ..Config::default() };
        let mut pair = Pair::new(config);
        pair.reset(&crowd(&mut generator)).unwrap();
        let mut state = pair.check_state().unwrap();
        let mut actions = vec![Action::Stay; NUM_AGENTS];
        let mut num_reached = 0;
        for step in 1..=num_steps {
            choose_actions(&mut generator, &state, &mut actions);
            let (after, _) =
                pair.step(&actions).unwrap_or_else(|text| panic!("{collision:?} {step}: {text}"));
            num_reached += after.on_goal.iter().filter(|&&reached| reached).count() as u64;
            state = after;
            if step % OBSERVATION_INTERVAL == 0 {
                pair.check_observations(17..400)
                    .unwrap_or_else(|text| panic!("{collision:?} {step}: {text}"));
            }
        }
        assert!(
            num_reached > num_steps,
            "{num_reached} goals were reached under {collision:?}, expected more than {num_steps}"
        );
    }
}

#[test]
fn a_crowd_stays_in_lockstep() {
    soak(2_000);
}

#[test]
#[ignore = "minutes: cargo test --release -p pogema-conformance --test lockstep -- --ignored"]
fn a_crowd_stays_in_lockstep_for_100_000_steps() {
    soak(100_000);
}
