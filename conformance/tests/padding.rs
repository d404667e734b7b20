//! Checks lanes with fewer agents than their batch, and sources that are replaced, against references that play alone.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::sync::atomic::AtomicBool;

use pogema_core::{Action, Cell, Config, Environment, Error, Instance, Metrics, OnGoal, StepOut, Words};
use pogema_fast::{
    ApartBuffers, Autoreset, Batch, GlobalBuffers, ObservationBuffers, Observations, Windows, words_per_agent,
};
use pogema_maps::{GridConfig, InstanceSource};
use proptest::prelude::*;
use serde_json::json;

use common::{LaneStep, ManualLane, error_of};

const NUM_LANES: usize = 5;
const MAX_AGENTS: usize = 6;
/// Number of rows, and of columns, of each map in the global states, padding included.
const ROOM: usize = 11;
const RADIUS: usize = 2;
/// Number of values that an agent observes.
const NUM_OBSERVED: usize = 3 * (2 * RADIUS + 1).pow(2);

/// A drawn batch: its rules and threads, the numbers of agents of its episodes, and when its source is replaced.
#[derive(Clone, Debug)]
struct Drawn {
    on_goal: OnGoal,
    autoreset: Autoreset,
    num_threads: usize,
    /// The number of agents of a lane's episode. The index is the sum of lane, episode and salt, modulo the length of
    /// the list.
    numbers: Vec<usize>,
    seed: u64,
    num_steps: usize,
    /// Number of steps from one replacement of some lanes' sources to the next.
    replaced_every: usize,
}

fn drawn() -> impl Strategy<Value = Drawn> {
    let on_goal = prop::sample::select(OnGoal::all().collect::<Vec<_>>());
    let modes = vec![Autoreset::SameStep, Autoreset::NextStep, Autoreset::Off];
    let numbers = prop::collection::vec(1..=MAX_AGENTS, 4);
    let threads = prop::sample::select(vec![1, 2, 8]);
    let all = (on_goal, prop::sample::select(modes), threads, numbers, 0..1000_u64, 10..40_usize, 2..9_usize);
    all.prop_map(|(on_goal, autoreset, num_threads, numbers, seed, num_steps, replaced_every)| Drawn {
        on_goal,
        autoreset,
        num_threads,
        numbers,
        seed,
        num_steps,
        replaced_every,
    })
}

impl Drawn {
    fn config(&self, num_agents: usize) -> Config {
        Config { num_agents, radius: RADIUS, max_steps: 6, on_goal: self.on_goal, ..Config::default() }
    }

    /// Returns the instance of an episode of a lane; `salt` is the number of its source.
    fn instance(&self, salt: u64, lane: usize, episode: u64) -> Result<Instance, Error> {
        let number = self.numbers[(lane as u64 + episode + salt) as usize % self.numbers.len()];
        let fields = json!({"width": 6 + lane, "height": 7 + (episode + salt) % 4, "density": 0.2, "num_agents": number,
                            "obs_radius": RADIUS, "seed": self.seed + 1000 * lane as u64 + episode + 77 * salt,
                            "max_episode_steps": 6, "on_target": self.on_goal});
        Ok(InstanceSource::new(GridConfig::from_value(&fields)?, None)?.generate()?.instance)
    }
}

/// Returns a source that gives each lane the instances of its salt.
fn source(
    drawn: &Drawn,
    salts: &[u64],
) -> impl Fn(usize, u64) -> Result<Instance, Error> + Send + Sync + 'static {
    let (drawn, salts) = (drawn.clone(), salts.to_vec());
    move |lane, episode| drawn.instance(salts[lane], lane, episode)
}

/// All that a lane shows in a step, with the rows of padding.
#[derive(Clone, Debug, PartialEq)]
struct Shown {
    rewards: Vec<f32>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    observed: Vec<f32>,
    masks: Vec<i8>,
    xy: Vec<i64>,
    target_xy: Vec<i64>,
    cells: Vec<i64>,
    goals: Vec<i64>,
    map: Vec<u8>,
    metrics: Option<Metrics>,
    terminal: Vec<f32>,
}

/// A lane that is played alone.
struct Alone {
    lane: usize,
    salt: u64,
    manual: ManualLane,
}

fn padded<T: Clone>(mut values: Vec<T>, per_agent: usize, padding: T) -> Vec<T> {
    values.resize(MAX_AGENTS * per_agent, padding);
    values
}

/// Begins an episode of a lane.
fn begin(drawn: &Drawn, salt: u64, lane: usize, episode: u64) -> ManualLane {
    let instance = drawn.instance(salt, lane, episode).unwrap();
    ManualLane::new(drawn.config(instance.starts().len()), instance, episode)
}

impl Alone {
    fn new(drawn: &Drawn, lane: usize) -> Self {
        Self { lane, salt: 0, manual: begin(drawn, 0, lane, 0) }
    }

    fn begin_next(&mut self, drawn: &Drawn) {
        self.manual = begin(drawn, self.salt, self.lane, self.manual.episode + 1);
    }

    fn step(&mut self, drawn: &Drawn, actions: &[Action]) -> Shown {
        let Self { lane, salt, ref mut manual } = *self;
        let num_agents = manual.environment.config().num_agents;
        let LaneStep { rewards, terminated, truncated, ended } =
            manual.step(drawn.autoreset, &actions[..num_agents], |episode| begin(drawn, salt, lane, episode));
        let (metrics, terminal) = ended.map_or((None, Vec::new()), |(metrics, observed)| {
            (Some(metrics), padded(observed, NUM_OBSERVED, 0.0))
        });
        let (rewards, terminated) = (padded(rewards, 1, 0.0), padded(terminated, 1, true));
        Shown { rewards, terminated, truncated: padded(truncated, 1, true), metrics, terminal, ..self.show() }
    }

    /// Returns the state, without the results of a step.
    fn show(&self) -> Shown {
        let ManualLane { environment, instance, .. } = &self.manual;
        let (state, map) = (environment.snapshot(), instance.map());
        let absolute = |cells: &[Cell]| {
            let numbers = cells.iter().flat_map(|cell| [i64::from(cell.row), i64::from(cell.col)]);
            padded(numbers.collect(), 2, 0)
        };
        let starts = absolute(instance.starts());
        let relative =
            |cells: &[i64]| cells.iter().zip(&starts).map(|(number, start)| number - start).collect();
        let (cells, goals) = (absolute(&state.cells), absolute(&state.goals));
        let mask = |index: usize| {
            Action::ALL.map(|action| {
                let cell = Cell::checked(state.cells[index].toward(action));
                let is_free = cell.is_some_and(|cell| !map.is_obstacle(cell));
                i8::from(action == Action::Stay || state.active[index] && is_free)
            })
        };
        let mut masks: Vec<i8> = (0..state.cells.len()).flat_map(mask).collect();
        while masks.len() < 5 * MAX_AGENTS {
            masks.extend([1, 0, 0, 0, 0]);
        }
        let value = |index: usize| {
            let (row, col) = (index / ROOM, index % ROOM);
            let is_inside = row < map.height() && col < map.width();
            u8::from(!is_inside || map.is_obstacle(Cell::new(row as u16, col as u16)))
        };
        Shown {
            rewards: Vec::new(),
            terminated: Vec::new(),
            truncated: Vec::new(),
            observed: padded(self.manual.observed(), NUM_OBSERVED, 0.0),
            masks,
            xy: relative(&cells),
            target_xy: relative(&goals),
            cells,
            goals,
            map: (0..ROOM * ROOM).map(value).collect(),
            metrics: None,
            terminal: Vec::new(),
        }
    }
}

/// Checks the other forms of observation against windows that are already checked, and against what the lanes show.
fn check_other_forms(batch: &mut Batch, observed: &[f32], shown: &[Shown]) {
    let per_agent = NUM_OBSERVED;
    let num_agents = NUM_LANES * MAX_AGENTS;
    let (mut bytes, mut words) =
        (vec![9; observed.len()], vec![u64::MAX; num_agents * words_per_agent(RADIUS)]);
    batch.observe(Observations::U8(&mut bytes)).unwrap();
    batch.observe(Observations::Bits(&mut words)).unwrap();
    let third = per_agent / 3;
    let (mut obstacles, mut agents) = (vec![9; num_agents * third], vec![9; num_agents * third]);
    let (mut xy, mut target_xy) = (vec![-9; 2 * num_agents], vec![-9; 2 * num_agents]);
    let windows = Windows::U8(&mut obstacles, &mut agents);
    let apart = ApartBuffers { windows, xy: &mut xy, target_xy: &mut target_xy, global: None };
    batch.observe(Observations::Apart(apart)).unwrap();
    for (index, &value) in observed.iter().enumerate() {
        let (agent, at) = (index / per_agent, index % per_agent);
        let bit = words[agent * words_per_agent(RADIUS) + at / 64] >> (at % 64) & 1;
        assert_eq!((value, value), (f32::from(bytes[index]), bit as f32), "agent {agent}");
        let apart = [&obstacles, &agents].get(at / third).map(|channel| channel[agent * third + at % third]);
        assert!(apart.is_none_or(|apart| f32::from(apart) == value), "agent {agent}");
    }
    let mut map = vec![9; NUM_LANES * ROOM * ROOM];
    let (mut cells, mut goals) = (vec![-9; 2 * num_agents], vec![-9; 2 * num_agents]);
    let size = (ROOM, ROOM);
    let global = GlobalBuffers { size, border: 0, obstacles: &mut map, cells: &mut cells, goals: &mut goals };
    batch.observe(Observations::Global(global)).unwrap();
    for (lane, shown) in shown.iter().enumerate() {
        let agents = 2 * lane * MAX_AGENTS..2 * (lane + 1) * MAX_AGENTS;
        assert_eq!(xy[agents.clone()], shown.xy, "lane {lane}");
        assert_eq!(target_xy[agents.clone()], shown.target_xy, "lane {lane}");
        assert_eq!(cells[agents.clone()], shown.cells, "lane {lane}");
        assert_eq!(goals[agents], shown.goals, "lane {lane}");
        assert_eq!(map[lane * ROOM * ROOM..(lane + 1) * ROOM * ROOM], shown.map, "lane {lane}");
    }
}

/// Plays a step of a batch and of the lanes that are played alone, and checks that both show the same.
fn check_step(batch: &mut Batch, drawn: &Drawn, actions: &[Action], alone: &mut [Alone]) {
    let num_agents = NUM_LANES * MAX_AGENTS;
    let (mut rewards, mut terminated) = (vec![0.5; num_agents], vec![false; num_agents]);
    let mut truncated = terminated.clone();
    let mut observed = vec![0.5; NUM_LANES * drawn.config(MAX_AGENTS).num_observed()];
    let mut masks = vec![7; 5 * num_agents];
    let view = ObservationBuffers { observations: Observations::F32(&mut observed), masks: Some(&mut masks) };
    let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
    batch.step(actions, out, view).unwrap();
    let per_lane = drawn.config(MAX_AGENTS).num_observed();
    let mut expected = Vec::new();
    for lane in 0..NUM_LANES {
        let agents = lane * MAX_AGENTS..(lane + 1) * MAX_AGENTS;
        let one = alone[lane].step(drawn, &actions[agents.clone()]);
        assert_eq!(rewards[agents.clone()], one.rewards, "lane {lane}");
        assert_eq!(terminated[agents.clone()], one.terminated, "lane {lane}");
        assert_eq!(truncated[agents.clone()], one.truncated, "lane {lane}");
        assert_eq!(masks[5 * agents.start..5 * agents.end], one.masks, "lane {lane}");
        assert_eq!(observed[lane * per_lane..(lane + 1) * per_lane], one.observed, "lane {lane}");
        assert_eq!(batch.episode(lane).unwrap(), Some(alone[lane].manual.episode));
        assert_eq!(batch.has_just_ended(lane).unwrap(), one.metrics.is_some());
        if let Some(metrics) = one.metrics {
            assert_eq!(batch.ended(lane).unwrap().unwrap().1, metrics);
            let mut terminal = vec![0.5; per_lane];
            batch.observe_ended(&[lane], Observations::F32(&mut terminal)).unwrap();
            assert_eq!(terminal, one.terminal);
        }
        expected.push(one);
    }
    check_other_forms(batch, &observed, &expected);
}

fn check(drawn: &Drawn) {
    let mut salts = vec![0; NUM_LANES];
    let config = drawn.config(MAX_AGENTS);
    let batch = Batch::new(config, NUM_LANES, drawn.num_threads, source(drawn, &salts)).unwrap();
    let mut batch = batch.with_autoreset(drawn.autoreset);
    batch.reset().unwrap();
    let mut alone: Vec<_> = (0..NUM_LANES).map(|lane| Alone::new(drawn, lane)).collect();
    for step in 0..drawn.num_steps {
        let action = |agent: usize| Action::ALL[((agent * 7919 + step * 40_503) >> 5) % 5];
        let actions: Vec<_> = (0..NUM_LANES * MAX_AGENTS).map(action).collect();
        check_step(&mut batch, drawn, &actions, &mut alone);
        if step % drawn.replaced_every == 1 {
            let changed: Vec<_> = (0..NUM_LANES).map(|lane| (lane + step) % 3 > 0).collect();
            for lane in (0..NUM_LANES).filter(|&lane| changed[lane]) {
                salts[lane] += 1;
                alone[lane].salt += 1;
            }
            batch.replace_source(source(drawn, &salts), &changed, &AtomicBool::new(false)).unwrap();
        }
        let chosen: Vec<_> = alone.iter().map(|lane| lane.manual.is_over() && step % 3 == 0).collect();
        if drawn.autoreset == Autoreset::Off && chosen.contains(&true) {
            batch.reset_lanes(&chosen).unwrap();
            alone
                .iter_mut()
                .zip(chosen)
                .filter(|(_, chosen)| *chosen)
                .for_each(|(lane, _)| lane.begin_next(drawn));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn padded_lanes_equal_references_that_play_alone(drawn in drawn()) {
        check(&drawn);
    }
}

fn sample() -> Drawn {
    Drawn {
        on_goal: OnGoal::Finish,
        autoreset: Autoreset::NextStep,
        num_threads: 2,
        numbers: vec![2, 5, 3, 1],
        seed: 3,
        num_steps: 20,
        replaced_every: 4,
    }
}

#[test]
fn a_failed_replacement_of_the_source_changes_nothing() {
    let drawn = sample();
    let (numbers, salts) = (vec![MAX_AGENTS + 1], vec![0; NUM_LANES]);
    let crowded = source(&Drawn { numbers, ..drawn.clone() }, &salts);
    let mut batch = Batch::new(drawn.config(MAX_AGENTS), NUM_LANES, 2, source(&drawn, &salts)).unwrap();
    batch = batch.with_autoreset(Autoreset::NextStep);
    batch.reset().unwrap();
    let mut alone: Vec<_> = (0..NUM_LANES).map(|lane| Alone::new(&drawn, lane)).collect();
    let actions = vec![Action::Stay; NUM_LANES * MAX_AGENTS];
    (0..6).for_each(|_| check_step(&mut batch, &drawn, &actions, &mut alone));
    // All episodes have ended, so the next ones are ready.
    let (all, go, stop) = ([true; NUM_LANES], AtomicBool::new(false), AtomicBool::new(true));
    let replaced = batch.replace_source(crowded, &all, &go);
    assert_eq!(error_of(replaced), format!("starts has length {}, expected {MAX_AGENTS}", MAX_AGENTS + 1));
    let missing = |_: usize, _: u64| Err(Error::instance("no instance"));
    assert_eq!(error_of(batch.replace_source(missing, &all, &go)), "instance: no instance");
    let panics = |lane: usize, episode: u64| -> Result<Instance, Error> { panic!("{lane} {episode}") };
    let text = "instance: the source panicked at lane 0, episode 1";
    assert_eq!(error_of(batch.replace_source(panics, &all, &go)), text);
    let stopped = batch.replace_source(source(&drawn, &[1; NUM_LANES]), &all, &stop);
    assert!(matches!(stopped, Err(Error::Cancelled)));
    let short = batch.replace_source(source(&drawn, &[1; NUM_LANES]), &[true; 2], &go);
    assert_eq!(error_of(short), format!("changed lanes has length 2, expected {NUM_LANES}"));
    (0..15).for_each(|_| check_step(&mut batch, &drawn, &actions, &mut alone));
}

#[test]
fn an_ended_episode_stays_readable_after_a_reset_by_hand() {
    let drawn = Drawn { autoreset: Autoreset::Off, ..sample() };
    let salts = [0; NUM_LANES];
    let mut batch = Batch::new(drawn.config(MAX_AGENTS), NUM_LANES, 1, source(&drawn, &salts)).unwrap();
    batch = batch.with_autoreset(Autoreset::Off);
    batch.reset().unwrap();
    let mut alone: Vec<_> = (0..NUM_LANES).map(|lane| Alone::new(&drawn, lane)).collect();
    let actions = vec![Action::Stay; NUM_LANES * MAX_AGENTS];
    (0..6).for_each(|_| check_step(&mut batch, &drawn, &actions, &mut alone));
    let lanes: Vec<usize> = (0..NUM_LANES).collect();
    let mut before = vec![0.5; NUM_LANES * drawn.config(MAX_AGENTS).num_observed()];
    let mut after = before.clone();
    batch.observe_ended(&lanes, Observations::F32(&mut before)).unwrap();
    batch.reset().unwrap();
    batch.observe_ended(&lanes, Observations::F32(&mut after)).unwrap();
    assert_eq!(after, before);
    let mut now = before.clone();
    batch.observe(Observations::F32(&mut now)).unwrap();
    assert_ne!(now, before);
}

#[test]
fn sources_that_are_replaced_while_an_instance_is_generated_are_not_mixed() {
    // The old source is slow, so that the background thread still generates its instances.
    let drawn = sample();
    let slow = drawn.clone();
    let source_of = move |lane: usize, episode: u64| {
        std::thread::sleep(std::time::Duration::from_millis(5));
        slow.instance(0, lane, episode)
    };
    let mut batch = Batch::new(drawn.config(MAX_AGENTS), NUM_LANES, 1, source_of).unwrap();
    batch.reset().unwrap();
    for salt in 1..30 {
        let changed = [true; NUM_LANES];
        batch.replace_source(source(&drawn, &[salt; NUM_LANES]), &changed, &AtomicBool::new(false)).unwrap();
        batch.reset().unwrap();
        for lane in 0..NUM_LANES {
            let starts = drawn.instance(salt, lane, salt).unwrap().starts().to_vec();
            assert_eq!(batch.lane(lane).unwrap().cells(), starts, "source {salt}, lane {lane}");
        }
    }
}
