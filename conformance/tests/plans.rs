//! Plans of every planner, checked and played on the reference engine: no move is taken back.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_core::{Collision, Config, Episode, GoalStream, Instance, Map, OnGoal, Outside, State, Words};
use pogema_maps::{GridConfig, InstanceSource, PUZZLES, Puzzle, named_map};
use pogema_planners::{
    Budget, ConflictKind, LifelongName, LifelongPolicy, Plan, PlannerName, PlannerPolicy, PlannerSettings,
    Problem, validate,
};
use pogema_reference::Reference;
use serde_json::json;

fn drawn(seed: u64, size: u64, num_agents: u64, on_target: &str) -> (GridConfig, Instance) {
    let fields = json!({
        "seed": seed, "size": size, "num_agents": num_agents, "density": 0.25, "on_target": on_target,
        "collision_system": "soft", "max_episode_steps": 64,
    });
    made(&fields)
}

fn made(fields: &serde_json::Value) -> (GridConfig, Instance) {
    let config = GridConfig::from_value(fields).unwrap();
    let instance = InstanceSource::new(config.clone(), None).unwrap().generate().unwrap().instance;
    (config, instance)
}

fn started(config: &Config, instance: &Instance) -> Episode<Reference> {
    let mut episode = Episode::new(Reference::new(*config).unwrap()).with_collisions();
    episode.start(instance.clone()).unwrap();
    episode
}

/// Plays a plan; returns the first step in which the engine deviates from it.
fn surprise(config: &Config, instance: &Instance, plan: &Plan) -> Option<usize> {
    let mut episode = started(config, instance);
    (0..plan.num_steps()).find(|&step| {
        episode.step(&plan.actions(step).unwrap()).unwrap();
        episode.state().cells != plan.cells()[step + 1]
    })
}

#[test]
fn the_reference_plays_plans_as_they_are() {
    for name in PlannerName::all() {
        let mut num_solved = 0;
        for seed in 0..30 {
            let num_agents = if matches!(name, PlannerName::Cbs | PlannerName::Ecbs) { 4 } else { 10 };
            let (config, instance) = drawn(seed, 10, num_agents, "nothing");
            let problem = Problem::of(&instance).unwrap();
            let outcome =
                name.make(PlannerSettings { seed, threads: 1 }).plan(&problem, &Budget::of_nodes(300));
            let Some(plan) = outcome.best() else { continue };
            let goals = instance.first_goals();
            let goals = outcome.solution().map(|_| goals.as_slice());
            assert_eq!(
                validate(instance.map(), instance.starts(), goals, plan),
                Ok(()),
                "{name}, seed {seed}"
            );
            let rules = Config { max_steps: plan.num_steps() as i64 + 1, ..config.rules() };
            assert_eq!(surprise(&rules, &instance, plan), None, "{name}, seed {seed}");
            num_solved += usize::from(outcome.solution().is_some());
        }
        assert!(num_solved >= 24, "{name} solved {num_solved} of 30");
    }
}

#[test]
fn the_engine_notices_a_plan_that_is_wrong() {
    let map = Map::from_rows(&[".."]).unwrap();
    let ends = [map.cell_at(0), map.cell_at(1)];
    let goals = vec![GoalStream::single(ends[1]), GoalStream::single(ends[0])];
    let instance = Instance::new(map, Outside::Free, ends.to_vec(), goals).unwrap();
    let swap = Plan::new(vec![ends.to_vec(), vec![ends[1], ends[0]]]).unwrap();
    let config = Config { num_agents: 2, collision: Collision::Soft, ..Config::default() };
    assert_eq!(surprise(&config, &instance, &swap), Some(0));
    let conflict = validate(instance.map(), instance.starts(), None, &swap).unwrap_err();
    assert_eq!(conflict.kind, ConflictKind::Edge);
}

/// Plays an episode by a policy; returns how many goals were reached and how many moves were prevented.
fn play(
    config: &Config,
    instance: &Instance,
    mut act: impl FnMut(State<'_>) -> Vec<pogema_core::Action>,
) -> (f32, f64) {
    let (mut episode, mut num_reached) = (started(config, instance), 0.0);
    for _ in 0..config.max_steps {
        episode.step(&act(episode.state())).unwrap();
        num_reached += episode.rewards().iter().sum::<f32>();
    }
    let metrics = episode.metrics();
    (num_reached, metrics.a_collisions.unwrap() + metrics.o_collisions.unwrap())
}

#[test]
fn agents_go_from_goal_to_goal_without_a_collision() {
    for name in LifelongName::all() {
        for seed in 0..4 {
            let (config, instance) = drawn(seed, 12, 12, "restart");
            let mut policy =
                LifelongPolicy::new(name, PlannerSettings { seed, threads: 1 }, Budget::of_nodes(200));
            let (num_reached, num_reverted) =
                play(&config.rules(), &instance, |state| policy.act(instance.map(), state).unwrap());
            assert_eq!(num_reverted, 0.0, "{name}, seed {seed}");
            assert!(num_reached > 40.0, "{name}, seed {seed}: {num_reached} goals");
        }
    }
}

/// Goals reached by agents that are told only of their present goals, and by agents that know those to come.
fn reached_by_knowing(episodes: &[(GridConfig, Instance)]) -> [f32; 2] {
    let reached = |is_told: bool, (config, instance): &(GridConfig, Instance)| {
        let mut policy =
            LifelongPolicy::new(LifelongName::Rhcr, PlannerSettings::default(), Budget::of_nodes(200));
        if is_told {
            policy.provide_future_goals(instance).unwrap();
        }
        // That a goal is another than the one foretold would be an error.
        let (num_reached, num_reverted) =
            play(&config.rules(), instance, |state| policy.act(instance.map(), state).unwrap());
        assert_eq!(num_reverted, 0.0, "seed {:?}", config.seed);
        num_reached
    };
    [false, true].map(|is_told| episodes.iter().map(|episode| reached(is_told, episode)).sum())
}

#[test]
fn agents_that_know_their_goals_to_come_reach_more_of_them() {
    let crowds: Vec<_> = (0..6).map(|seed| drawn(seed, 12, 16, "restart")).collect();
    let puzzle = |puzzle: &Puzzle| {
        let rows = named_map(puzzle.name).unwrap().map.rows();
        made(&json!({
            "map": rows.join("\n"), "num_agents": 2, "seed": 0, "on_target": "restart",
            "collision_system": "soft", "max_episode_steps": 256,
        }))
    };
    let pairs: Vec<_> = PUZZLES.iter().map(puzzle).collect();
    for episodes in [crowds, pairs] {
        let [unknown, known] = reached_by_knowing(&episodes);
        assert!(known > unknown, "{known} goals by knowing, {unknown} without");
    }
}

#[test]
fn goals_to_come_are_those_of_one_episode_and_for_planners_that_use_them() {
    let (config, instance) = drawn(1, 12, 16, "restart");
    let new = |name| LifelongPolicy::new(name, PlannerSettings::default(), Budget::of_nodes(50));
    assert!(new(LifelongName::Pibt).provide_future_goals(&instance).is_err());
    let mut policy = new(LifelongName::Rhcr);
    policy.provide_future_goals(&instance).unwrap();
    let other = started(&config.rules(), &drawn(2, 12, 16, "restart").1);
    assert!(
        policy
            .act(instance.map(), other.state())
            .unwrap_err()
            .to_string()
            .contains("does not match its future goals")
    );
    policy.reset();
    let episode = started(&config.rules(), &instance);
    policy.provide_future_goals(&instance).unwrap();
    policy.act(instance.map(), episode.state()).unwrap();
    let again = policy.act(instance.map(), episode.state()).unwrap_err().to_string();
    assert_eq!(again, "found the state of step 0, expected step 1 of the same episode");
}

#[test]
fn agents_that_finish_leave_and_the_others_go_on() {
    for seed in 0..8 {
        let (config, instance) = drawn(seed, 8, 8, "finish");
        let planner = PlannerName::Lacam.make(PlannerSettings::default());
        let mut policy = PlannerPolicy::new(planner, Budget::of_nodes(300), Some(64));
        let (num_reached, _) =
            play(&config.rules(), &instance, |state| policy.act(instance.map(), state).unwrap());
        let is_solved = policy.outcomes()[0].solution().is_some();
        assert!(!is_solved || num_reached == 8.0, "seed {seed}: {num_reached} of 8");
        assert!(!is_solved || policy.outcomes().len() == 1, "seed {seed}: planned anew");
    }
}

#[test]
fn a_policy_plans_anew_when_the_world_is_another() {
    let (config, instance) = drawn(3, 8, 4, "nothing");
    let rules = Config { collision: Collision::Priority, on_goal: OnGoal::Nothing, ..config.rules() };
    let mut policy = PlannerPolicy::new(
        PlannerName::Lacam.make(PlannerSettings::default()),
        Budget::of_nodes(300),
        Some(64),
    );
    let mut count = 0;
    play(&rules, &instance, |state| {
        count += 1;
        let actions = policy.act(instance.map(), state).unwrap();
        // Somebody else moves everyone in the fifth step.
        if count == 5 { vec![pogema_core::Action::Up; 4] } else { actions }
    });
    assert!(policy.outcomes().len() > 1);
    policy.reset();
    assert!(policy.outcomes().is_empty());
}

#[test]
fn a_single_attempt_is_not_repeated() {
    let (config, instance) = drawn(3, 8, 4, "nothing");
    let num_attempts = |is_single: bool| {
        let planner = PlannerName::Cbs.make(PlannerSettings::default());
        let policy = PlannerPolicy::new(planner, Budget::of_nodes(0), Some(64));
        let mut policy = if is_single { policy.with_single_attempt() } else { policy };
        play(&config.rules(), &instance, |state| policy.act(instance.map(), state).unwrap());
        policy.outcomes().len()
    };
    assert_eq!(num_attempts(true), 1);
    assert!(num_attempts(false) > 1);
}
