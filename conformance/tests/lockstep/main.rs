//! Checks the fast engine against the reference, operation by operation, on random plans and long episodes.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

mod event_counts;
mod pair;
mod plan;
mod soak;

use event_counts::EventCounts;
use pair::{Outcome, Pair};
use plan::{Op, Plan, plans};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

/// Plays a plan on all engines and compares them after every operation.
fn play(plan: &Plan, counts: &mut EventCounts) -> Outcome<()> {
    let mut pair = Pair::new(plan.config);
    pair.check_state()?;
    pair.check_observations(0..0)?;
    pair.reset(&plan.instances[0])?;
    pair.check_observations(0..plan.config.num_agents / 2)?;
    for (index, op) in plan.ops.iter().enumerate() {
        perform(op, plan, &mut pair, counts).map_err(|text| format!("operation {index}: {text}"))?;
        let first = index % plan.config.num_agents;
        let last = first + (plan.config.num_agents - first).div_ceil(2);
        pair.check_observations(first..last).map_err(|text| format!("after operation {index}: {text}"))?;
    }
    Ok(())
}

fn perform(op: &Op, plan: &Plan, pair: &mut Pair, counts: &mut EventCounts) -> Outcome<()> {
    match op {
        Op::Step(drift, choices) => {
            let before = pair.check_state()?;
            let actions = drift.actions(choices, &before);
            let (after, results) = pair.step(&actions)?;
            counts.watch(before, actions, after, results);
            Ok(())
        }
        Op::Back => pair.step_back(),
        Op::Reset(index) => pair.reset(&plan.instances[*index]),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(1000) })]

    #[test]
    fn fast_engine_equals_the_reference(plan in plans()) {
        let outcome = play(&plan, &mut EventCounts::default());
        prop_assert!(outcome.is_ok(), "{}", outcome.unwrap_err());
    }
}

#[test]
fn plans_contain_every_kind_of_event() {
    let mut counts = EventCounts::default();
    let mut runner = TestRunner::deterministic();
    let plans = plans();
    for _ in 0..2000 {
        let plan = plans.new_tree(&mut runner).unwrap().current();
        play(&plan, &mut counts).unwrap_or_else(|text| panic!("{text}\n{plan:?}"));
    }
    for (name, count, least) in counts.with_minimums() {
        assert!(count >= least, "only {count} {name}, expected at least {least}: {counts:?}");
    }
}
