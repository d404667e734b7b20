//! Validates plans of every planner and plays them on the reference engine, which must execute every move.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pogema_core::{
    Cell, Collision, Config, Episode, GoalStream, Instance, Map, OnGoal, Outside, State, Words,
};
use pogema_maps::{GridConfig, InstanceSource, PUZZLES, Puzzle, named_map};
use pogema_planners::{
    Budget, ConflictKind, LifelongName, LifelongPolicy, Plan, PlannerName, PlannerPolicy, PlannerSettings,
    Problem, validate,
};
use pogema_reference::Reference;
use serde_json::json;

fn random_instance(seed: u64, size: u64, num_agents: u64, on_target: &str) -> (GridConfig, Instance) {
    let fields = json!({
        "seed": seed, "size": size, "num_agents": num_agents, "density": 0.25, "on_target": on_target,
        "collision_system": "soft", "max_episode_steps": 64,
    });
    generate(&fields)
}

fn generate(fields: &serde_json::Value) -> (GridConfig, Instance) {
    let config = GridConfig::from_value(fields).unwrap();
    let instance = InstanceSource::new(config.clone(), None).unwrap().generate().unwrap().instance;
    (config, instance)
}

fn start_episode(config: &Config, instance: &Instance) -> Episode<Reference> {
    let mut episode = Episode::new(Reference::new(*config).unwrap()).with_collisions();
    episode.start(instance.clone()).unwrap();
    episode
}

/// Plays a plan; returns the first step in which the engine deviates from it.
fn first_deviation(config: &Config, instance: &Instance, plan: &Plan) -> Option<usize> {
    let mut episode = start_episode(config, instance);
    (0..plan.num_steps()).find(|&step| {
        episode.step(&plan.actions(step).unwrap()).unwrap();
        episode.state().cells != plan.cells()[step + 1]
    })
}

#[test]
fn the_reference_executes_plans_without_deviation() {
    for name in PlannerName::all() {
        let mut num_solved = 0;
        for seed in 0..30 {
            let num_agents = if matches!(name, PlannerName::Cbs | PlannerName::Ecbs) { 4 } else { 10 };
            let (config, instance) = random_instance(seed, 10, num_agents, "nothing");
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
            assert_eq!(first_deviation(&rules, &instance, plan), None, "{name}, seed {seed}");
            num_solved += usize::from(outcome.solution().is_some());
        }
        assert!(num_solved >= 24, "{name} solved {num_solved} of 30");
    }
}

#[test]
fn the_engine_detects_an_invalid_plan() {
    let map = Map::from_rows(&[".."]).unwrap();
    let ends = [map.cell_at(0), map.cell_at(1)];
    let goals = vec![GoalStream::single(ends[1]), GoalStream::single(ends[0])];
    let instance = Instance::new(map, Outside::Free, ends.to_vec(), goals).unwrap();
    let swap = Plan::new(vec![ends.to_vec(), vec![ends[1], ends[0]]]).unwrap();
    let config = Config { num_agents: 2, collision: Collision::Soft, ..Config::default() };
    assert_eq!(first_deviation(&config, &instance, &swap), Some(0));
    let conflict = validate(instance.map(), instance.starts(), None, &swap).unwrap_err();
    assert_eq!(conflict.kind, ConflictKind::Edge);
}

/// What a policy achieved in an episode.
struct Played {
    num_reached: f32,
    num_reverted: f64,
    /// Whether each agent is active at the end.
    active: Vec<bool>,
}

/// Plays an episode with a policy.
fn play(
    config: &Config,
    instance: &Instance,
    mut act: impl FnMut(State<'_>) -> Vec<pogema_core::Action>,
) -> Played {
    let (mut episode, mut num_reached) = (start_episode(config, instance), 0.0);
    for _ in 0..config.max_steps {
        episode.step(&act(episode.state())).unwrap();
        num_reached += episode.rewards().iter().sum::<f32>();
    }
    let metrics = episode.metrics();
    let num_reverted = metrics.a_collisions.unwrap() + metrics.o_collisions.unwrap();
    Played { num_reached, num_reverted, active: episode.state().active.to_vec() }
}

#[test]
fn lifelong_planners_reach_goals_without_collisions() {
    for name in LifelongName::all() {
        for seed in 0..4 {
            let (config, instance) = random_instance(seed, 12, 12, "restart");
            let mut policy =
                LifelongPolicy::new(name, PlannerSettings { seed, threads: 1 }, Budget::of_nodes(200));
            let Played { num_reached, num_reverted, .. } =
                play(&config.rules(), &instance, |state| policy.act(instance.map(), state).unwrap());
            assert_eq!(num_reverted, 0.0, "{name}, seed {seed}");
            assert!(num_reached > 40.0, "{name}, seed {seed}: {num_reached} goals");
        }
    }
}

/// Returns the number of goals reached by agents that know only their current goals, and by agents that also know
/// future goals.
fn reached_without_and_with_future_goals(episodes: &[(GridConfig, Instance)]) -> [f32; 2] {
    let reached = |is_informed: bool, (config, instance): &(GridConfig, Instance)| {
        let mut policy =
            LifelongPolicy::new(LifelongName::Rhcr, PlannerSettings::default(), Budget::of_nodes(200));
        if is_informed {
            policy.provide_future_goals(instance).unwrap();
        }
        // The policy returns an error if a goal differs from the provided one.
        let Played { num_reached, num_reverted, .. } =
            play(&config.rules(), instance, |state| policy.act(instance.map(), state).unwrap());
        assert_eq!(num_reverted, 0.0, "seed {:?}", config.seed);
        num_reached
    };
    [false, true].map(|is_informed| episodes.iter().map(|episode| reached(is_informed, episode)).sum())
}

#[test]
fn agents_that_know_future_goals_reach_more_goals() {
    let crowds: Vec<_> = (0..6).map(|seed| random_instance(seed, 12, 16, "restart")).collect();
    let puzzle = |puzzle: &Puzzle| {
        let rows = named_map(puzzle.name).unwrap().map.rows();
        generate(&json!({
            "map": rows.join("\n"), "num_agents": 2, "seed": 0, "on_target": "restart",
            "collision_system": "soft", "max_episode_steps": 256,
        }))
    };
    let pairs: Vec<_> = PUZZLES.iter().map(puzzle).collect();
    for episodes in [crowds, pairs] {
        let [unknown, known] = reached_without_and_with_future_goals(&episodes);
        assert!(known > unknown, "{known} goals with future goals, {unknown} without");
    }
}

#[test]
fn future_goals_belong_to_one_episode_and_to_planners_that_use_them() {
    let (config, instance) = random_instance(1, 12, 16, "restart");
    let new = |name| LifelongPolicy::new(name, PlannerSettings::default(), Budget::of_nodes(50));
    let error = new(LifelongName::Pibt).provide_future_goals(&instance).unwrap_err().to_string();
    assert!(error.contains("expected a planner that uses future goals, such as `rhcr`"), "{error}");
    let mut policy = new(LifelongName::Rhcr);
    policy.provide_future_goals(&instance).unwrap();
    let other = start_episode(&config.rules(), &random_instance(2, 12, 16, "restart").1);
    assert!(
        policy
            .act(instance.map(), other.state())
            .unwrap_err()
            .to_string()
            .contains("does not match its future goals")
    );
    policy.reset();
    let episode = start_episode(&config.rules(), &instance);
    policy.provide_future_goals(&instance).unwrap();
    policy.act(instance.map(), episode.state()).unwrap();
    let again = policy.act(instance.map(), episode.state()).unwrap_err().to_string();
    assert_eq!(again, "found the state of step 0, expected step 1 of the same episode");
}

#[test]
fn finished_agents_leave_and_the_others_continue() {
    let mut num_solved = 0;
    for seed in 0..8 {
        let (config, instance) = random_instance(seed, 8, 8, "finish");
        let planner = PlannerName::Lacam.make(PlannerSettings::default());
        let mut policy = PlannerPolicy::new(planner, Budget::of_nodes(300), Some(64));
        let Played { num_reached, active, .. } =
            play(&config.rules(), &instance, |state| policy.act(instance.map(), state).unwrap());
        if policy.first_outcome().unwrap().solution().is_some() {
            assert_eq!(num_reached, 8.0, "seed {seed}");
            assert_eq!(active, [false; 8], "seed {seed}");
            assert_eq!(policy.num_calls(), 1, "seed {seed}: replanned");
            num_solved += 1;
        }
    }
    assert!(num_solved >= 6, "solved {num_solved} of 8");
}

#[test]
fn a_policy_replans_after_an_unexpected_state() {
    let (config, instance) = random_instance(3, 8, 4, "nothing");
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
        // In the fifth step, the agents deviate from the plan.
        if count == 5 { vec![pogema_core::Action::Up; 4] } else { actions }
    });
    assert!(policy.num_calls() > 1);
    policy.reset();
    assert_eq!((policy.num_calls(), policy.first_outcome()), (0, None));
}

#[test]
fn a_goal_beyond_the_step_limit_does_not_stop_the_other_agents() {
    let map = Map::new(5, 30, vec![false; 150]).unwrap();
    let starts: Vec<Cell> = (0..5).map(|row| Cell::new(row, 0)).collect();
    let goal = |row: u16| GoalStream::single(Cell::new(row, if row == 2 { 29 } else { 6 }));
    let instance = Instance::new(map, Outside::Free, starts, (0..5).map(goal).collect()).unwrap();
    let config = Config {
        num_agents: 5,
        collision: Collision::Soft,
        on_goal: OnGoal::Finish,
        max_steps: 20,
        ..Config::default()
    };
    for name in PlannerName::all() {
        let reached = |is_single: bool| {
            let planner = name.make(PlannerSettings::default());
            let policy = PlannerPolicy::new(planner, Budget::of_nodes(300), Some(20));
            let mut policy = if is_single { policy.with_single_attempt() } else { policy };
            let Played { num_reached, .. } =
                play(&config, &instance, |state| policy.act(instance.map(), state).unwrap());
            let proof = policy.first_outcome().unwrap().to_string();
            assert!(proof.contains("agent 2 needs 29 steps"), "{name}: {proof}");
            (num_reached, policy.num_calls())
        };
        assert_eq!(reached(false), (4.0, 2), "{name}");
        assert_eq!(reached(true), (0.0, 1), "{name}");
    }
}

#[test]
fn a_single_attempt_is_not_repeated() {
    let (config, instance) = random_instance(3, 8, 4, "nothing");
    let num_attempts = |is_single: bool| {
        let planner = PlannerName::Cbs.make(PlannerSettings::default());
        let policy = PlannerPolicy::new(planner, Budget::of_nodes(0), Some(64));
        let mut policy = if is_single { policy.with_single_attempt() } else { policy };
        play(&config.rules(), &instance, |state| policy.act(instance.map(), state).unwrap());
        policy.num_calls()
    };
    assert_eq!(num_attempts(true), 1);
    assert!(num_attempts(false) > 1);
}

#[test]
fn errors_name_the_agent_even_if_agents_before_it_have_finished() {
    let map = Map::new(1, 4, vec![false, false, false, true]).unwrap();
    let (free, obstacle) = (Cell::new(0, 1), Cell::new(0, 3));
    let error = |cells: &[Cell], goals: &[Cell]| {
        let state = State { step: 0, cells, goals, active: &[false, true], on_goal: &[false; 2] };
        let planner = PlannerName::Lacam.make(PlannerSettings::default());
        let one_shot = PlannerPolicy::new(planner, Budget::of_nodes(10), None).act(&map, state);
        let lifelong =
            LifelongPolicy::new(LifelongName::Pibt, PlannerSettings::default(), Budget::of_nodes(10));
        let errors = [one_shot, { lifelong }.act(&map, state)].map(|result| result.unwrap_err().to_string());
        assert_eq!(errors[0], errors[1]);
        errors[0].clone()
    };
    let expected = |what: &str| format!("instance: agent 1: {what} (0, 3) is not a free cell of the map");
    assert_eq!(error(&[free, obstacle], &[free; 2]), expected("the agent's cell"));
    assert_eq!(error(&[free; 2], &[free, obstacle]), expected("goal"));
}
