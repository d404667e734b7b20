//! Checks that each lane of a batch plays like a separate reference, on any number of threads, and starts its
//! next episode from the instance that the source of the batch returns for this episode.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::sync::atomic::AtomicBool;

use pogema_core::{
    Action, Collision, Config, Environment, EpisodeMeter, Error, Instance, Metrics, OnGoal, StepOut, Words,
};
use pogema_fast::{Autoreset, Batch, Observations, words_per_agent};
use pogema_maps::{GridConfig, InstanceSource};
use pogema_reference::Reference;
use serde_json::json;

use common::error_of;

const NUM_LANES: usize = 9;
const NUM_AGENTS: usize = 12;
const NUM_STEPS: u64 = 60;

fn config(on_goal: OnGoal) -> Config {
    let collision = Collision::Soft;
    Config { num_agents: NUM_AGENTS, radius: 3, max_steps: 11, collision, on_goal, ..Config::default() }
}

/// Returns the instance of a lane and episode; each has its own seed.
fn instance(on_goal: OnGoal, lane: usize, episode: u64) -> Result<Instance, Error> {
    let mode = match on_goal {
        OnGoal::Finish => "finish",
        OnGoal::Nothing => "nothing",
        OnGoal::Restart => "restart",
    };
    let seed = 1000 * lane as u64 + episode;
    let fields = json!({"size": 9, "density": 0.2, "num_agents": NUM_AGENTS, "obs_radius": 3, "seed": seed,
                        "on_target": mode, "max_episode_steps": 11, "collision_system": "soft"});
    Ok(InstanceSource::new(GridConfig::from_value(&fields)?, None)?.generate()?.instance)
}

/// Returns pseudo-random actions of all lanes and agents in a step.
fn actions(step: u64) -> Vec<Action> {
    let action =
        |agent: usize| Action::ALL[((agent as u64 * 2_654_435_761 + step * 40_503) >> 7) as usize % 5];
    (0..NUM_LANES * NUM_AGENTS).map(action).collect()
}

/// All outputs of all lanes, step by step.
#[derive(Debug, Default, PartialEq)]
struct Played {
    rewards: Vec<f32>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    observed: Vec<f32>,
    terminal: Vec<f32>,
    metrics: Vec<Metrics>,
}

fn new_batch(on_goal: OnGoal, num_threads: usize) -> Batch {
    let source = move |lane, episode| instance(on_goal, lane, episode);
    Batch::new(config(on_goal), NUM_LANES, num_threads, source).unwrap()
}

fn play_batch(on_goal: OnGoal, num_threads: usize) -> Played {
    let mut batch = new_batch(on_goal, num_threads);
    batch.reset().unwrap();
    let num_observed = config(on_goal).num_observed();
    let mut played = Played::default();
    let mut observed = vec![0.5; NUM_LANES * num_observed];
    batch.observe(Observations::F32(&mut observed)).unwrap();
    played.observed.extend(&observed);
    for step in 0..NUM_STEPS {
        let (mut rewards, mut terminated) =
            (vec![0.0; NUM_LANES * NUM_AGENTS], vec![false; NUM_LANES * NUM_AGENTS]);
        let mut truncated = terminated.clone();
        let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
        batch.step(&actions(step), out, Observations::F32(&mut observed)).unwrap();
        played.rewards.extend(rewards);
        played.terminated.extend(terminated);
        played.truncated.extend(truncated);
        played.observed.extend(&observed);
        for lane in (0..NUM_LANES).filter(|&lane| batch.has_just_ended(lane).unwrap()) {
            let (engine, metrics) = batch.ended(lane).unwrap().unwrap();
            let mut terminal = vec![0.5; num_observed];
            engine.observe(&mut terminal).unwrap();
            played.terminal.extend(terminal);
            played.metrics.push(metrics);
        }
    }
    played
}

/// Plays the same lanes on one reference each.
fn play_references(on_goal: OnGoal) -> Played {
    let config = config(on_goal);
    let mut played = Played::default();
    let mut observed = vec![0.0; config.num_observed()];
    let mut lanes = Vec::new();
    for lane in 0..NUM_LANES {
        let mut environment = Reference::new(config).unwrap();
        environment.reset(&instance(on_goal, lane, 0).unwrap()).unwrap();
        environment.observe(&mut observed).unwrap();
        played.observed.extend(&observed);
        lanes.push((environment, EpisodeMeter::new(&config), 0));
    }
    for step in 0..NUM_STEPS {
        let actions = actions(step);
        for (lane, (environment, meter, episode)) in lanes.iter_mut().enumerate() {
            let (mut rewards, mut terminated) = (vec![0.0; NUM_AGENTS], vec![false; NUM_AGENTS]);
            let mut truncated = terminated.clone();
            let out =
                StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
            environment.step(&actions[lane * NUM_AGENTS..][..NUM_AGENTS], out).unwrap();
            if let Some(metrics) = meter.feed(&environment.snapshot().on_goal, &terminated, &truncated) {
                environment.observe(&mut observed).unwrap();
                played.terminal.extend(&observed);
                played.metrics.push(metrics);
                *episode += 1;
                environment.reset(&instance(on_goal, lane, *episode).unwrap()).unwrap();
            }
            environment.observe(&mut observed).unwrap();
            played.observed.extend(&observed);
            played.rewards.extend(rewards);
            played.terminated.extend(terminated);
            played.truncated.extend(truncated);
        }
    }
    played
}

#[test]
fn a_batch_equals_separate_references_on_any_number_of_threads() {
    for on_goal in OnGoal::all() {
        let expected = play_references(on_goal);
        assert!(expected.metrics.len() >= 5 * NUM_LANES, "only {} episodes ended", expected.metrics.len());
        for num_threads in [1, 2, 8] {
            assert_eq!(play_batch(on_goal, num_threads), expected, "{on_goal:?}, {num_threads} threads");
        }
    }
}

#[test]
fn all_observation_formats_hold_the_same_bits() {
    let mut batch = new_batch(OnGoal::Restart, 2);
    batch.reset().unwrap();
    let per_agent = 3 * 7 * 7;
    let num_values = NUM_LANES * NUM_AGENTS * per_agent;
    let (mut floats, mut bytes) = (vec![0.5; num_values], vec![9; num_values]);
    let mut words = vec![u64::MAX; NUM_LANES * NUM_AGENTS * words_per_agent(3)];
    batch.observe(Observations::F32(&mut floats)).unwrap();
    batch.observe(Observations::U8(&mut bytes)).unwrap();
    batch.observe(Observations::Bits(&mut words)).unwrap();
    for (index, (&float, &byte)) in floats.iter().zip(&bytes).enumerate() {
        let (agent, value) = (index / per_agent, index % per_agent);
        let bit = words[agent * words_per_agent(3) + value / 64] >> (value % 64) & 1;
        assert_eq!((float, byte), (bit as f32, bit as u8), "agent {agent}, value {value}");
    }
}

#[test]
fn wrong_calls_report_the_given_and_the_expected_number_and_change_nothing() {
    let source = |lane, episode| instance(OnGoal::Finish, lane, episode);
    let new = |lanes, threads| error_of(Batch::new(config(OnGoal::Finish), lanes, threads, source));
    assert_eq!(new(0, 1), "`num_lanes` is `0`, expected at least 1");
    assert_eq!(new(2, 1025), "`num_threads` is `1025`, expected 1 to 1024");
    assert_eq!(new(2, 0), "`num_threads` is `0`, expected 1 to 1024");
    let mut batch = Batch::new(config(OnGoal::Finish), 2, 1, source).unwrap();
    assert_eq!(
        error_of(batch.observe(Observations::None)),
        "the environment has not been reset yet; call `reset` first"
    );
    batch.reset().unwrap();
    let before = [0, 1].map(|lane| batch.lane(lane).unwrap().snapshot());
    let mut step = |num_actions: usize, num_rewards: usize, num_observed: usize| {
        let (mut rewards, mut terminated, mut truncated) = (vec![0.0; num_rewards], [false; 24], [false; 24]);
        let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
        let mut observed = vec![0; num_observed];
        error_of(batch.step(&vec![Action::Up; num_actions], out, Observations::U8(&mut observed)))
    };
    assert_eq!(step(23, 24, 3528), "actions has length 23, expected 24");
    assert_eq!(step(24, 25, 3528), "rewards has length 25, expected 24");
    assert_eq!(step(24, 24, 3527), "observations has length 3527, expected 3528");
    assert_eq!([0, 1].map(|lane| batch.lane(lane).unwrap().snapshot()), before);
    let expected = "`lane` is `2`, expected below 2, the number of lanes";
    assert_eq!(error_of(batch.lane(2)), expected);
    assert_eq!(error_of(batch.ended(2)), expected);
}

#[test]
fn an_episode_that_cannot_start_is_reported_at_the_next_step() {
    let source = |lane, episode| match (lane, episode) {
        (1, 1) => Err(Error::instance("no further instance")),
        _ => instance(OnGoal::Finish, lane, episode),
    };
    for autoreset in [Autoreset::SameStep, Autoreset::NextStep] {
        let mut batch = Batch::new(config(OnGoal::Finish), 2, 2, source).unwrap().with_autoreset(autoreset);
        batch.reset().unwrap();
        let (mut rewards, mut terminated, mut truncated) = ([0.0; 24], [false; 24], [false; 24]);
        for step in 0..12 {
            let out =
                StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
            let result = batch.step(&[Action::Stay; 24], out, Observations::None);
            assert_eq!(result.is_ok(), step < 11, "step {step}");
        }
        assert!(truncated.iter().all(|&cut| cut));
        let (ended, _) = batch.ended(1).unwrap().unwrap();
        assert_eq!(ended.snapshot(), batch.lane(1).unwrap().snapshot());
        assert_eq!(error_of(batch.reset()), "instance: no further instance");
    }
}

#[test]
fn a_panic_of_the_source_becomes_an_error() {
    let source = |lane: usize, episode: u64| {
        assert!(episode == 0, "no second episode");
        instance(OnGoal::Finish, lane, episode)
    };
    let mut batch = Batch::new(config(OnGoal::Finish), 1, 1, source).unwrap();
    batch.reset().unwrap();
    assert_eq!(error_of(batch.reset()), "instance: the source panicked at lane 0, episode 1");
}

#[test]
fn work_of_a_caller_is_shared_and_episodes_are_counted() {
    for num_threads in [1, 3] {
        let mut batch = new_batch(OnGoal::Restart, num_threads).with_autoreset(Autoreset::NextStep);
        assert_eq!(batch.num_begun(0), Ok(0));
        batch.fetch(&[true; NUM_LANES], &AtomicBool::new(false)).unwrap();
        let first = batch.next_instance(2).unwrap().unwrap().starts().to_vec();
        batch.reset().unwrap();
        assert_eq!(batch.lane(2).unwrap().starts(), first);
        assert!(batch.next_instance(2).unwrap().is_none());
        let parts = (0..NUM_LANES).collect();
        let starts = batch.share(parts, |batch, lane| batch.lane(lane).unwrap().starts().to_vec());
        let expected: Vec<_> = (0..NUM_LANES)
            .map(|lane| instance(OnGoal::Restart, lane, 0).unwrap().starts().to_vec())
            .collect();
        assert_eq!(starts, expected);
        let (mut rewards, mut terminated) = ([0.0; 108], [false; 108]);
        let mut truncated = terminated;
        let mut step = |batch: &mut Batch| {
            let out =
                StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
            batch.step(&[Action::Stay; 108], out, Observations::None).unwrap();
        };
        (0..11).for_each(|_| step(&mut batch));
        assert_eq!((batch.num_begun(2), batch.is_over(2)), (Ok(1), Ok(true)));
        step(&mut batch);
        assert_eq!((batch.num_begun(2), batch.is_over(2)), (Ok(2), Ok(false)));
        // `reset_with` numbers the episodes from 0 again, but does not reset `num_begun`.
        batch
            .reset_with(|lane, episode| instance(OnGoal::Restart, lane, episode), &[true; NUM_LANES])
            .unwrap();
        assert_eq!((batch.num_begun(2), batch.episode(2)), (Ok(3), Ok(Some(0))));
        assert!(batch.num_begun(NUM_LANES).is_err() && batch.is_over(NUM_LANES).is_err());
    }
}
