//! LaCAM* against brute force, with degenerate problems, and with equal seeds.

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use pogema_core::{Cell, Map, OnGoal};
use pogema_planners::{
    Budget, Lacam, LacamParams, Outcome, PibtRules, Planner, Problem, Solvability, validate,
};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::common::joint_oracle::oracle;
use crate::common::problem;

fn below(random: &mut Pcg64Mcg, bound: usize) -> usize {
    random.next_u32() as usize % bound
}

/// Draws a random map with random starts and goals. The problem may be unsolvable.
fn random_problem(
    random: &mut Pcg64Mcg,
    height: usize,
    width: usize,
    num_agents: usize,
) -> (Map, Vec<Cell>, Vec<Cell>) {
    loop {
        let obstacles = (0..height * width).map(|_| below(random, 4) == 0).collect();
        let map = Map::new(height, width, obstacles).unwrap();
        let free: Vec<Cell> = (0..height * width)
            .map(|index| map.cell_at(index))
            .filter(|&cell| !map.is_obstacle(cell))
            .collect();
        if free.len() >= num_agents {
            let starts = draw(random, free.clone(), num_agents);
            let goals = draw(random, free, num_agents);
            return (map, starts, goals);
        }
    }
}

fn draw(random: &mut Pcg64Mcg, mut cells: Vec<Cell>, count: usize) -> Vec<Cell> {
    (0..count).map(|_| cells.swap_remove(below(random, cells.len()))).collect()
}

/// Returns all successors of a configuration.
fn steps(problem: &Problem, now: &[u32]) -> Vec<Vec<u32>> {
    let mut found: Vec<Vec<u32>> = vec![Vec::new()];
    for (agent, &here) in now.iter().enumerate() {
        let mut longer = Vec::new();
        for next in &found {
            for &place in problem.graph.neighbours(here).iter().chain([&here]) {
                let conflicts = next.iter().enumerate().any(|(other, &there)| {
                    there == place || (there == here && now[other] == place && other != agent)
                });
                if !conflicts {
                    longer.push(next.iter().copied().chain([place]).collect());
                }
            }
        }
        found = longer;
    }
    found
}

/// Returns the least makespan of any plan, by breadth-first search over all configurations.
fn least_steps(problem: &Problem) -> Option<usize> {
    let mut known = HashMap::from([(problem.starts.clone(), 0)]);
    let mut queue = VecDeque::from([problem.starts.clone()]);
    while let Some(now) = queue.pop_front() {
        let step = known[&now];
        if now == problem.goals {
            return Some(step);
        }
        for next in steps(problem, &now) {
            known.entry(next.clone()).or_insert_with(|| {
                queue.push_back(next);
                step + 1
            });
        }
    }
    None
}

fn lacam(seed: u64) -> Lacam {
    Lacam::new(LacamParams { seed, ..LacamParams::default() })
}

#[test]
fn every_problem_is_solved_or_proved_impossible() {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let mut num_solved = 0;
    for case in 0..3000 {
        let (height, width) = (1 + below(&mut random, 3), 2 + below(&mut random, 3));
        let num_agents = 1 + below(&mut random, 4.min(height * width / 2));
        let (map, starts, goals) = random_problem(&mut random, height, width, num_agents);
        let problem = Problem::new(&map, &starts, &goals).unwrap();
        let planner = &mut Lacam::new(LacamParams { seed: case, refine: false, ..LacamParams::default() });
        let outcome = planner.plan(&problem, &Budget::default());
        let least = least_steps(&problem);
        match &outcome {
            Outcome::Solved { plan, .. } => {
                validate(&map, &starts, Some(&goals), plan).unwrap();
                assert!(plan.num_steps() >= least.unwrap());
                num_solved += 1;
            }
            _ => assert_eq!(least, None, "case {case}: {outcome}\n{}", map.rows().join("\n")),
        }
        if least.is_none() {
            assert!(matches!(outcome, Outcome::Impossible { .. }), "case {case}: {outcome}");
        }
    }
    assert!((1000..2900).contains(&num_solved), "{num_solved}");
}

#[test]
fn most_plans_are_optimal_and_lower_bounds_hold() {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let (mut num_solved, mut num_optimal) = (0, 0);
    for case in 0..400 {
        let num_agents = 2 + below(&mut random, 2);
        let (map, starts, goals) = random_problem(&mut random, 3, 3, num_agents);
        let problem = Problem::new(&map, &starts, &goals).unwrap();
        let Solvability::Solvable { sum_of_costs: least } =
            oracle(&map, &starts, &goals, OnGoal::Nothing, 1_000_000)
        else {
            continue;
        };
        let outcome = lacam(case).plan(&problem, &Budget::of_nodes(5000));
        let Outcome::Solved { plan, lower_bound } = &outcome else {
            unreachable!("case {case}: {outcome}");
        };
        validate(&map, &starts, Some(&goals), plan).unwrap();
        let cost = plan.sum_of_costs() as u64;
        assert!(*lower_bound <= least && least <= cost, "case {case}: {lower_bound} <= {least} <= {cost}");
        num_solved += 1;
        num_optimal += u32::from(cost == least);
    }
    assert!(num_solved > 200 && num_optimal * 100 >= num_solved * 97, "{num_optimal} of {num_solved}");
}

#[test]
fn the_step_limit_is_met_or_proved_too_low() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let mut num_proved = 0;
    for case in 0..150 {
        let (map, starts, goals) = random_problem(&mut random, 3, 3, 3);
        let problem = Problem::new(&map, &starts, &goals).unwrap();
        let Some(least) = least_steps(&problem) else {
            continue;
        };
        for limit in [least, least.saturating_sub(1)] {
            let outcome = lacam(case).plan(&problem.clone().within(limit), &Budget::of_nodes(200_000));
            if limit == least {
                let plan = outcome.solution();
                assert!(
                    plan.is_some_and(|plan| plan.num_steps() <= limit),
                    "case {case}, limit {limit}: {outcome}"
                );
            } else if least > 0 {
                let Outcome::Impossible { reason } = &outcome else {
                    unreachable!("case {case}, limit {limit}: {outcome}");
                };
                assert!(
                    reason.ends_with(&format!("the step limit is {limit}"))
                        || reason.ends_with(&format!("within the step limit of {limit}")),
                    "case {case}: {reason}"
                );
                num_proved += 1;
            }
        }
    }
    assert!(num_proved > 30);
}

#[test]
fn a_huge_step_limit_changes_no_plan() {
    let (map, starts, goals) = crowd(5, 16, 40);
    let problem = Problem::new(&map, &starts, &goals).unwrap();
    let plan = |problem: &Problem| lacam(0).plan(problem, &Budget::of_nodes(3000));
    let unlimited = plan(&problem);
    for limit in [u32::MAX as usize, 1 << 32, usize::MAX] {
        assert_eq!(plan(&problem.clone().within(limit)), unlimited, "{limit}");
    }
}

#[test]
fn degenerate_problems_have_outcomes() {
    let outcome_text = |problem: Problem| lacam(0).plan(&problem, &Budget::default()).to_string();
    let solved = |costs: &str| format!("solved: sum of costs {costs}");
    assert!(outcome_text(problem(&[".."], &[], &[])).starts_with(&solved("0 (lower bound 0)")));
    assert!(outcome_text(problem(&[".."], &[(0, 1)], &[(0, 1)])).starts_with(&solved("0 (lower bound 0)")));
    assert_eq!(
        outcome_text(problem(&[".."], &[(0, 0), (0, 1)], &[(0, 1), (0, 0)])),
        "impossible: the search exhausted all configurations"
    );
    assert_eq!(
        outcome_text(problem(&[".#."], &[(0, 0)], &[(0, 2)])),
        "impossible: no path leads agent 0 from (0, 0) to (0, 2)"
    );
    assert_eq!(
        outcome_text(problem(&["..."], &[(0, 0), (0, 1)], &[(0, 2), (0, 2)])),
        "impossible: agents 0 and 1 have the same goal (0, 2)"
    );
    assert_eq!(
        outcome_text(problem(&["."], &[(0, 0), (0, 0)], &[(0, 0), (0, 0)])),
        "impossible: agents 0 and 1 have the same start (0, 0)"
    );
}

#[test]
fn agents_locked_in_a_small_component_are_found_among_many() {
    let rows = ["..#.......", "##........", ".........."];
    let starts: Vec<(u16, u16)> = (3..10).map(|col| (1, col)).chain([(0, 0), (0, 1)]).collect();
    let mut goals: Vec<(u16, u16)> = (3..10).map(|col| (2, 12 - col)).chain([(0, 1), (0, 0)]).collect();
    assert_eq!(
        lacam(0).plan(&problem(&rows, &starts, &goals), &Budget::default()).to_string(),
        "impossible: the search exhausted all configurations of agents [7, 8] in their component"
    );
    goals.swap(7, 8);
    assert!(lacam(0).plan(&problem(&rows, &starts, &goals), &Budget::default()).solution().is_some());
}

#[test]
fn a_spent_budget_times_out_with_a_valid_partial_plan() {
    let cancelled = Budget { cancelled: Some(Arc::new(AtomicBool::new(true))), ..Budget::default() };
    let map = Map::from_rows(&["....", "...."]).unwrap();
    let (start, goal) = (Cell { row: 0, col: 0 }, Cell { row: 1, col: 3 });
    let problem = Problem::new(&map, &[start], &[goal]).unwrap();
    for budget in
        [Budget::of_nodes(0), Budget::of_time(std::time::Duration::ZERO), cancelled, Budget::of_nodes(2)]
    {
        let Outcome::TimedOut { best: Some(best), .. } = lacam(0).plan(&problem, &budget) else {
            unreachable!("{budget:?}");
        };
        validate(&map, &[start], None, &best).unwrap();
        assert_eq!(best.num_steps() as u64, budget.nodes.unwrap_or(0));
    }
}

#[test]
fn a_search_without_memory_proves_nothing() {
    let one = problem(&["...", "..."], &[(0, 0)], &[(1, 2)]);
    let three = problem(&["....", "....", "...."], &[(0, 0), (0, 3), (2, 0)], &[(2, 3), (2, 0), (0, 3)]);
    let mut num_unsolved = 0;
    for max_bytes in (0..4000).step_by(100) {
        let mut planner = Lacam::new(LacamParams { max_bytes, ..LacamParams::default() });
        for budget in [Budget::default(), Budget::of_nodes(2000)] {
            for problem in [&one, &three] {
                let outcome = planner.plan(problem, &budget);
                assert!(!matches!(outcome, Outcome::Impossible { .. }), "{max_bytes} bytes: {outcome}");
                num_unsolved += usize::from(outcome.solution().is_none());
            }
        }
    }
    assert!(num_unsolved > 10, "{num_unsolved}");
}

/// Draws a crowd on an open map with some obstacles.
fn crowd(seed: u64, side: usize, num_agents: usize) -> (Map, Vec<Cell>, Vec<Cell>) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let obstacles = (0..side * side).map(|_| below(&mut random, 12) == 0).collect();
    let map = Map::new(side, side, obstacles).unwrap();
    let is_passable = |&cell: &Cell| {
        let around = [(0, 1), (1, 0), (0, -1), (-1, 0)];
        let is_open = around.iter().filter(|(down, right)| {
            let (row, col) = (i32::from(cell.row) + down, i32::from(cell.col) + right);
            let inside = row >= 0 && col >= 0 && row < side as i32 && col < side as i32;
            inside && !map.is_obstacle(Cell { row: row as u16, col: col as u16 })
        });
        !map.is_obstacle(cell) && is_open.count() >= 3
    };
    let free: Vec<Cell> = (0..side * side).map(|index| map.cell_at(index)).filter(is_passable).collect();
    let starts = draw(&mut random, free.clone(), num_agents);
    let goals = draw(&mut random, free, num_agents);
    (map, starts, goals)
}

#[test]
fn the_same_seed_and_nodes_give_the_same_plan() {
    let (map, starts, goals) = crowd(5, 16, 40);
    let problem = Problem::new(&map, &starts, &goals).unwrap().within(100);
    let plan = |seed| lacam(seed).plan(&problem, &Budget::of_nodes(3000));
    let (first, other) = (plan(1), plan(2));
    assert_eq!(first, plan(1));
    assert_ne!(first, other);
    validate(&map, &starts, Some(&goals), first.solution().unwrap()).unwrap();
}

#[test]
fn more_nodes_give_better_plans() {
    let (map, starts, goals) = crowd(6, 16, 60);
    let problem = Problem::new(&map, &starts, &goals).unwrap().within(100);
    let cost = |nodes| {
        let outcome = lacam(0).plan(&problem, &Budget::of_nodes(nodes));
        let plan = outcome.solution().unwrap();
        validate(&map, &starts, Some(&goals), plan).unwrap();
        plan.sum_of_costs()
    };
    let costs = [200, 1000, 5000].map(cost);
    assert!(costs[0] > costs[1] && costs[1] > costs[2], "{costs:?}");
}

#[test]
fn two_threads_make_one_valid_plan() {
    let (map, starts, goals) = crowd(7, 20, 80);
    let problem = Problem::new(&map, &starts, &goals).unwrap();
    let mut planner = Lacam::new(LacamParams { threads: 2, ..LacamParams::default() });
    for _ in 0..5 {
        let outcome = planner.plan(&problem, &Budget::of_nodes(2000));
        validate(&map, &starts, Some(&goals), outcome.solution().unwrap()).unwrap();
    }
}

#[test]
fn every_pibt_rule_can_be_disabled() {
    let (map, starts, goals) = crowd(8, 12, 30);
    let problem = Problem::new(&map, &starts, &goals).unwrap();
    for (swap, hindrance) in [(false, false), (false, true), (true, false)] {
        let params = LacamParams { pibt: PibtRules { swap, hindrance }, ..LacamParams::default() };
        let outcome = Lacam::new(params).plan(&problem, &Budget::of_nodes(2000));
        validate(&map, &starts, Some(&goals), outcome.solution().unwrap()).unwrap();
    }
}

#[test]
fn a_thousand_agents_on_a_large_map_are_solved() {
    let (map, starts, goals) = crowd(9, 256, 1000);
    let problem = Problem::new(&map, &starts, &goals).unwrap();
    let params = LacamParams { max_bytes: 64 << 20, ..LacamParams::default() };
    let outcome = Lacam::new(params).plan(&problem, &Budget::of_nodes(2000));
    validate(&map, &starts, Some(&goals), outcome.solution().unwrap()).unwrap();
}
