//! Comparison of an engine's getters with its snapshot and the played actions.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_core::{
    Action, Cell, Config, Environment, GoalStream, Instance, Map, Occupancy, OnGoal, Outside, StepOut,
};
use pogema_fast::{Engine, SimdPath};

fn cell(row: u16, col: u16) -> Cell {
    Cell { row, col }
}

/// Returns an instance with two agents with three goals each, on a map of 2 rows and 3 columns.
fn instance() -> Instance {
    let goals = |cells: [Cell; 3]| GoalStream::sequence(cells[0], cells.into());
    let streams =
        vec![goals([cell(0, 1), cell(0, 2), cell(0, 0)]), goals([cell(1, 0), cell(1, 1), cell(1, 2)])];
    let map = Map::new(2, 3, vec![false; 6]).unwrap();
    Instance::new(map, Outside::Free, vec![cell(0, 0), cell(1, 2)], streams).unwrap()
}

#[test]
fn getters_return_the_current_state() {
    let config = Config {
        num_agents: 2,
        on_goal: OnGoal::Restart,
        occupancy: Occupancy::Exact,
        radius: 1,
        ..Config::default()
    };
    let mut engine = Engine::new(config).unwrap();
    assert_eq!((engine.size(), engine.num_steps()), ((0, 0), 0));
    assert!(engine.cells().is_empty() && engine.goals().is_empty() && engine.active().is_empty());
    engine.reset(&instance()).unwrap();
    assert_eq!(engine.size(), (2, 3));
    let (mut rewards, mut terminated, mut truncated) = ([0.0; 2], [false; 2], [false; 2]);
    for (step, (cells, goals)) in [
        ([cell(0, 0), cell(1, 2)], [cell(0, 1), cell(1, 0)]),
        ([cell(0, 1), cell(1, 1)], [cell(0, 2), cell(1, 0)]),
        ([cell(0, 2), cell(1, 0)], [cell(0, 0), cell(1, 1)]),
    ]
    .into_iter()
    .enumerate()
    {
        if step > 0 {
            let actions = [Action::Right, Action::Left];
            let out =
                StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
            engine.step(&actions, out).unwrap();
        }
        assert_eq!((engine.cells(), engine.goals()), (cells.as_slice(), goals.as_slice()));
        assert_eq!((engine.num_steps(), engine.active()), (step as u64, [true; 2].as_slice()));
        assert_eq!(engine.streams().len(), 2);
        let snapshot = engine.snapshot();
        assert_eq!((engine.state().step, snapshot.cells), (step as u64, cells.to_vec()));
        let mut occupied = cells.to_vec();
        occupied.sort();
        assert_eq!(snapshot.occupied, occupied);
    }
}

#[test]
fn a_finished_agent_is_inactive() {
    let config = Config { num_agents: 2, on_goal: OnGoal::Finish, ..Config::default() };
    let mut engine = Engine::new(config).unwrap();
    engine.reset(&instance()).unwrap();
    let (mut rewards, mut terminated, mut truncated) = ([0.0; 2], [false; 2], [false; 2]);
    let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
    engine.step(&[Action::Right, Action::Stay], out).unwrap();
    assert_eq!(engine.active(), [false, true]);
}

#[test]
fn the_number_of_agents_is_limited() {
    let engine = |num_agents| Engine::with_path(Config { num_agents, ..Config::default() }, SimdPath::Scalar);
    assert!(engine(Engine::MAX_AGENTS).is_ok());
    assert!(engine(Engine::MAX_AGENTS + 1).is_err());
}
