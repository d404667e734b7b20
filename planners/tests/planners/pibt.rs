//! PIBT: steps are always valid, one-shot and lifelong.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use pogema_core::{Cell, Map};
use pogema_planners::{
    Budget, Graph, GuidanceParams, Outcome, Pibt, PibtLifelong, PibtParams, PibtRules, Plan, Planner,
    Problem, Vertex, validate,
};
use proptest::prelude::*;

use crate::common::problem;

fn rules() -> impl Strategy<Value = PibtRules> {
    (any::<bool>(), any::<bool>()).prop_map(|(swap, hindrance)| PibtRules { swap, hindrance })
}

/// Generates no guidance, the default, or costs that are too large to be added.
fn guidance() -> impl Strategy<Value = Option<GuidanceParams>> {
    let usual = GuidanceParams::default();
    let costs = [
        usual,
        GuidanceParams { edge: 2_000_000_000, ..usual },
        GuidanceParams { contraflow: u32::MAX, ..usual },
        GuidanceParams { congestion: u32::MAX, ..usual },
    ];
    prop::option::of(prop::sample::select(costs.to_vec()))
}

/// Generates a map with some obstacles, the starts of agents, and four goals for each agent, visited in turn.
fn problems() -> impl Strategy<Value = (Map, Vec<Cell>, Vec<Vec<Cell>>)> {
    (2..9_usize, 2..9_usize, 1..30_usize).prop_flat_map(|(height, width, num_agents)| {
        let obstacles = prop::collection::vec(prop::bool::weighted(0.2), height * width);
        obstacles.prop_flat_map(move |mut obstacles| {
            obstacles[0] = false;
            let map = Map::new(height, width, obstacles).unwrap();
            let indices = 0..height * width;
            let free: Vec<Cell> =
                indices.map(|index| map.cell_at(index)).filter(|&cell| !map.is_obstacle(cell)).collect();
            let num_agents = num_agents.min(free.len());
            let starts = Just(free.clone()).prop_shuffle().prop_map(move |free| free[..num_agents].to_vec());
            let goals =
                prop::collection::vec(prop::collection::vec(prop::sample::select(free), 4), num_agents);
            (Just(map), starts, goals)
        })
    })
}

proptest! {
    #[test]
    fn plans_are_valid_even_if_agents_do_not_arrive(
        (map, starts, goals) in problems(),
        rules in rules(),
        seed: u64,
    ) {
        let goals: Vec<Cell> = goals.iter().map(|goals| goals[0]).collect();
        let problem = Problem::new(&map, &starts, &goals).unwrap().within(60);
        match Pibt::new(PibtParams { seed, rules, guidance: None }).plan(&problem, &Budget::default()) {
            Outcome::Solved { plan, lower_bound } => {
                prop_assert_eq!(validate(&map, &starts, Some(&goals), &plan), Ok(()));
                prop_assert!(lower_bound <= plan.sum_of_costs() as u64 && plan.num_steps() <= 60);
            }
            Outcome::TimedOut { .. } => prop_assert!(false, "timed out with an unlimited budget"),
            Outcome::GaveUp { best, .. } => {
                prop_assert_eq!(validate(&map, &starts, None, &best.unwrap()), Ok(()));
            }
            Outcome::Impossible { reason } => {
                let mut wanted = goals.clone();
                wanted.sort_unstable();
                wanted.dedup();
                prop_assert!(wanted.len() < goals.len() || reason.contains("no path") || reason.contains("needs"));
            }
        }
    }

    #[test]
    fn lifelong_steps_are_valid_for_any_goals(
        (map, starts, goals) in problems(),
        rules in rules(),
        guidance in guidance(),
        seed: u64,
    ) {
        let graph = Arc::new(Graph::new(&map));
        let mut pibt = PibtLifelong::new(graph.clone(), PibtParams { seed, rules, guidance });
        let mut now = graph.vertices_of("start", &starts).unwrap();
        let mut turns = vec![0; starts.len()];
        let mut steps = vec![starts.clone()];
        for _ in 0..40 {
            let wanted: Vec<Cell> = turns.iter().zip(&goals).map(|(&turn, goals)| goals[turn % 4]).collect();
            let wanted = graph.vertices_of("goal", &wanted).unwrap();
            now = pibt.step(&now, &wanted).unwrap().to_vec();
            for (agent, turn) in turns.iter_mut().enumerate() {
                *turn += usize::from(now[agent] == wanted[agent]);
            }
            steps.push(now.iter().map(|&vertex| graph.cell(vertex)).collect());
        }
        prop_assert_eq!(validate(&map, &starts, None, &Plan::new(steps).unwrap()), Ok(()));
    }
}

#[test]
fn two_agents_pass_each_other_beside_a_corridor() {
    let problem = problem(&["....", "#.##"], &[(0, 0), (0, 3)], &[(0, 3), (0, 0)]).within(20);
    let outcome = Pibt::default().plan(&problem, &Budget::default());
    assert!(outcome.solution().is_some_and(|plan| plan.num_steps() <= 12), "{outcome}");
}

#[test]
fn planning_gives_up_on_circling_agents_before_a_distant_step_limit() {
    let swap = || problem(&["...."], &[(0, 0), (0, 3)], &[(0, 3), (0, 0)]);
    for (problem, most) in [(swap(), 140), (swap().within(300), 300), (swap().within(usize::MAX), 10_000)] {
        let outcome = Pibt::default().plan(&problem, &Budget::default());
        let Outcome::GaveUp { best: Some(best), .. } = outcome else { unreachable!("{outcome}") };
        assert_eq!(best.num_steps(), most);
    }
}

#[test]
fn degenerate_problems_have_outcomes() {
    let outcome_text = |problem: Problem| Pibt::default().plan(&problem, &Budget::default()).to_string();
    assert_eq!(
        outcome_text(problem(&[".."], &[], &[])),
        "solved: sum of costs 0 (lower bound 0), makespan 0"
    );
    assert_eq!(
        outcome_text(problem(&[".."], &[(0, 1)], &[(0, 1)])),
        "solved: sum of costs 0 (lower bound 0), makespan 0"
    );
    assert_eq!(
        outcome_text(problem(&[".."], &[(0, 0), (0, 1)], &[(0, 1), (0, 0)])),
        "gave up; sum of costs at least 2"
    );
    assert_eq!(
        outcome_text(problem(&[".#."], &[(0, 0)], &[(0, 2)])),
        "impossible: no path leads agent 0 from (0, 0) to (0, 2)"
    );
    assert_eq!(
        outcome_text(problem(&["."], &[(0, 0), (0, 0)], &[(0, 0), (0, 0)])),
        "impossible: agents 0 and 1 have the same start (0, 0)"
    );
}

#[test]
fn a_spent_budget_times_out() {
    let problem = problem(&["..."], &[(0, 0)], &[(0, 2)]);
    let cancelled = Budget { cancelled: Some(Arc::new(AtomicBool::new(true))), ..Budget::default() };
    for (budget, num_steps) in [(Budget::of_nodes(0), 0), (Budget::of_nodes(1), 1), (cancelled, 0)] {
        let Outcome::TimedOut { best: Some(best), .. } = Pibt::default().plan(&problem, &budget) else {
            unreachable!("{budget:?}");
        };
        assert_eq!(best.num_steps(), num_steps);
    }
}

#[test]
fn invalid_positions_and_goals_are_rejected() {
    let graph = Arc::new(Graph::new(&Map::from_rows(&["..."]).unwrap()));
    let mut pibt = PibtLifelong::new(graph, PibtParams::default());
    let mut error = |now: &[Vertex], goals: &[Vertex]| pibt.step(now, goals).unwrap_err().to_string();
    assert_eq!(error(&[0], &[0, 1]), "goals has length 2, expected 1");
    assert_eq!(error(&[0, 1], &[0]), "goals has length 1, expected 2");
    assert_eq!(error(&[0, 3], &[0, 1]), "instance: agent 1: position is vertex 3, expected a vertex below 3");
    assert_eq!(error(&[0, 1], &[0, 9]), "instance: agent 1: goal is vertex 9, expected a vertex below 3");
    assert_eq!(error(&[1, 1], &[0, 2]), "instance: agent 1: it shares vertex 1 with agent 0");
    assert_eq!(pibt.step(&[0, 1], &[0, 2]).unwrap(), [0, 2]);
}

#[test]
fn the_same_seed_gives_the_same_plan() {
    let starts: Vec<(u16, u16)> = (0..12).map(|agent| (agent / 6, agent % 6)).collect();
    let goals: Vec<(u16, u16)> = starts.iter().map(|&(row, col)| (5 - row, 5 - col)).collect();
    let problem = problem(&["......"; 6], &starts, &goals);
    let plan =
        |seed| Pibt::new(PibtParams { seed, ..PibtParams::default() }).plan(&problem, &Budget::of_nodes(50));
    assert_eq!(plan(3), plan(3));
    assert!((0..5).any(|seed| plan(seed) != plan(3)));
}

#[test]
fn guidance_around_traffic_increases_throughput() {
    let shelves = format!(".{}.", ".########".repeat(4));
    let rows: Vec<String> =
        (0..16).map(|row| if row % 4 == 2 { shelves.clone() } else { ".".repeat(38) }).collect();
    let map = Map::from_rows(&rows).unwrap();
    let graph = Arc::new(Graph::new(&map));
    let num_vertices = graph.num_vertices();
    let reached = |guidance| {
        let mut now: Vec<Vertex> = (0..num_vertices as Vertex).step_by(3).take(140).collect();
        let mut pibt = PibtLifelong::new(graph.clone(), PibtParams { guidance, ..PibtParams::default() });
        let mut draws = 0;
        let mut goals: Vec<Vertex> =
            now.iter().map(|&start| (start * 7 + 5) % num_vertices as Vertex).collect();
        for _ in 0..200 {
            now = pibt.step(&now, &goals).unwrap().to_vec();
            for (agent, goal) in goals.iter_mut().enumerate() {
                if now[agent] == *goal {
                    draws += 1;
                    *goal = (*goal * 31 + draws * 17 + agent as Vertex) % num_vertices as Vertex;
                }
            }
        }
        draws
    };
    let (shortest, guided) = (reached(None), reached(Some(GuidanceParams::default())));
    assert!(guided > shortest, "reached {guided} goals with guidance, {shortest} without");
}
