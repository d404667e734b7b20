//! Every reverted move of random episodes has a reason that is consistent with the states.

use std::collections::BTreeMap;

use pogema_core::{Trace, TraceStep};

use super::play::play;
use super::*;

const SYSTEMS: [&str; 3] = ["priority", "block_both", "soft"];
const MODES: [&str; 3] = ["finish", "nothing", "restart"];

/// Returns a random episode, small and crowded, so that every rule of the collision system applies.
fn random_trace(collision: &str, mode: &str, seed: u64) -> Trace {
    let (size, num_agents) = (5 + seed % 4, 5 + seed % 4);
    let yaml = format!(
        "{{size: {size}, num_agents: {num_agents}, density: 0.1, seed: {seed}, max_episode_steps: 40, \
         collision_system: {collision}, on_target: {mode}}}"
    );
    play(&yaml, 0.6).unwrap()
}

/// Returns whether the states are consistent with the reason `found`.
fn holds(trace: &Trace, before: &Snapshot, step: &TraceStep, found: RevertedMove) -> bool {
    let (map, after, agent) = (&trace.header.map, &step.state, found.agent);
    let own = before.cells[agent];
    let aim = |agent: usize| before.cells[agent].toward(step.actions[agent]);
    let at = |cell: Cell| (i32::from(cell.row), i32::from(cell.col));
    let obstructed = match trace.header.config.collision {
        Collision::Soft => "collide/soft/stay",
        Collision::Priority | Collision::BlockBoth => "move/actions",
    };
    let other = match found.blocker {
        Blocker::Wall => {
            let (row, col) = aim(agent);
            let is_inside = (0..map.height() as i32).contains(&row) && (0..map.width() as i32).contains(&col);
            return !is_inside && found.rule == obstructed;
        }
        Blocker::Obstacle(cell) => {
            return map.is_obstacle(cell) && at(cell) == aim(agent) && found.rule == obstructed;
        }
        Blocker::Unknown => return false,
        Blocker::Agent(other) => other,
    };
    let was_there = at(before.cells[other]) == aim(agent);
    let stayed = before.cells[other] == after.cells[other];
    let arrived = !stayed && at(after.cells[other]) == aim(agent);
    let was_empty =
        (0..before.cells.len()).all(|third| !before.active[third] || at(before.cells[third]) != aim(agent));
    let aims_at_own = aim(other) == at(own);
    let fits = match found.rule {
        "collide/priority/contest" | "collide/soft/contest" => arrived && other < agent,
        "collide/priority/follow" => was_there && !stayed && other > agent,
        "collide/priority/swap" => was_there && stayed && is_in_ring(before, &step.actions, agent),
        "collide/block-both/occupied" => was_there,
        "collide/block-both/contest" => was_empty && stayed && aim(other) == aim(agent),
        "collide/soft/swap" => was_there && stayed && aims_at_own,
        "collide/priority" | "collide/soft/chain" => was_there && stayed && !aims_at_own,
        _ => false,
    };
    fits && other != agent && before.active[other]
}

/// Returns whether the agent is part of a ring, by following the aims from agent to agent.
fn is_in_ring(before: &Snapshot, actions: &[Action], agent: usize) -> bool {
    let mut place = before.cells[agent];
    for _ in 0..before.cells.len() {
        let here = (0..before.cells.len()).find(|&at| before.active[at] && before.cells[at] == place);
        let Some(here) = here else { return false };
        let (row, col) = place.toward(actions[here]);
        if actions[here] == Action::Stay || row < 0 || col < 0 {
            return false;
        }
        place = Cell::new(row as u16, col as u16);
        if place == before.cells[agent] {
            return true;
        }
    }
    false
}

#[test]
fn every_reverted_move_has_one_true_reason() {
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    for (collision, mode, seed) in SYSTEMS
        .into_iter()
        .flat_map(|system| MODES.map(|mode| (system, mode)))
        .flat_map(|(system, mode)| (0..40).map(move |seed| (system, mode, seed)))
    {
        let trace = random_trace(collision, mode, seed);
        let mut before = &trace.start.state;
        for step in &trace.steps {
            let got =
                reverted_moves(&trace.header.config, &trace.header.map, before, &step.actions, &step.state);
            let reverted: Vec<usize> = (0..step.actions.len())
                .filter(|&agent| before.active[agent] && step.actions[agent] != Action::Stay)
                .filter(|&agent| before.cells[agent] == step.state.cells[agent])
                .collect();
            assert_eq!(got.iter().map(|found| found.agent).collect::<Vec<_>>(), reverted);
            for found in got {
                assert!(holds(&trace, before, step, found), "{collision} {mode} {seed}: {found:?} {step:?}");
                *seen.entry(found.rule).or_default() += 1;
            }
            before = &step.state;
        }
    }
    let rules = [
        "collide/block-both/contest",
        "collide/block-both/occupied",
        "collide/priority",
        "collide/priority/contest",
        "collide/priority/follow",
        "collide/priority/swap",
        "collide/soft/chain",
        "collide/soft/contest",
        "collide/soft/stay",
        "collide/soft/swap",
        "move/actions",
    ];
    assert_eq!(seen.keys().copied().collect::<Vec<_>>(), rules);
    assert!(seen.values().all(|&times| times > 20), "{seen:?}");
}

#[test]
fn a_ring_under_priority_is_a_swap() {
    let yaml = "{map: \"abAB\\ndcDC\", collision_system: priority}";
    let trace = play(yaml, 0.0).unwrap();
    let actions = [Action::Right, Action::Down, Action::Left, Action::Up];
    let state = &trace.start.state;
    let got = reverted_moves(&trace.header.config, &trace.header.map, state, &actions, state);
    let reasons: Vec<_> = got.iter().map(|found| (found.rule, found.blocker)).collect();
    let swap = |other| ("collide/priority/swap", Blocker::Agent(other));
    assert_eq!(reasons, [swap(1), swap(2), swap(3), swap(0)]);
}

#[test]
fn steps_under_other_rules_have_an_unknown_cause() {
    let trace = play("{map: \"a.A\"}", 0.0).unwrap();
    let state = &trace.start.state;
    let got = reverted_moves(&trace.header.config, &trace.header.map, state, &[Action::Right], state);
    assert_eq!(got, [RevertedMove { agent: 0, rule: "collide/priority", blocker: Blocker::Unknown }]);
}
