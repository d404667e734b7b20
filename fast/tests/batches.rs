//! Failed calls leave the episodes of a batch unchanged: wrong first instances, a lack of memory, and maps larger than
//! their buffers.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::alloc::System;
use std::sync::atomic::AtomicBool;

use cap::Cap;
use pogema_core::{
    Action, Cell, Config, Environment, Error, GoalStream, Instance, Map, Outside, StepResults,
};
use pogema_fast::{Autoreset, Batch, FirstInstances, GlobalBuffers, Observations};

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

/// Memory left by the limit: less than the board of the large map, and more than the other tests need. Units: bytes.
const ROOM: usize = 1 << 18;

fn config(num_agents: usize) -> Config {
    Config {
        num_agents,
        radius: 2,
        max_steps: 2,
        collision: pogema_core::Collision::Soft,
        on_goal: pogema_core::OnGoal::Nothing,
        observation: pogema_core::Observation::Default,
        occupancy: pogema_core::Occupancy::AsReleased,
        reward: pogema_core::Reward::Own,
        persistent: false,
    }
}

fn instance(num_agents: usize, side: usize) -> Instance {
    let map = Map::new(side, side, vec![false; side * side]).unwrap();
    let starts: Vec<Cell> = (0..num_agents).map(|agent| map.cell_at(agent)).collect();
    let goals = starts.iter().map(|&start| GoalStream::single(start)).collect();
    Instance::new(map, Outside::Free, starts, goals).unwrap()
}

fn batch(num_agents: usize, num_lanes: usize) -> Batch {
    let source = move |_: usize, _: u64| Ok(instance(num_agents, 4));
    Batch::new(config(num_agents), num_lanes, 1, source).unwrap()
}

fn firsts(batch: &mut Batch, num_agents: usize, chosen: &[bool]) -> FirstInstances {
    let source = move |_: usize, _: u64| Ok(instance(num_agents, 4));
    batch.fetch_with(source, chosen, &AtomicBool::new(false)).unwrap()
}

fn step(batch: &mut Batch) -> Result<(), Error> {
    let num = batch.num_lanes() * batch.config().num_agents;
    let mut results = StepResults::new(num);
    let mut windows = vec![0.0; 75 * num];
    batch.step(&vec![Action::Stay; num], results.out(), Observations::F32(&mut windows))
}

#[test]
fn first_instances_of_another_batch_are_rejected() {
    let (mut large, mut small) = (batch(10, 2), batch(2, 2));
    small.reset().unwrap();
    let foreign = firsts(&mut large, 10, &[true; 2]);
    assert_eq!(small.begin_with(foreign).unwrap_err().to_string(), "starts has length 10, expected 2");
    assert_eq!(small.episode(0), Ok(Some(0)));
    step(&mut small).unwrap();
}

#[test]
fn the_first_episodes_must_begin_in_all_lanes() {
    let (mut started, mut fresh) = (batch(2, 2), batch(2, 2));
    started.reset().unwrap();
    let half = firsts(&mut started, 2, &[true, false]);
    assert_eq!(fresh.begin_with(half), Err(Error::NotReset));
    assert_eq!(step(&mut fresh), Err(Error::NotReset));
    assert_eq!(fresh.episode(0), Ok(None));
}

#[test]
fn a_lane_without_memory_begins_the_same_episode_later() {
    // Episode 1 has a map for which the memory is missing at first.
    let source = |_: usize, episode: u64| Ok(instance(2, if episode == 1 { 600 } else { 4 }));
    let mut batch = Batch::new(config(2), 1, 1, source).unwrap();
    batch.reset().unwrap();
    batch.fetch(&[true], &AtomicBool::new(false)).unwrap();
    ALLOCATOR.set_limit(ALLOCATOR.allocated() + ROOM).unwrap();
    let outcome = batch.reset();
    ALLOCATOR.set_limit(usize::MAX).unwrap();
    assert!(matches!(outcome, Err(Error::Memory { .. })), "{outcome:?}");
    assert_eq!(batch.episode(0), Ok(Some(0)));
    batch.reset().unwrap();
    assert_eq!((batch.episode(0), batch.lane(0).unwrap().size()), (Ok(Some(1)), (600, 600)));
}

/// Returns the buffers for two maps of 4 rows and 4 columns.
fn small((map, cells, goals): &mut ([u8; 32], [i64; 4], [i64; 4])) -> Observations<'_> {
    Observations::Global(GlobalBuffers { size: (4, 4), border: 0, obstacles: map, cells, goals })
}

#[test]
fn no_lane_plays_if_a_map_exceeds_its_buffer() {
    for autoreset in [Autoreset::SameStep, Autoreset::NextStep] {
        // The agents begin on their goals, so the first step ends episode 0. The later maps of the second lane are
        // larger.
        let side = |lane, episode| if lane == 1 && episode > 0 { 8 } else { 4 };
        let source = move |lane: usize, episode| Ok(instance(1, side(lane, episode)));
        let mut batch = Batch::new(config(1), 2, 1, source).unwrap().with_autoreset(autoreset);
        batch.reset().unwrap();
        step(&mut batch).unwrap();
        let state = |batch: &Batch| {
            [0, 1].map(|lane| (batch.episode(lane).unwrap(), batch.lane(lane).unwrap().snapshot()))
        };
        let before = state(&batch);
        let mut buffers = ([0; 32], [0; 4], [0; 4]);
        let mut results = StepResults::new(2);
        let error = batch.step(&[Action::Stay; 2], results.out(), small(&mut buffers)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "`size` is `4 x 4`, expected at least 8 x 8, a map with its border of 0"
        );
        assert_eq!(state(&batch), before);
        step(&mut batch).unwrap();
        assert_eq!(batch.observe(small(&mut buffers)).unwrap_err(), error);
        assert_eq!(buffers, ([0; 32], [0; 4], [0; 4]), "a failed call wrote a state");
    }
}
