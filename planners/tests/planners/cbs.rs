//! Plans of conflict-based search, against a search through all joint places.

use crate::common::{Case, check_odd_problems, check_repeats, check_spent_budgets, rng};
use pogema_core::OnGoal;
use pogema_maps::{Verdict, search};
use pogema_planners::{Budget, Cbs, CbsParams, Outcome, Planner};

#[test]
fn no_plan_costs_less() {
    let mut counts = [0; 3];
    for seed in 0..2500 {
        let num_agents = 2 + (seed % 3) as usize;
        let (height, width) = [(2, 3), (3, 3), (2, 5), (4, 3)][(seed / 3 % 4) as usize];
        let case = Case::random(&mut rng(seed), height, width, num_agents);
        let outcome = Cbs::default().plan(&case.problem(), &Budget::of_nodes(1500));
        let plan = case.check(&outcome);
        match search(&case.map, &case.starts, &case.goals, OnGoal::Nothing, 1_000_000) {
            Verdict::Solvable { sum_of_costs } => {
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
                assert_eq!(verdict, Verdict::Unsolvable);
                assert!(matches!(outcome, Outcome::Impossible { .. }), "{outcome} in {case:?}");
                counts[1] += 1;
            }
        }
    }
    assert!(counts[0] > 500 && counts[1] > 500 && counts[2] < 100, "{counts:?}");
}

#[test]
fn what_cannot_be_done_in_so_many_steps_is_proved() {
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
fn the_tree_takes_no_more_than_it_may() {
    let case = Case::random(&mut rng(1), 12, 12, 40);
    let params = CbsParams { most_bytes: 200_000, ..CbsParams::default() };
    let outcome = Cbs::new(params).plan(&case.problem(), &Budget::default());
    assert_eq!(outcome, Outcome::GaveUp { best: None });
}

#[test]
fn odd_problems_have_outcomes() {
    check_odd_problems(&mut Cbs::default());
}

#[test]
fn spent_budgets_end_the_search() {
    check_spent_budgets(&mut Cbs::default());
}

#[test]
fn the_same_seed_gives_the_same_plan() {
    check_repeats(|| Box::new(Cbs::new(CbsParams { seed: 7, ..CbsParams::default() })));
}
