//! Playing, measuring, recording, undoing and resuming episodes.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_core::{
    Action, Cell, Collision, CollisionMeter, Config, DensityMeter, Environment, Episode, EpisodeMeter, Error,
    GoalStream, Instance, Map, Metrics, OnGoal, Outside, Recording, Snapshot, StepOut, Trace, Words,
};
use pogema_reference::Reference;

const NUM_AGENTS: usize = 3;

fn instance() -> Instance {
    let map = Map::from_rows(&[".....", "..#..", "....."]).unwrap();
    let starts = vec![Cell::new(0, 0), Cell::new(0, 1), Cell::new(2, 4)];
    let stream = |&start: &Cell| GoalStream::sequence(Cell::new(0, 2), vec![Cell::new(0, 2), start].into());
    let goals = starts.iter().map(stream).collect();
    Instance::new(map, Outside::Free, starts, goals).unwrap()
}

fn config(on_goal: OnGoal) -> Config {
    Config {
        num_agents: NUM_AGENTS,
        radius: 2,
        max_steps: 12,
        on_goal,
        persistent: true,
        ..Config::default()
    }
}

fn episode(config: Config) -> Episode<Reference> {
    let mut episode =
        Episode::new(Reference::new(config).unwrap()).with_density().with_collisions().with_recording();
    episode.start(instance()).unwrap();
    episode
}

fn actions(step: usize) -> Vec<Action> {
    (0..NUM_AGENTS).map(|agent| Action::ALL[(step * 7 + agent * 3 + step / 4) % 5]).collect()
}

#[test]
fn calls_that_need_an_episode_fail_before_the_start() {
    let mut episode = Episode::new(Reference::new(config(OnGoal::Finish)).unwrap());
    assert_eq!(episode.step(&actions(0)), Err(Error::NotReset));
    assert_eq!(episode.step_back(), Err(Error::NotReset));
    assert_eq!(episode.instance().map(|_| ()), Err(Error::NotReset));
    assert_eq!(episode.trace(), Err(Error::NotRecorded));
    assert!(!episode.is_over() && episode.num_steps() == 0 && episode.snapshot() == Snapshot::default());
}

#[test]
fn a_rejected_call_leaves_the_episode_unchanged() {
    let mut episode = episode(Config { persistent: false, ..config(OnGoal::Nothing) });
    episode.step(&actions(0)).unwrap();
    let before = (episode.snapshot(), episode.metrics(), episode.trace().unwrap(), episode.num_steps());
    let no_agents = Instance::new(instance().map().clone(), Outside::Free, Vec::new(), Vec::new()).unwrap();
    assert_eq!(episode.step(&[Action::Stay]), Err(Error::Length { what: "actions", want: 3, got: 1 }));
    assert_eq!(episode.step_back(), Err(Error::StepsNotKept));
    assert_eq!(episode.start(no_agents), Err(Error::Length { what: "starts", want: 3, got: 0 }));
    let now = (episode.snapshot(), episode.metrics(), episode.trace().unwrap(), episode.num_steps());
    assert_eq!(now, before);
}

/// Plays the same episode with an engine and meters alone.
#[test]
fn results_metrics_and_trace_match_the_engine_and_the_meters() {
    for on_goal in OnGoal::all() {
        for collision in Collision::all() {
            let config = Config { collision, persistent: false, ..config(on_goal) };
            let mut episode = episode(config);
            let mut engine = Reference::new(config).unwrap();
            engine.reset(&instance()).unwrap();
            let (mut meter, mut density) = (EpisodeMeter::new(&config), DensityMeter::default());
            let (mut collisions, mut seen) = (CollisionMeter::default(), Vec::new());
            engine.count_seen(&mut seen).unwrap();
            density.feed(&seen);
            for step in 0.. {
                let before = engine.snapshot();
                let (mut rewards, mut terminated, mut truncated) = ([0.5; 3], [true; 3], [true; 3]);
                let out =
                    StepOut { rewards: &mut rewards, terminated: &mut terminated, truncated: &mut truncated };
                engine.step(&actions(step), out).unwrap();
                episode.step(&actions(step)).unwrap();
                let after = engine.snapshot();
                assert_eq!((episode.snapshot(), episode.num_steps()), (after.clone(), step as u64 + 1));
                assert_eq!(episode.rewards(), rewards);
                assert_eq!((episode.terminated(), episode.truncated()), (&terminated[..], &truncated[..]));
                collisions.feed(
                    instance().map(),
                    &before.cells,
                    &before.active,
                    &actions(step),
                    &after.cells,
                );
                engine.count_seen(&mut seen).unwrap();
                density.feed(&seen);
                let metrics = meter.feed(&after.on_goal, &terminated, &truncated);
                let expected = Metrics {
                    avg_agents_density: Some(density.mean()),
                    a_collisions: Some(collisions.with_agents as f64),
                    o_collisions: Some(collisions.with_obstacles as f64),
                    ..metrics.unwrap_or_default()
                };
                assert_eq!((episode.metrics(), episode.is_over()), (expected, metrics.is_some()));
                let trace = episode.trace().unwrap();
                let last = &trace.steps[step];
                assert_eq!((&last.actions, &last.state), (&actions(step), &after));
                assert_eq!(last.metrics, metrics.map(|_| expected));
                if episode.is_over() {
                    break;
                }
            }
            let most = if on_goal == OnGoal::Restart { episode.num_steps() as usize + 1 } else { 1 };
            assert!(episode.trace().unwrap().header.goals.iter().all(|goals| goals.len() == most));
            let mut text = Vec::new();
            episode.trace().unwrap().write(&mut text).unwrap();
            assert_eq!(Trace::read(&text[..]).unwrap(), episode.trace().unwrap());
        }
    }
}

#[test]
fn a_metric_that_is_not_measured_is_absent() {
    // An episode that keeps its steps has none of POGEMA's own metrics.
    for (persistent, expected) in [(false, &["avg_throughput"][..]), (true, &[])] {
        let config = Config { persistent, ..config(OnGoal::Restart) };
        let mut episode = Episode::new(Reference::new(config).unwrap());
        episode.start(instance()).unwrap();
        while !episode.is_over() {
            episode.step(&actions(0)).unwrap();
        }
        let names: Vec<&str> = episode.metrics().named().into_iter().map(|(name, _)| name).collect();
        assert_eq!(names, expected);
    }
}

#[test]
fn a_second_start_resets_metrics_and_recording() {
    let mut second = episode(config(OnGoal::Nothing));
    (0..5).for_each(|step| second.step(&actions(step)).unwrap());
    second.start(instance()).unwrap();
    let mut first = episode(config(OnGoal::Nothing));
    for step in 0..12 {
        for episode in [&mut first, &mut second] {
            episode.step(&actions(step)).unwrap();
        }
        assert_eq!((first.metrics(), first.trace()), (second.metrics(), second.trace()));
    }
    second.record(false);
    assert!(second.trace().is_ok(), "the current recording continues");
    second.start(instance()).unwrap();
    assert_eq!(second.trace(), Err(Error::NotRecorded));
}

#[test]
fn steps_are_undone_one_by_one() {
    let mut episode = episode(config(OnGoal::Finish));
    let mut states = vec![episode.snapshot()];
    for step in 0..12 {
        episode.step(&actions(step)).unwrap();
        states.push(episode.snapshot());
    }
    assert_eq!(episode.past(), states);
    for (step, state) in states.iter().enumerate().rev().skip(1) {
        assert_eq!(episode.step_back(), Ok(true));
        assert_eq!((episode.num_steps(), episode.state().step), (step as u64, step as u64));
        // A step back does not restore `on_goal`.
        let now = Snapshot { on_goal: state.on_goal.clone(), ..episode.snapshot() };
        assert_eq!(&now, state);
    }
    assert_eq!(episode.step_back(), Ok(false));
}

#[test]
fn undone_steps_are_not_recorded() {
    let (mut first, mut second) = (episode(config(OnGoal::Finish)), episode(config(OnGoal::Finish)));
    (0..3).for_each(|step| first.step(&actions(step)).unwrap());
    (0..5).for_each(|step| second.step(&actions(step)).unwrap());
    assert_ne!(first.recording(), second.recording());
    assert_eq!((second.step_back(), second.step_back()), (Ok(true), Ok(true)));
    assert_eq!(first.recording(), second.recording());
    assert!(!first.recording().unwrap().steps.is_empty());
}

#[test]
fn a_resumed_episode_continues_like_the_original() {
    let mut first = episode(config(OnGoal::Nothing));
    (0..5).for_each(|step| first.step(&actions(step)).unwrap());
    let mut second = Episode::new(first.engine().clone());
    *second.meters_mut() = first.meters().clone();
    let recording = first.recording().cloned();
    second.resume(instance(), first.num_steps(), first.past().to_vec(), recording).unwrap();
    for step in 5..12 {
        for episode in [&mut first, &mut second] {
            episode.step(&actions(step)).unwrap();
        }
        assert_eq!((first.metrics(), first.trace()), (second.metrics(), second.trace()));
    }
    assert_eq!(second.step_back(), Ok(true));
    let foreign = vec![Snapshot { cells: vec![Cell::new(9, 9); 3], ..first.snapshot() }];
    assert_eq!(second.resume(instance(), 0, foreign.clone(), None), Err(Error::ForeignState));
    // The number of past states must match the number of steps, and recorded states must fit the episode.
    let past = first.past().to_vec();
    for num_steps in [0, first.num_steps() + 1, u64::MAX] {
        let resumed = second.resume(instance(), num_steps, past.clone(), None);
        assert_eq!(resumed, Err(Error::ForeignState), "{num_steps}");
    }
    let recording = Recording { start: foreign[0].clone(), steps: Vec::new() };
    let resumed = second.resume(instance(), first.num_steps(), past, Some(recording));
    assert_eq!(resumed, Err(Error::ForeignState));
}

/// A step back does not rewind the goal stream.
///
/// Rule: history/step-back
#[test]
fn a_trace_lists_the_goals_of_the_recorded_steps() {
    let [start, first, last] = [0, 1, 2].map(|col| Cell::new(0, col));
    let map = Map::from_rows(&["..."]).unwrap();
    let goals = vec![GoalStream::sequence(first, vec![first, start, last].into())];
    let instance = Instance::new(map, Outside::Free, vec![start], goals).unwrap();
    let config = Config { num_agents: 1, ..config(OnGoal::Restart) };
    let mut episode = Episode::new(Reference::new(config).unwrap()).with_recording();
    episode.start(instance).unwrap();
    episode.step(&[Action::Right]).unwrap();
    assert_eq!(episode.trace().unwrap().header.goals, [[first, start]]);
    assert_eq!(episode.step_back(), Ok(true));
    episode.step(&[Action::Right]).unwrap();
    let trace = episode.trace().unwrap();
    assert_eq!(trace.header.goals, [[first, last]]);
    let mut replayed = Episode::new(Reference::new(config).unwrap());
    replayed.start(trace.header.instance().unwrap()).unwrap();
    replayed.step(&[Action::Right]).unwrap();
    assert_eq!(replayed.snapshot(), trace.steps[0].state);
}
