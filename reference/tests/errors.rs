//! A rejected call returns the reason and changes nothing.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_core::{Action, Cell, Config, Environment, Error, GoalStream, Instance, Map, OnGoal};
use pogema_core::{Outside, Snapshot, StepOut};
use pogema_reference::Reference;

fn config() -> Config {
    Config { num_agents: 2, radius: 1, on_goal: OnGoal::Restart, ..Config::default() }
}

fn instance() -> Instance {
    let map = Map::from_rows(&["...", ".#."]).unwrap();
    let goals = [Cell::new(0, 2), Cell::new(1, 2)].map(GoalStream::single).to_vec();
    Instance::new(map, Outside::Free, vec![Cell::new(0, 0), Cell::new(1, 0)], goals).unwrap()
}

/// Plays a step with buffers of the given lengths.
fn step(environment: &mut Reference, actions: &[Action], lengths: [usize; 3]) -> Result<(), Error> {
    let (mut rewards, mut terminated, mut truncated) =
        (vec![0.5; lengths[0]], vec![true; lengths[1]], vec![true; lengths[2]]);
    let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
    let result = environment.step(actions, out);
    if result.is_err() {
        assert!(
            rewards.iter().all(|&reward| reward == 0.5)
                && terminated.iter().chain(&truncated).all(|&flag| flag)
        );
    }
    result
}

#[test]
fn calls_fail_before_the_first_reset_and_a_snapshot_is_empty() {
    let mut environment = Reference::new(config()).unwrap();
    let expected = "the environment has not been reset yet; call `reset` first";
    assert_eq!(step(&mut environment, &[Action::Stay; 2], [2; 3]).unwrap_err().to_string(), expected);
    assert_eq!(environment.observe(&mut [0.0; 54]).unwrap_err().to_string(), expected);
    assert_eq!(environment.observe_map(&mut [0; 20]).unwrap_err().to_string(), expected);
    assert_eq!(environment.restore(0, &Snapshot::default()).unwrap_err().to_string(), expected);
    assert!(environment.snapshot().cells.is_empty());
}

#[test]
fn a_rejected_step_or_restore_leaves_state_and_buffers_unchanged() {
    let mut environment = Reference::new(config()).unwrap();
    environment.reset(&instance()).unwrap();
    step(&mut environment, &[Action::Right, Action::Stay], [2; 3]).unwrap();
    let before = environment.snapshot();
    let wrong_steps = [
        (1, [2, 2, 2], "actions has length 1, expected 2"),
        (3, [2, 2, 2], "actions has length 3, expected 2"),
        (2, [1, 2, 2], "rewards has length 1, expected 2"),
        (2, [2, 3, 2], "terminated has length 3, expected 2"),
        (2, [2, 2, 0], "truncated has length 0, expected 2"),
    ];
    for (num_actions, lengths, expected) in wrong_steps {
        let error = step(&mut environment, &vec![Action::Right; num_actions], lengths).unwrap_err();
        assert_eq!(error.to_string(), expected);
        assert_eq!(environment.snapshot(), before);
    }
    assert_eq!(environment.restore(0, &Snapshot::default()), Err(Error::ForeignState));
    assert_eq!(environment.snapshot(), before);
}

#[test]
fn a_rejected_reset_leaves_the_episode_unchanged() {
    let mut environment = Reference::new(config()).unwrap();
    environment.reset(&instance()).unwrap();
    let before = environment.snapshot();
    let first = instance();
    let (map, starts, goals) = (first.map(), first.starts(), first.goals());
    let single =
        Instance::new(map.clone(), Outside::Free, starts[..1].to_vec(), goals[..1].to_vec()).unwrap();
    assert_eq!(environment.reset(&single).unwrap_err().to_string(), "starts has length 1, expected 2");
    let noise = Map::from_rows(&["....", "....", "....", "...."]).unwrap();
    let narrow = Instance::new(map.clone(), Outside::Noise(noise), starts.to_vec(), goals.to_vec()).unwrap();
    assert_eq!(
        environment.reset(&narrow).unwrap_err().to_string(),
        "each row of noise has length 4, expected 5"
    );
    assert_eq!(environment.snapshot(), before);
}

#[test]
fn a_buffer_of_the_wrong_length_is_not_written() {
    let mut environment = Reference::new(config()).unwrap();
    environment.reset(&instance()).unwrap();
    let mut short = [0.5; 53];
    assert_eq!(
        environment.observe(&mut short).unwrap_err().to_string(),
        "observations has length 53, expected 54"
    );
    assert!(short.iter().all(|&value| value == 0.5));
    let mut obstacles = [7; 19];
    let expected = "global obstacles has length 19, expected 20";
    assert_eq!(environment.observe_map(&mut obstacles).unwrap_err().to_string(), expected);
    assert_eq!(obstacles, [7; 19]);
}

#[test]
fn a_config_out_of_range_is_rejected() {
    let no_agents = Config { num_agents: 0, ..config() };
    assert_eq!(
        Reference::new(no_agents).unwrap_err().to_string(),
        "config: `num_agents` is `0`, expected at least 1"
    );
    let blind = Config { radius: 0, ..config() };
    assert_eq!(Reference::new(blind).unwrap_err().to_string(), "config: `radius` is `0`, expected 1 to 128");
}
