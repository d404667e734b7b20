//! LaCAM* against brute force, against bad input and against its own seed.

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use pogema_core::{Cell, Map};
use pogema_planners::{Budget, Lacam, LacamParams, Outcome, PibtRules, Planner, Problem, validate};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

fn below(random: &mut Pcg64Mcg, bound: usize) -> usize {
    random.next_u32() as usize % bound
}

/// Agents at random on a map with obstacles at random, which may well be unsolvable.
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

/// A step of everybody: all configurations that one leads to.
fn steps(problem: &Problem, now: &[u32]) -> Vec<Vec<u32>> {
    let mut found: Vec<Vec<u32>> = vec![Vec::new()];
    for (agent, &here) in now.iter().enumerate() {
        let mut longer = Vec::new();
        for next in &found {
            for &place in problem.graph.neighbours(here).iter().chain([&here]) {
                let meets = next.iter().enumerate().any(|(other, &there)| {
                    there == place || (there == here && now[other] == place && other != agent)
                });
                if !meets {
                    longer.push(next.iter().copied().chain([place]).collect());
                }
            }
        }
        found = longer;
    }
    found
}

/// The least number of steps of any plan, by breadth first search over all configurations.
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

/// The least sum of costs of any plan: agents that are at their goals may say that they stay there, and cost nothing
/// from then on.
fn least_cost(problem: &Problem) -> Option<u64> {
    type State = (Vec<u32>, u32);
    let num_agents = problem.num_agents() as u32;
    let mut best: HashMap<State, u64> = HashMap::from([((problem.starts.clone(), 0), 0)]);
    let mut levels: Vec<Vec<State>> = vec![vec![(problem.starts.clone(), 0)]];
    let mut cost = 0;
    while cost < levels.len() {
        while let Some((now, resting)) = levels[cost].pop() {
            if best[&(now.clone(), resting)] < cost as u64 {
                continue;
            }
            if resting.count_ones() == num_agents {
                return Some(cost as u64);
            }
            let mut reach = |state: State, cost: usize| {
                let known = best.entry(state.clone()).or_insert(u64::MAX);
                if (cost as u64) < *known {
                    *known = cost as u64;
                    levels.resize_with(levels.len().max(cost + 1), Vec::new);
                    levels[cost].push(state);
                }
            };
            for agent in 0..num_agents {
                if now[agent as usize] == problem.goals[agent as usize] && resting >> agent & 1 == 0 {
                    reach((now.clone(), resting | 1 << agent), cost);
                }
            }
            for next in steps(problem, &now) {
                let stays =
                    |agent: u32| resting >> agent & 1 == 0 || next[agent as usize] == now[agent as usize];
                if (0..num_agents).all(stays) {
                    reach((next, resting), cost + (num_agents - resting.count_ones()) as usize);
                }
            }
        }
        cost += 1;
    }
    None
}

fn lacam(seed: u64) -> Lacam {
    Lacam::new(LacamParams { seed, ..LacamParams::default() })
}

#[test]
fn what_is_solvable_is_solved_and_what_is_not_is_proved_impossible() {
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
fn sums_of_costs_come_to_the_least_and_bounds_never_exceed_it() {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let (mut num_solved, mut num_optimal) = (0, 0);
    for case in 0..400 {
        let num_agents = 2 + below(&mut random, 2);
        let (map, starts, goals) = random_problem(&mut random, 3, 3, num_agents);
        let problem = Problem::new(&map, &starts, &goals).unwrap();
        let Some(least) = least_cost(&problem) else {
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
fn a_plan_keeps_to_the_cap_or_there_is_none() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let mut num_late = 0;
    for case in 0..150 {
        let (map, starts, goals) = random_problem(&mut random, 3, 3, 3);
        let problem = Problem::new(&map, &starts, &goals).unwrap();
        let Some(least) = least_steps(&problem) else {
            continue;
        };
        for cap in [least, least.saturating_sub(1)] {
            let outcome = lacam(case).plan(&problem.clone().within(cap), &Budget::of_nodes(200_000));
            if cap == least {
                let plan = outcome.solution();
                assert!(
                    plan.is_some_and(|plan| plan.num_steps() <= cap),
                    "case {case}, cap {cap}: {outcome}"
                );
            } else if least > 0 {
                assert!(matches!(outcome, Outcome::Impossible { .. }), "case {case}, cap {cap}: {outcome}");
                num_late += 1;
            }
        }
    }
    assert!(num_late > 30);
}

fn problem(rows: &[&str], starts: &[(u16, u16)], goals: &[(u16, u16)]) -> Problem {
    let cells =
        |places: &[(u16, u16)]| -> Vec<Cell> { places.iter().map(|&(row, col)| Cell { row, col }).collect() };
    Problem::new(&Map::from_rows(rows).unwrap(), &cells(starts), &cells(goals)).unwrap()
}

#[test]
fn bad_input_has_an_answer() {
    let told = |problem: Problem| lacam(0).plan(&problem, &Budget::default()).to_string();
    let solved = |costs: &str| format!("solved: sum of costs {costs}");
    assert!(told(problem(&[".."], &[], &[])).starts_with(&solved("0, at least 0")));
    assert!(told(problem(&[".."], &[(0, 1)], &[(0, 1)])).starts_with(&solved("0, at least 0")));
    assert_eq!(
        told(problem(&[".."], &[(0, 0), (0, 1)], &[(0, 1), (0, 0)])),
        "impossible: all that the agents can do was tried"
    );
    assert_eq!(
        told(problem(&[".#."], &[(0, 0)], &[(0, 2)])),
        "impossible: no path leads agent 0 from (0, 0) to (0, 2)"
    );
    assert_eq!(
        told(problem(&["..."], &[(0, 0), (0, 1)], &[(0, 2), (0, 2)])),
        "impossible: agents 0 and 1 both want to stay at (0, 2)"
    );
    assert_eq!(
        told(problem(&["."], &[(0, 0), (0, 0)], &[(0, 0), (0, 0)])),
        "impossible: agents 0 and 1 both start at (0, 0)"
    );
}

#[test]
fn who_is_stuck_in_a_part_of_the_map_is_found_among_many() {
    let rows = ["..#.......", "##........", ".........."];
    let starts: Vec<(u16, u16)> = (3..10).map(|col| (1, col)).chain([(0, 0), (0, 1)]).collect();
    let mut goals: Vec<(u16, u16)> = (3..10).map(|col| (2, 12 - col)).chain([(0, 1), (0, 0)]).collect();
    assert_eq!(
        lacam(0).plan(&problem(&rows, &starts, &goals), &Budget::default()).to_string(),
        "impossible: all that agents [7, 8] can do in their part of the map was tried"
    );
    goals.swap(7, 8);
    assert!(lacam(0).plan(&problem(&rows, &starts, &goals), &Budget::default()).solution().is_some());
}

#[test]
fn a_budget_of_nothing_is_timed_out_with_a_valid_beginning() {
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

/// A crowd on an open map with some obstacles.
fn crowd(seed: u64, side: usize, num_agents: usize) -> (Map, Vec<Cell>, Vec<Cell>) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let obstacles = (0..side * side).map(|_| below(&mut random, 12) == 0).collect();
    let map = Map::new(side, side, obstacles).unwrap();
    let problem_free = |&cell: &Cell| {
        let around = [(0, 1), (1, 0), (0, -1), (-1, 0)];
        let is_open = around.iter().filter(|(down, right)| {
            let (row, col) = (i32::from(cell.row) + down, i32::from(cell.col) + right);
            let inside = row >= 0 && col >= 0 && row < side as i32 && col < side as i32;
            inside && !map.is_obstacle(Cell { row: row as u16, col: col as u16 })
        });
        !map.is_obstacle(cell) && is_open.count() >= 3
    };
    let free: Vec<Cell> = (0..side * side).map(|index| map.cell_at(index)).filter(problem_free).collect();
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
fn more_nodes_give_no_worse_plans() {
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
fn every_rule_may_be_left_out() {
    let (map, starts, goals) = crowd(8, 12, 30);
    let problem = Problem::new(&map, &starts, &goals).unwrap();
    for (swap, hindrance) in [(false, false), (false, true), (true, false)] {
        let params = LacamParams { pibt: PibtRules { swap, hindrance }, ..LacamParams::default() };
        let outcome = Lacam::new(params).plan(&problem, &Budget::of_nodes(2000));
        validate(&map, &starts, Some(&goals), outcome.solution().unwrap()).unwrap();
    }
}

#[test]
fn a_thousand_agents_find_their_way_in_a_city() {
    let (map, starts, goals) = crowd(9, 256, 1000);
    let problem = Problem::new(&map, &starts, &goals).unwrap();
    let params = LacamParams { max_bytes: 64 << 20, ..LacamParams::default() };
    let outcome = Lacam::new(params).plan(&problem, &Budget::of_nodes(2000));
    validate(&map, &starts, Some(&goals), outcome.solution().unwrap()).unwrap();
}
