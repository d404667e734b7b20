//! Priority-based search against a search through all joint states.

use crate::common::joint_oracle::oracle;
use crate::common::{Case, check_degenerate_problems, check_repeats, check_spent_budgets, rng};
use pogema_planners::{Budget, Outcome, Pbs, PbsParams, Planner, Solvability};

#[test]
fn plans_are_valid_and_cost_at_least_the_optimum() {
    let mut num_solved = 0;
    for seed in 0..500 {
        let case = Case::random(&mut rng(seed), 4, 4, 2 + (seed % 2) as usize);
        let outcome = Pbs::default().plan(&case.problem(), &Budget::of_nodes(5000));
        let truth = oracle(&case.map, &case.starts, &case.goals, pogema_core::OnGoal::Nothing, 100_000);
        if let Some(plan) = case.check(&outcome) {
            let Solvability::Solvable { sum_of_costs } = truth else { panic!("{truth:?} but {outcome}") };
            assert!(plan.sum_of_costs() as u64 >= sum_of_costs);
            num_solved += 1;
        }
        let is_proved = matches!(outcome, Outcome::Impossible { .. });
        assert!(!is_proved || truth == Solvability::Unsolvable, "{outcome}");
    }
    assert!(num_solved > 200, "{num_solved}");
}

#[test]
fn most_larger_problems_are_solved() {
    let solves = |seed: &u64| {
        let case = Case::random(&mut rng(*seed), 20, 20, 30);
        let outcome = Pbs::default().plan(&case.problem(), &Budget::of_nodes(20_000));
        case.check(&outcome).is_some()
    };
    let reachable = |seed: &u64| {
        let case = Case::random(&mut rng(*seed), 20, 20, 30);
        !matches!(Pbs::default().plan(&case.problem(), &Budget::of_nodes(1)), Outcome::Impossible { .. })
    };
    let seeds: Vec<u64> = (0..30).filter(reachable).collect();
    let num_solved = seeds.iter().filter(|seed| solves(seed)).count();
    assert!(num_solved * 10 >= seeds.len() * 8, "{num_solved} of {}", seeds.len());
}

#[test]
fn degenerate_problems_have_outcomes() {
    check_degenerate_problems(&mut Pbs::default());
}

#[test]
fn spent_budgets_end_the_search() {
    check_spent_budgets(&mut Pbs::default());
}

#[test]
fn the_same_seed_gives_the_same_plan() {
    check_repeats(|| Box::new(Pbs::new(PbsParams { seed: 7 })));
}
