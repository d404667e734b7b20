//! Observations and global states in the buffers of a caller.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_core::{Action, Cell, Config, Environment, GoalStream, Instance, Map, Outside, StepOut};
use pogema_fast::{ApartBuffers, Engine, GlobalBuffers, Observations, Windows, words_per_agent};

const RADIUS: usize = 2;
const SIDE: usize = 2 * RADIUS + 1;
/// Columns of a map that needs several strips.
const WIDTH: usize = 70;

/// Returns an engine with two agents on a map of 2 rows with some obstacles, after the first agent has moved right.
fn engine() -> Engine {
    let obstacles = (0..2 * WIDTH).map(|index| index % 7 == 3).collect();
    let goals = vec![GoalStream::single(Cell::new(1, 69)), GoalStream::single(Cell::new(0, 0))];
    let starts = vec![Cell::new(0, 1), Cell::new(1, 40)];
    let instance =
        Instance::new(Map::new(2, WIDTH, obstacles).unwrap(), Outside::Free, starts, goals).unwrap();
    let mut engine = Engine::new(Config { num_agents: 2, radius: RADIUS, ..Config::default() }).unwrap();
    engine.start(instance).unwrap();
    let (mut rewards, mut terminated, mut truncated) = ([0.0; 2], [false; 2], [false; 2]);
    let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
    engine.step(&[Action::Right, Action::Stay], out).unwrap();
    engine
}

/// The buffers for a padded map and two agents.
struct State {
    size: (usize, usize),
    obstacles: Vec<u8>,
    cells: [i64; 4],
    goals: [i64; 4],
}

impl State {
    fn new(rows: usize, columns: usize) -> Self {
        Self { size: (rows, columns), obstacles: vec![7; rows * columns], cells: [7; 4], goals: [7; 4] }
    }

    fn buffers(&mut self, border: usize) -> GlobalBuffers<'_> {
        let Self { size, obstacles, cells, goals } = self;
        GlobalBuffers { size: *size, border, obstacles, cells, goals }
    }
}

#[test]
fn global_states_are_padded_with_obstacles() {
    let engine = engine();
    let (height, width) = (2 + 2 * RADIUS, WIDTH + 2 * RADIUS);
    let mut whole = vec![0; height * width];
    engine.observe_map(&mut whole).unwrap();
    for border in 0..=RADIUS {
        let mut state = State::new(height + 1, width + 3);
        engine.observe_into(Observations::Global(state.buffers(border))).unwrap();
        for row in 0..=height {
            for col in 0..width + 3 {
                let is_inside = row < 2 + 2 * border && col < WIDTH + 2 * border;
                let first = RADIUS - border;
                let expected = if is_inside { whole[(first + row) * width + first + col] } else { 1 };
                assert_eq!(state.obstacles[row * (width + 3) + col], expected, "{border}: {row}, {col}");
            }
        }
        let shift = border as i64;
        assert_eq!(state.cells, [0, 2, 1, 40].map(|number| number + shift));
        assert_eq!(state.goals, [1, 69, 0, 0].map(|number| number + shift));
    }
}

#[test]
fn apart_observations_hold_windows_and_positions() {
    let engine = engine();
    let mut expected = [[0f32; 2 * SIDE * SIDE]; 2];
    let [obstacles, agents] = &mut expected;
    engine.observe_windows(obstacles, agents).unwrap();
    let (mut obstacles, mut agents) = ([7u8; 2 * SIDE * SIDE], [7u8; 2 * SIDE * SIDE]);
    let (mut xy, mut target_xy) = ([7; 4], [7; 4]);
    let mut state = State::new(2 + 2 * RADIUS, WIDTH + 2 * RADIUS);
    let buffers = ApartBuffers {
        windows: Windows::U8(&mut obstacles, &mut agents),
        xy: &mut xy,
        target_xy: &mut target_xy,
        global: Some(state.buffers(RADIUS)),
    };
    engine.observe_into(Observations::Apart(buffers)).unwrap();
    assert_eq!([obstacles.map(f32::from), agents.map(f32::from)], expected);
    assert_eq!((xy, target_xy), ([0, 1, 0, 0], [1, 68, -1, -40]));
    assert_eq!(state.cells, [2, 4, 3, 42]);
}

#[test]
fn wrong_buffers_are_rejected() {
    let engine = engine();
    let error = |observations: Observations<'_>| engine.observe_into(observations).unwrap_err().to_string();
    let text = error(Observations::Global(State::new(2, 69).buffers(0)));
    assert_eq!(text, "`size` is `2 x 69`, expected at least 2 x 70, a map with its border of 0");
    let text = error(Observations::Global(State::new(6, 73).buffers(2)));
    assert_eq!(text, "`size` is `6 x 73`, expected at least 6 x 74, a map with its border of 2");
    let text = error(Observations::Global(State::new(9, 90).buffers(3)));
    assert_eq!(text, "`border` is `3`, expected at most 2");
    let mut state = State::new(2, 70);
    state.size = (usize::MAX, 2);
    let text = error(Observations::Global(state.buffers(0)));
    assert_eq!(text, format!("obstacles has length 140, expected {}", usize::MAX));
    let mut words = vec![0; 2 * words_per_agent(RADIUS) + 1];
    assert_eq!(error(Observations::Bits(&mut words)), "observations has length 5, expected 4");
    let (mut obstacles, mut agents, mut xy) = ([0f32; 50], [0f32; 49], [[0; 4]; 2]);
    let [xy, target_xy] = &mut xy;
    let windows = Windows::F32(&mut obstacles, &mut agents);
    let text = error(Observations::Apart(ApartBuffers { windows, xy, target_xy, global: None }));
    assert_eq!(text, "agents has length 49, expected 50");
    let fresh = Engine::new(Config::default()).unwrap();
    assert_eq!(
        fresh.observe_into(Observations::None).unwrap_err().to_string(),
        "the environment has not been reset yet; call `reset` first"
    );
}
