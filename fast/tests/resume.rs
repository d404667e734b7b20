//! An engine that resumes an episode continues like the original engine.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_core::{Action, Cell, Collision, Config, Environment, Error, GoalStream, Instance, Map, OnGoal};
use pogema_core::{Outside, Snapshot, StepOut, Words};
use pogema_fast::Engine;

fn instance() -> Instance {
    let map = Map::from_rows(&[".....", "..#..", "....."]).unwrap();
    let starts = vec![Cell::new(0, 0), Cell::new(0, 1), Cell::new(2, 4)];
    let stream = |&start: &Cell| GoalStream::sequence(Cell::new(1, 1), vec![Cell::new(1, 1), start].into());
    let goals = starts.iter().map(stream).collect();
    Instance::new(map, Outside::Free, starts, goals).unwrap()
}

fn engine(config: Config) -> Engine {
    let mut engine = Engine::new(config).unwrap();
    engine.reset(&instance()).unwrap();
    engine
}

fn step(engine: &mut Engine, number: usize) -> (Vec<f32>, Vec<bool>, Vec<bool>) {
    let actions: Vec<Action> = (0..3).map(|agent| Action::ALL[(number * 7 + agent * 3) % 5]).collect();
    let (mut rewards, mut terminated, mut truncated) = (vec![0.0; 3], vec![false; 3], vec![false; 3]);
    let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
    engine.step(&actions, out).unwrap();
    (rewards, terminated, truncated)
}

#[test]
fn a_resumed_episode_continues_like_the_original() {
    for on_goal in OnGoal::all() {
        for collision in Collision::all() {
            let config = Config { num_agents: 3, radius: 1, on_goal, collision, ..Config::default() };
            let mut first = engine(config);
            (0..20).for_each(|number| _ = step(&mut first, number));
            let mut second = Engine::new(config).unwrap();
            let streams = first.streams().to_vec();
            second.resume(&instance(), streams, 20, &first.snapshot()).unwrap();
            assert_eq!(second.snapshot(), first.snapshot());
            for number in 20..60 {
                assert_eq!(step(&mut second, number), step(&mut first, number));
                assert_eq!(second.snapshot(), first.snapshot());
            }
        }
    }
}

#[test]
fn a_state_of_another_episode_is_rejected() {
    let config = Config { num_agents: 3, radius: 1, ..Config::default() };
    let first = engine(config);
    let right = first.snapshot();
    let far = vec![Cell::new(9, 9); 3];
    let wrong = [
        Snapshot { cells: vec![], ..right.clone() },
        Snapshot { cells: far.clone(), ..right.clone() },
        Snapshot { goals: far.clone(), ..right.clone() },
        Snapshot { occupied: far, ..right.clone() },
        Snapshot { cells: vec![Cell::new(0, 0); 3], ..right.clone() },
        Snapshot { active: vec![true], ..right.clone() },
    ];
    for now in wrong {
        let mut second = Engine::new(config).unwrap();
        let resumed = second.resume(&instance(), first.streams().to_vec(), 0, &now);
        assert_eq!(resumed, Err(Error::ForeignState), "{now:?}");
        second.reset(&instance()).unwrap();
        assert_eq!(second.restore(0, &now), Err(Error::ForeignState), "{now:?}");
        assert_eq!(second.snapshot(), right);
    }
    let resumed = Engine::new(config).unwrap().resume(&instance(), vec![], 0, &right);
    assert_eq!(resumed, Err(Error::ForeignState), "no goal streams");
}
