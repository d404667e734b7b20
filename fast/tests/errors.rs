//! Wrong calls change nothing and are rejected with messages that name the wrong numbers.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_core::{
    Action, Cell, Collision, Config, Environment, Error, GoalStream, Instance, Map, Outside, Snapshot,
    StepOut,
};
use pogema_fast::{Engine, SimdPath, words_per_agent};

const CONFIG: Config = Config {
    num_agents: 3,
    radius: 2,
    max_steps: 9,
    collision: Collision::Soft,
    on_goal: pogema_core::OnGoal::Restart,
    observation: pogema_core::Observation::Default,
    occupancy: pogema_core::Occupancy::AsReleased,
    reward: pogema_core::Reward::Own,
    persistent: false,
};
/// Number of values of one agent: three windows of five by five.
const PER_AGENT: usize = 75;

fn instance(num_agents: usize, outside: Outside) -> Instance {
    let map = Map::from_rows(&["....", ".#..", "...."]).unwrap();
    let starts = (0..num_agents).map(|agent| map.cell_at(agent)).collect();
    let goals = (0..num_agents).map(|agent| GoalStream::single(Cell::new(2, agent as u16))).collect();
    Instance::new(map, outside, starts, goals).unwrap()
}

fn started() -> Engine {
    let mut engine = Engine::new(CONFIG).unwrap();
    engine.reset(&instance(3, Outside::Free)).unwrap();
    engine
}

fn step(engine: &mut Engine, lengths: [usize; 4]) -> Result<(), Error> {
    let [num_actions, num_rewards, num_terminated, num_truncated] = lengths;
    let (mut terminated, mut truncated) = (vec![true; num_terminated], vec![true; num_truncated]);
    let mut rewards = vec![7.0; num_rewards];
    let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
    let outcome = engine.step(&vec![Action::Down; num_actions], out);
    if outcome.is_err() {
        assert!(rewards.iter().all(|&reward| reward == 7.0), "a failed call wrote rewards");
        assert!(terminated.iter().chain(&truncated).all(|&flag| flag), "a failed call wrote flags");
    }
    outcome
}

/// Checks that the call failed with this message, and that the engine continues as if the call had not been made.
fn check_rejected(engine: &mut Engine, outcome: Result<(), Error>, expected: &str) {
    assert_eq!(outcome.unwrap_err().to_string(), expected);
    let mut fresh = started();
    assert_eq!(engine.snapshot(), fresh.snapshot(), "{expected}");
    let (mut seen, mut seen_fresh) = (vec![7.0; 3 * PER_AGENT], vec![7.0; 3 * PER_AGENT]);
    step(engine, [3; 4]).unwrap();
    step(&mut fresh, [3; 4]).unwrap();
    engine.observe(&mut seen).unwrap();
    fresh.observe(&mut seen_fresh).unwrap();
    assert_eq!((engine.snapshot(), seen), (fresh.snapshot(), seen_fresh), "{expected}");
    engine.reset(&instance(3, Outside::Free)).unwrap();
}

#[test]
fn step_buffers_of_wrong_length_are_rejected() {
    let mut engine = started();
    for (lengths, expected) in [
        ([2, 3, 3, 3], "actions has length 2, expected 3"),
        ([4, 3, 3, 3], "actions has length 4, expected 3"),
        ([3, 5, 3, 3], "rewards has length 5, expected 3"),
        ([3, 3, 0, 3], "terminated has length 0, expected 3"),
        ([3, 3, 3, 1], "truncated has length 1, expected 3"),
    ] {
        let outcome = step(&mut engine, lengths);
        check_rejected(&mut engine, outcome, expected);
    }
}

#[test]
fn a_state_of_other_agents_is_rejected() {
    let mut engine = started();
    let outcome = engine.restore(0, &Snapshot::default());
    check_rejected(&mut engine, outcome, "the state does not fit the map and its agents");
}

#[test]
fn agent_ranges_out_of_bounds_are_rejected() {
    let mut engine = started();
    let backwards = std::ops::Range { start: 2, end: 1 };
    for (agents, expected) in [
        (0..4, "`agents` is `0..4`, expected within 0..3"),
        (4..4, "`agents` is `4..4`, expected within 0..3"),
        (backwards, "`agents` is `2..1`, expected within 0..3"),
        (0..u32::MAX as usize, "`agents` is `0..4294967295`, expected within 0..3"),
    ] {
        let (mut values, mut bytes, mut words) = ([7.0f32; PER_AGENT], [7u8; PER_AGENT], [7u64; 2]);
        let outcomes = [
            engine.observe_agents(agents.clone(), &mut values),
            engine.observe_agents(agents.clone(), &mut bytes),
            engine.observe_bits(agents, &mut words),
        ];
        assert_eq!(
            (values, bytes, words),
            ([7.0; PER_AGENT], [7; PER_AGENT], [7; 2]),
            "a failed call wrote values"
        );
        for outcome in outcomes {
            check_rejected(&mut engine, outcome, expected);
        }
    }
}

#[test]
fn wrong_buffers_are_rejected() {
    let mut engine = started();
    let all = 3 * PER_AGENT;
    assert_eq!(words_per_agent(CONFIG.radius), 2);
    for (got, expected) in
        [(all - 1, "224, expected 225"), (all + 1, "226, expected 225"), (0, "0, expected 225")]
    {
        let expected = format!("observations has length {expected}");
        let (mut values, mut bytes) = (vec![7.0; got], vec![7u8; got]);
        let outcomes = [
            engine.observe(&mut values),
            engine.observe_agents(0..3, &mut values),
            engine.observe_agents(0..3, &mut bytes),
        ];
        assert!(values.iter().all(|&value| value == 7.0) && bytes.iter().all(|&byte| byte == 7));
        for outcome in outcomes {
            check_rejected(&mut engine, outcome, &expected);
        }
    }
    let outcome = engine.observe_agents(1..2, &mut [7u8; 74]);
    check_rejected(&mut engine, outcome, "observations has length 74, expected 75");
    let outcome = engine.observe_agents(1..1, &mut [7f32; 1]);
    check_rejected(&mut engine, outcome, "observations has length 1, expected 0");
    let outcome = engine.observe_bits(0..2, &mut [7; 3]);
    check_rejected(&mut engine, outcome, "observations has length 3, expected 4");
}

#[test]
fn wrong_arrays_are_rejected() {
    let mut engine = started();
    for (lengths, expected) in
        [([74, 75], "obstacles has length 74, expected 75"), ([75, 74], "agents has length 74, expected 75")]
    {
        let [mut obstacles, mut agents] = lengths.map(|length| vec![7.0; length]);
        let outcome = engine.observe_windows(&mut obstacles, &mut agents);
        assert!(obstacles.iter().chain(&agents).all(|&value| value == 7.0), "a failed call wrote values");
        check_rejected(&mut engine, outcome, expected);
    }
    let outcome = engine.observe_map(&mut [7; 57]);
    check_rejected(&mut engine, outcome, "global obstacles has length 57, expected 56");
}

#[test]
fn wrong_instances_are_rejected() {
    let mut engine = started();
    let outcome = engine.reset(&instance(4, Outside::Free));
    check_rejected(&mut engine, outcome, "starts has length 4, expected 3");
    let outcome = engine.start(instance(2, Outside::Free));
    check_rejected(&mut engine, outcome, "starts has length 2, expected 3");
    // The map has 3 rows and 4 columns; the border adds 4 to each.
    let noise = |height, width| Outside::Noise(Map::new(height, width, vec![false; height * width]).unwrap());
    let outcome = engine.reset(&instance(3, noise(8, 8)));
    check_rejected(&mut engine, outcome, "noise has length 8, expected 7");
    let outcome = engine.start(instance(3, noise(7, 5)));
    check_rejected(&mut engine, outcome, "each row of noise has length 5, expected 8");
}

#[test]
fn every_call_fails_before_a_reset() {
    let mut engine = Engine::new(CONFIG).unwrap();
    let expected = "the environment has not been reset yet; call `reset` first";
    let mut values = [7.0; 3 * PER_AGENT];
    let outcomes = [
        step(&mut engine, [3; 4]),
        engine.restore(0, &Snapshot::default()),
        engine.observe_windows(&mut [], &mut []),
        engine.observe_map(&mut []),
        engine.count_seen(&mut Vec::new()),
        engine.observe(&mut values),
        engine.observe_agents(0..0, &mut [0f32; 0]),
        engine.observe_bits(0..0, &mut []),
    ];
    for outcome in outcomes {
        assert_eq!(outcome.unwrap_err().to_string(), expected);
    }
    assert_eq!((engine.snapshot(), engine.size()), (pogema_core::Snapshot::default(), (0, 0)));
}

#[test]
fn wrong_configs_are_rejected() {
    for (config, expected) in [
        (Config { num_agents: 0, ..CONFIG }, "config: `num_agents` is `0`, expected at least 1"),
        (Config { radius: 0, ..CONFIG }, "config: `radius` is `0`, expected 1 to 128"),
        (Config { radius: 129, ..CONFIG }, "config: `radius` is `129`, expected 1 to 128"),
        (
            Config { num_agents: Engine::MAX_AGENTS + 1, ..CONFIG },
            "config: `num_agents` is `4294967294`, expected at most 4294967293",
        ),
    ] {
        let error = Engine::with_path(config, SimdPath::Scalar).map(|_| ()).unwrap_err();
        assert_eq!(error.to_string(), expected);
    }
    for path in SimdPath::ALL.into_iter().filter(|path| !path.is_available()) {
        let error = Engine::with_path(CONFIG, path).map(|_| ()).unwrap_err();
        let expected = format!("`path` is `{path}`, expected at most `{}` on this machine", SimdPath::best());
        assert_eq!(error.to_string(), expected);
    }
}
