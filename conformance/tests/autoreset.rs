//! Checks the autoreset modes of a batch: compares each lane with a reference that is reset by hand. Lanes have maps of
//! different sizes.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use pogema_core::{Action, Cell, Collision, Config, Environment, Error, Instance, OnGoal, Snapshot, StepOut};
use pogema_fast::{Autoreset, Batch, ObservationBuffers, Observations};
use pogema_maps::{GridConfig, InstanceSource};
use serde_json::json;

use common::{LaneStep, ManualLane, error_of};

const NUM_LANES: usize = 6;
const NUM_AGENTS: usize = 5;
const NUM_STEPS: u64 = 50;
const MODES: [Autoreset; 3] = [Autoreset::SameStep, Autoreset::NextStep, Autoreset::Off];

fn config() -> Config {
    let (collision, on_goal) = (Collision::Soft, OnGoal::Finish);
    Config { num_agents: NUM_AGENTS, radius: 2, max_steps: 9, collision, on_goal, ..Config::default() }
}

/// Returns the instance of a lane and episode, whose size depends on both.
fn instance(salt: u64, lane: usize, episode: u64) -> Result<Instance, Error> {
    let seed = salt + 1000 * lane as u64 + episode;
    let fields = json!({"width": 5 + lane, "height": 6 + episode % 3, "density": 0.2, "num_agents": NUM_AGENTS,
                        "obs_radius": 2, "seed": seed, "max_episode_steps": 9, "collision_system": "soft"});
    Ok(InstanceSource::new(GridConfig::from_value(&fields)?, None)?.generate()?.instance)
}

fn new_batch(autoreset: Autoreset, num_threads: usize) -> Batch {
    let source = |lane, episode| instance(0, lane, episode);
    Batch::new(config(), NUM_LANES, num_threads, source).unwrap().with_autoreset(autoreset)
}

/// Returns pseudo-random actions of all lanes and agents; about every third episode of a lane reaches its goals.
fn actions(step: u64) -> Vec<Action> {
    let action = |agent: usize| Action::ALL[((agent as u64 * 7919 + step * 40_503) >> 5) as usize % 5];
    (0..NUM_LANES * NUM_AGENTS).map(action).collect()
}

/// The outputs of a lane in one step.
#[derive(Clone, Debug, PartialEq)]
struct LaneOutputs {
    rewards: Vec<f32>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    observed: Vec<f32>,
    state: Snapshot,
    episode: Option<u64>,
    has_ended: bool,
}

/// Begins an episode of a lane.
fn begin(lane: usize, episode: u64) -> ManualLane {
    ManualLane::new(config(), instance(0, lane, episode).unwrap(), episode)
}

/// Plays a step of a lane alone.
fn step_alone(manual: &mut ManualLane, lane: usize, autoreset: Autoreset, actions: &[Action]) -> LaneOutputs {
    let LaneStep { rewards, terminated, truncated, ended } =
        manual.step(autoreset, actions, |episode| begin(lane, episode));
    LaneOutputs {
        rewards,
        terminated,
        truncated,
        observed: manual.observed(),
        state: manual.environment.snapshot(),
        episode: Some(manual.episode),
        has_ended: ended.is_some(),
    }
}

fn step_batch(batch: &mut Batch, step: u64) -> Vec<LaneOutputs> {
    step_masked(batch, step).0
}

fn step_masked(batch: &mut Batch, step: u64) -> (Vec<LaneOutputs>, Vec<i8>) {
    let num_agents = NUM_LANES * NUM_AGENTS;
    let (mut rewards, mut terminated) = (vec![0.5; num_agents], vec![true; num_agents]);
    let mut truncated = terminated.clone();
    let mut observed = vec![0.5; NUM_LANES * config().num_observed()];
    let mut masks = vec![7; num_agents * 5];
    let view = ObservationBuffers { observations: Observations::F32(&mut observed), masks: Some(&mut masks) };
    let out = StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
    batch.step(&actions(step), out, view).unwrap();
    let shown = |lane: usize| {
        let agents = lane * NUM_AGENTS..(lane + 1) * NUM_AGENTS;
        LaneOutputs {
            rewards: rewards[agents.clone()].to_vec(),
            terminated: terminated[agents.clone()].to_vec(),
            truncated: truncated[agents].to_vec(),
            observed: observed.chunks(config().num_observed()).nth(lane).unwrap().to_vec(),
            state: batch.lane(lane).unwrap().snapshot(),
            episode: batch.episode(lane).unwrap(),
            has_ended: batch.has_just_ended(lane).unwrap(),
        }
    };
    ((0..NUM_LANES).map(shown).collect(), masks)
}

#[test]
fn lanes_of_different_sizes_follow_the_chosen_autoreset_on_any_number_of_threads() {
    for (autoreset, num_threads) in
        MODES.into_iter().flat_map(|mode| [1, 2, 6].map(|threads| (mode, threads)))
    {
        let mut batch = new_batch(autoreset, num_threads);
        assert_eq!(batch.episode(0).unwrap(), None);
        batch.reset().unwrap();
        let mut references: Vec<_> = (0..NUM_LANES).map(|lane| begin(lane, 0)).collect();
        let mut num_ended = 0;
        for step in 0..NUM_STEPS {
            let shown = step_batch(&mut batch, step);
            let actions = actions(step);
            let lanes = references.iter_mut().zip(actions.chunks(NUM_AGENTS)).enumerate();
            let expected: Vec<_> =
                lanes.map(|(lane, (manual, actions))| step_alone(manual, lane, autoreset, actions)).collect();
            assert_eq!(shown, expected, "{autoreset:?}, {num_threads} threads, step {step}");
            num_ended += shown.iter().filter(|lane| lane.has_ended).count();
            // Without autoreset, reset the ended lanes by hand after some steps.
            let chosen: Vec<bool> =
                (0..NUM_LANES).map(|lane| references[lane].is_over() && step % 4 == 0).collect();
            if autoreset == Autoreset::Off {
                batch.reset_lanes(&chosen).unwrap();
                for lane in (0..NUM_LANES).filter(|&lane| chosen[lane]) {
                    references[lane] = begin(lane, references[lane].episode + 1);
                }
            }
        }
        assert!(num_ended >= 3 * NUM_LANES, "only {num_ended} episodes ended");
    }
}

#[test]
fn a_reset_of_some_lanes_leaves_the_others_untouched_in_every_mode() {
    for autoreset in MODES {
        // After step 9, every lane has ended an episode; after step 4, none has.
        for num_steps in [4, 9] {
            let mut batch = new_batch(autoreset, 2);
            batch.reset().unwrap();
            (0..num_steps).for_each(|step| drop(step_batch(&mut batch, step)));
            let state = |batch: &Batch| {
                [0, 1, 2].map(|lane| (batch.lane(lane).unwrap().snapshot(), batch.episode(lane).unwrap()))
            };
            let before = state(&batch);
            let chosen: Vec<bool> = (0..NUM_LANES).map(|lane| lane == 1).collect();
            batch.reset_lanes(&chosen).unwrap();
            let after = state(&batch);
            assert_eq!((&after[0], &after[2]), (&before[0], &before[2]), "{autoreset:?} {num_steps}");
            let next = before[1].1.unwrap() + 1;
            let starts = instance(0, 1, next).unwrap().starts().to_vec();
            assert_eq!((&after[1].0.cells, after[1].1), (&starts, Some(next)), "{autoreset:?} {num_steps}");
        }
    }
}

#[test]
fn a_reset_without_a_next_instance_changes_nothing() {
    let source = |lane, episode| match (lane, episode) {
        (2, 1) => Err(Error::instance("no further instance")),
        _ => instance(0, lane, episode),
    };
    let mut batch = Batch::new(config(), NUM_LANES, 2, source).unwrap();
    let expected = "chosen lanes has length 2, expected 6";
    assert_eq!(error_of(batch.reset_lanes(&[true; 2])), expected);
    let mut chosen = [true; NUM_LANES];
    chosen[5] = false;
    assert_eq!(
        error_of(batch.reset_lanes(&chosen)),
        "the environment has not been reset yet; call `reset` first"
    );
    batch.reset().unwrap();
    let state = |batch: &Batch| {
        let lanes = 0..NUM_LANES;
        lanes
            .map(|lane| (batch.lane(lane).unwrap().snapshot(), batch.episode(lane).unwrap()))
            .collect::<Vec<_>>()
    };
    let before = state(&batch);
    assert_eq!(error_of(batch.reset_lanes(&chosen)), "instance: no further instance");
    let expected = "starts has length 6, expected 5";
    assert_eq!(error_of(batch.reset_with(source_with_six_agents, &chosen)), expected);
    assert_eq!(state(&batch), before);
    // If the instance of a lane was already generated, the lane starts it now, not the one after it.
    chosen[2] = false;
    batch.reset_lanes(&chosen).unwrap();
    let episodes: Vec<_> = state(&batch).into_iter().map(|(_, episode)| episode.unwrap()).collect();
    assert_eq!(episodes, [1, 1, 0, 1, 1, 0]);
}

fn source_with_six_agents(_: usize, _: u64) -> Result<Instance, Error> {
    let fields = json!({"size": 9, "num_agents": 6});
    Ok(InstanceSource::new(GridConfig::from_value(&fields)?, None)?.generate()?.instance)
}

#[test]
fn a_new_source_starts_at_episode_0_in_chosen_lanes_and_continues_in_the_others() {
    for autoreset in MODES {
        for num_steps in [0, 4, 9] {
            let mut batch = new_batch(autoreset, 2);
            batch.reset().unwrap();
            (0..num_steps).for_each(|step| drop(step_batch(&mut batch, step)));
            let untouched = batch.lane(0).unwrap().snapshot();
            let episode = batch.episode(0).unwrap().unwrap();
            let chosen: Vec<bool> = (0..NUM_LANES).map(|lane| lane % 2 == 1).collect();
            batch.reset_with(|lane, episode| instance(77, lane, episode), &chosen).unwrap();
            assert_eq!(batch.lane(0).unwrap().snapshot(), untouched);
            let assert_started = |batch: &Batch, lane: usize, salt: u64, episode: u64| {
                let starts = instance(salt, lane, episode).unwrap().starts().to_vec();
                assert_eq!(batch.lane(lane).unwrap().cells(), starts, "{autoreset:?} {num_steps} {lane}");
                assert_eq!(batch.episode(lane).unwrap(), Some(episode));
            };
            assert_started(&batch, 1, 77, 0);
            batch.reset().unwrap();
            assert_started(&batch, 3, 77, 1);
            // An instance that was prepared from the old source is still played.
            let salt = if autoreset == Autoreset::NextStep && num_steps == 9 { 0 } else { 77 };
            assert_started(&batch, 0, salt, episode + 1);
        }
    }
}

#[test]
fn ended_episodes_are_observed_in_the_requested_order() {
    let mut batch = new_batch(Autoreset::NextStep, 2);
    batch.reset().unwrap();
    let per_lane = config().num_observed();
    let mut observed = vec![0.5; 2 * per_lane];
    let too_early = error_of(batch.observe_ended(&[4, 1], Observations::F32(&mut observed)));
    assert_eq!(too_early, "no episode of lane 4 has ended yet");
    let last = (0..9).map(|step| step_batch(&mut batch, step)).last().unwrap();
    let short = error_of(batch.observe_ended(&[4], Observations::F32(&mut observed)));
    assert_eq!(short, format!("observations has length {}, expected {per_lane}", 2 * per_lane));
    for num_steps_later in 0..3 {
        let mut bytes = vec![9; 2 * per_lane];
        batch.observe_ended(&[4, 1], Observations::F32(&mut observed)).unwrap();
        batch.observe_ended(&[4, 1], Observations::U8(&mut bytes)).unwrap();
        assert_eq!(observed, [&last[4].observed[..], &last[1].observed].concat(), "{num_steps_later}");
        assert_eq!(bytes, observed.iter().map(|&value| value as u8).collect::<Vec<_>>());
        step_batch(&mut batch, 9 + num_steps_later);
    }
}

#[test]
fn masks_forbid_moves_into_obstacles_and_moves_of_inactive_agents() {
    fn view(masks: &mut [i8]) -> ObservationBuffers<'_> {
        ObservationBuffers { observations: Observations::None, masks: Some(masks) }
    }
    let mut batch = new_batch(Autoreset::SameStep, 2);
    let mut masks = vec![7; NUM_LANES * NUM_AGENTS * 5];
    assert_eq!(
        error_of(batch.observe(view(&mut masks))),
        "the environment has not been reset yet; call `reset` first"
    );
    batch.reset().unwrap();
    assert_eq!(error_of(batch.observe(view(&mut [0]))), "action masks has length 1, expected 150");
    let (mut num_inactive, mut num_forbidden) = (0, 0);
    for step in 0..NUM_STEPS {
        let (shown, masks) = step_masked(&mut batch, step);
        let mut again = vec![7; masks.len()];
        batch.observe(view(&mut again)).unwrap();
        assert_eq!(again, masks);
        for (index, mask) in masks.chunks(5).enumerate() {
            let (lane, agent) = (index / NUM_AGENTS, index % NUM_AGENTS);
            let LaneOutputs { state, episode, .. } = &shown[lane];
            let instance = instance(0, lane, episode.unwrap()).unwrap();
            let is_free = |place: (i32, i32)| {
                Cell::checked(place).is_some_and(|cell| !instance.map().is_obstacle(cell))
            };
            let is_active = state.active[agent];
            let expected = Action::ALL.map(|action| {
                action == Action::Stay || is_active && is_free(state.cells[agent].toward(action))
            });
            assert_eq!(mask, expected.map(i8::from), "step {step}, lane {lane}, agent {agent}");
            num_inactive += usize::from(!is_active);
            num_forbidden += mask.iter().filter(|&&allowed| allowed == 0).count();
        }
    }
    assert!(
        num_inactive > 0 && num_forbidden > 4 * num_inactive,
        "{num_inactive} inactive agents and {num_forbidden} forbidden moves are too few"
    );
}
