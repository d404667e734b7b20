//! Checks the fast engine against the reference in every situation of small scopes.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod one_step;
mod scope;
mod two_steps;

use scope::{Scope, count_over_maps};

/// Rows, columns and the largest number of agents.
type Bound = (usize, usize, usize);

/// Returns the scopes within some bounds: for each size, one scope per number of agents, from 1 to the largest.
fn scopes(bounds: &[Bound]) -> Vec<Scope> {
    let scope = |&(height, width, max_agents): &Bound| {
        (1..=max_agents).map(move |agents| Scope::new(height, width, agents))
    };
    bounds.iter().flat_map(scope).collect()
}

fn check_one_step(scopes: &[Scope], num_steps: u64) {
    let counted = count_over_maps(scopes, one_step::check_map);
    assert_eq!(counted, scopes.iter().map(|&scope| one_step::num_steps(scope)).sum::<u64>());
    assert_eq!(counted, num_steps);
}

#[test]
fn every_step_on_small_maps_equals_the_reference() {
    const SMALL: [Bound; 9] =
        [(1, 1, 3), (1, 2, 3), (1, 3, 3), (2, 1, 3), (2, 2, 3), (2, 3, 3), (3, 1, 3), (3, 2, 3), (3, 3, 2)];
    check_one_step(&scopes(&SMALL), 18_196_380);
}

#[test]
fn every_two_steps_with_all_goals_on_2_x_2_equal_the_reference() {
    let scopes = scopes(&[(2, 2, 2)]);
    let counted = count_over_maps(&scopes, two_steps::check_map);
    assert_eq!(counted, scopes.iter().map(|&scope| two_steps::num_steps(scope)).sum::<u64>());
    assert_eq!(counted, 9_054_720);
}

#[test]
#[ignore = "minutes: cargo test --release -p pogema-conformance --test exhaustive -- --ignored"]
fn every_step_of_3_agents_on_3_x_3_equals_the_reference() {
    check_one_step(&[Scope::new(3, 3, 3)], 193_536_000);
}

#[test]
#[ignore = "minutes: cargo test --release -p pogema-conformance --test exhaustive -- --ignored"]
fn every_step_of_up_to_3_agents_on_2_x_4_equals_the_reference() {
    check_one_step(&scopes(&[(2, 4, 3)]), 66_723_840);
}

#[test]
#[ignore = "minutes: cargo test --release -p pogema-conformance --test exhaustive -- --ignored"]
fn every_step_of_4_agents_on_2_x_4_equals_the_reference() {
    check_one_step(&[Scope::new(2, 4, 4)], 1_612_800_000);
}
