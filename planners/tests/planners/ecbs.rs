//! Bounded-suboptimal plans against a search through all joint states.

use crate::common::joint_oracle::oracle;
use crate::common::{Case, check_degenerate_problems, check_repeats, check_spent_budgets, rng};
use pogema_core::OnGoal;
use pogema_planners::{Budget, Ecbs, EcbsParams, Outcome, Planner, Solvability};

fn planner(weight: f64) -> Ecbs {
    Ecbs::new(EcbsParams { weight, ..EcbsParams::default() })
}

#[test]
fn plans_cost_at_most_the_weight_times_the_optimum() {
    let mut counts = [0; 3];
    for seed in 0..1200 {
        let weight = [1.0, 1.1, 1.5, 3.0][(seed % 4) as usize];
        let (height, width) = [(2, 3), (3, 3), (4, 3)][(seed / 4 % 3) as usize];
        let case = Case::random(&mut rng(seed), height, width, 2 + (seed / 12 % 3) as usize);
        let outcome = planner(weight).plan(&case.problem(), &Budget::of_nodes(2000));
        let plan = case.check(&outcome);
        match oracle(&case.map, &case.starts, &case.goals, OnGoal::Nothing, 1_000_000) {
            Solvability::Solvable { sum_of_costs } => {
                let Outcome::Solved { lower_bound, .. } = outcome else {
                    assert!(matches!(outcome, Outcome::TimedOut { .. }), "{outcome} in {case:?}");
                    counts[2] += 1;
                    continue;
                };
                let cost = plan.unwrap().sum_of_costs() as u64;
                assert!(lower_bound <= sum_of_costs && sum_of_costs <= cost, "{case:?}");
                assert!(cost as f64 <= weight * sum_of_costs as f64, "{cost} {weight} {case:?}");
                counts[0] += 1;
            }
            verdict => {
                assert_eq!(verdict, Solvability::Unsolvable);
                assert!(matches!(outcome, Outcome::Impossible { .. }), "{outcome} in {case:?}");
                counts[1] += 1;
            }
        }
    }
    assert!(counts[0] > 250 && counts[1] > 250 && counts[2] < 30, "{counts:?}");
}

#[test]
fn most_problems_with_20_agents_are_solved_or_proved_impossible() {
    let num_decided = (0..10)
        .filter(|&seed| {
            let case = Case::random(&mut rng(seed), 16, 16, 20);
            let outcome = planner(1.5).plan(&case.problem(), &Budget::of_nodes(3000));
            let is_impossible = matches!(outcome, Outcome::Impossible { .. });
            is_impossible || case.check(&outcome).is_some()
        })
        .count();
    assert!(num_decided >= 8, "{num_decided}");
}

#[test]
fn a_higher_weight_solves_more_problems_with_20_agents() {
    let solves = |weight: f64, seed: u64| {
        let case = Case::random(&mut rng(seed), 16, 16, 20);
        case.check(&planner(weight).plan(&case.problem(), &Budget::of_nodes(1000))).is_some()
    };
    let num_solved = [1.0, 1.5].map(|weight| (0..10).filter(|&seed| solves(weight, seed)).count());
    assert!(num_solved[0] < num_solved[1] && num_solved[1] >= 6, "{num_solved:?}");
}

#[test]
fn invalid_weights_count_as_one() {
    let case = Case::new(&["...", "#.#"], &[[(0, 0), (0, 2)], [(0, 2), (0, 1)]]);
    let best = planner(1.0).plan(&case.problem(), &Budget::default());
    for weight in [f64::NAN, 0.0, -3.0] {
        assert_eq!(planner(weight).plan(&case.problem(), &Budget::default()), best);
    }
}

#[test]
fn plans_are_found_with_huge_weights() {
    let case = Case::new(&["...", "#.#"], &[[(0, 0), (0, 2)], [(0, 2), (0, 1)]]);
    let on_goal = Case::new(&["....", "....", "...."], &[[(1, 1), (1, 1)]]);
    for weight in [1e300, f64::INFINITY] {
        for case in [&case, &on_goal] {
            let outcome = planner(weight).plan(&case.problem(), &Budget::default());
            assert!(case.check(&outcome).is_some(), "weight {weight}: {outcome}");
        }
    }
}

#[test]
fn ecbs_gives_up_if_the_tree_exceeds_its_byte_budget() {
    let case = Case::random(&mut rng(1), 12, 12, 40);
    let params = EcbsParams { weight: 1.0, max_bytes: 200_000, ..EcbsParams::default() };
    let outcome = Ecbs::new(params).plan(&case.problem(), &Budget::default());
    assert!(matches!(outcome, Outcome::GaveUp { best: None, .. }), "{outcome}");
}

#[test]
fn degenerate_problems_have_outcomes() {
    check_degenerate_problems(&mut Ecbs::default());
}

#[test]
fn spent_budgets_end_the_search() {
    check_spent_budgets(&mut Ecbs::default());
}

#[test]
fn the_same_seed_gives_the_same_plan() {
    check_repeats(|| Box::new(planner(1.2)));
}
