//! Conflict-based search against a search through all joint states.

use crate::common::joint_oracle::oracle;
use crate::common::{Case, check_degenerate_problems, check_repeats, check_spent_budgets, rng};
use pogema_core::OnGoal;
use pogema_planners::{Budget, Cbs, CbsParams, Outcome, Planner, Solvability};

#[test]
fn plans_are_optimal() {
    let mut counts = [0; 3];
    for seed in 0..2500 {
        let num_agents = 2 + (seed % 3) as usize;
        let (height, width) = [(2, 3), (3, 3), (2, 5), (4, 3)][(seed / 3 % 4) as usize];
        let case = Case::random(&mut rng(seed), height, width, num_agents);
        let outcome = Cbs::default().plan(&case.problem(), &Budget::of_nodes(1500));
        let plan = case.check(&outcome);
        match oracle(&case.map, &case.starts, &case.goals, OnGoal::Nothing, 1_000_000) {
            Solvability::Solvable { sum_of_costs } => {
                let Outcome::Solved { lower_bound, .. } = outcome else {
                    assert!(matches!(outcome, Outcome::TimedOut { .. }), "{outcome} in {case:?}");
                    counts[2] += 1;
                    continue;
                };
                assert_eq!(plan.unwrap().sum_of_costs() as u64, sum_of_costs, "{case:?}");
                assert_eq!(lower_bound, sum_of_costs);
                counts[0] += 1;
            }
            verdict => {
                assert_eq!(verdict, Solvability::Unsolvable);
                assert!(matches!(outcome, Outcome::Impossible { .. }), "{outcome} in {case:?}");
                counts[1] += 1;
            }
        }
    }
    assert!(counts[0] > 500 && counts[1] > 500 && counts[2] < 100, "{counts:?}");
}

#[test]
fn cbs_proves_that_a_step_limit_is_too_low() {
    let case = Case::new(&["...", "#.#"], &[[(0, 0), (0, 2)], [(0, 2), (0, 0)]]);
    let plan = |most| Cbs::default().plan(&case.problem().within(most), &Budget::default());
    let shortest = (2..9).find(|&most| plan(most).solution().is_some()).unwrap();
    assert!((2..shortest).all(|most| matches!(plan(most), Outcome::Impossible { .. })));
    assert!(case.check(&plan(shortest)).unwrap().num_steps() <= shortest);
}

#[test]
fn open_maps_with_more_agents_are_solved() {
    let case = Case::random(&mut rng(1), 12, 12, 12);
    let outcome = Cbs::default().plan(&case.problem(), &Budget::of_nodes(20_000));
    let plan = case.check(&outcome).unwrap();
    let Outcome::Solved { lower_bound, .. } = outcome else { unreachable!() };
    assert_eq!(lower_bound, plan.sum_of_costs() as u64);
}

#[test]
fn lower_bounds_hold_for_every_budget() {
    let (mut num_unsolved, mut num_raised) = (0, 0);
    for seed in 0..300 {
        let case = Case::random(&mut rng(seed), 4, 5, 4);
        let best = Cbs::default().plan(&case.problem(), &Budget::of_nodes(3000));
        let Some(best) = case.check(&best) else { continue };
        let alone: u64 = (0..case.starts.len())
            .map(|agent| {
                let (starts, goals) = (vec![case.starts[agent]], vec![case.goals[agent]]);
                let alone = Case { map: case.map.clone(), starts, goals };
                Cbs::default().plan(&alone.problem(), &Budget::default()).lower_bound().unwrap()
            })
            .sum();
        for nodes in [1, 2, 4, 8, 16] {
            let outcome = Cbs::default().plan(&case.problem(), &Budget::of_nodes(nodes));
            let bound = outcome.lower_bound().unwrap();
            assert!(alone <= bound && bound <= best.sum_of_costs() as u64, "{outcome} in {case:?}");
            num_unsolved += usize::from(outcome.solution().is_none());
            num_raised += usize::from(outcome.solution().is_none() && bound > alone);
        }
    }
    assert!(num_unsolved > 100 && num_raised > 50, "{num_unsolved}, {num_raised}");
}

#[test]
fn separate_rooms_are_searched_independently() {
    // Three rooms, in each of which two agents have to pass each other.
    let rows = ["....#....#....", ".##.#.##.#.##.", "....#....#...."];
    let in_room = |col: u16| [[(0, col), (0, col + 3)], [(0, col + 3), (0, col)]];
    let agents: Vec<_> = [0, 5, 10].into_iter().flat_map(in_room).collect();
    let nodes_for = |num_agents: usize| {
        let case = Case::new(&rows, &agents[..num_agents]);
        let is_solved = |&nodes: &u64| {
            let outcome = Cbs::default().plan(&case.problem(), &Budget::of_nodes(nodes));
            case.check(&outcome).is_some()
        };
        (1..2000).find(is_solved).unwrap()
    };
    let for_one = nodes_for(2);
    assert!(for_one > 2, "{for_one}");
    assert!(nodes_for(6) <= 3 * for_one, "{} and {for_one}", nodes_for(6));
}

#[test]
fn agents_pass_each_other_optimally_in_a_long_corridor() {
    // One agent has to wait in the only bay while the other one passes.
    for bay in [1, 5, 11] {
        let length = 24;
        let bay_row: String = (0..length).map(|col| if col == bay { '.' } else { '#' }).collect();
        let rows = [".".repeat(length), bay_row];
        let last = length as u16 - 1;
        let rows = rows.each_ref().map(String::as_str);
        let case = Case::new(&rows, &[[(0, 0), (0, last)], [(0, last), (0, 0)]]);
        let outcome = Cbs::default().plan(&case.problem(), &Budget::of_nodes(2000));
        let cost = case.check(&outcome).unwrap().sum_of_costs() as u64;
        assert_eq!(outcome.lower_bound(), Some(cost));
        let known = oracle(&case.map, &case.starts, &case.goals, OnGoal::Nothing, 1_000_000);
        assert!(
            matches!(known, Solvability::Solvable { sum_of_costs } if sum_of_costs == cost),
            "{known:?}, {cost}"
        );
    }
}

#[test]
fn cbs_gives_up_if_the_tree_exceeds_its_byte_budget() {
    let case = Case::random(&mut rng(1), 12, 12, 40);
    let params = CbsParams { max_bytes: 200_000, ..CbsParams::default() };
    let outcome = Cbs::new(params).plan(&case.problem(), &Budget::default());
    assert!(matches!(outcome, Outcome::GaveUp { best: None, .. }), "{outcome}");
}

#[test]
fn degenerate_problems_have_outcomes() {
    check_degenerate_problems(&mut Cbs::default());
}

#[test]
fn spent_budgets_end_the_search() {
    check_spent_budgets(&mut Cbs::default());
}

#[test]
fn the_same_seed_gives_the_same_plan() {
    check_repeats(|| Box::new(Cbs::new(CbsParams { seed: 7, ..CbsParams::default() })));
}
