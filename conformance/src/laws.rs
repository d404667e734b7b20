//! Invariants that hold in every episode under all rules.

use std::collections::HashSet;

use pogema_core::{Collision, Occupancy, OnGoal, Snapshot};
use pogema_maps::GridConfig;

use crate::request::{Record, Request, Response};
use crate::tally::{ConfigRules, rules_of};

/// An invariant that an answer breaks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BrokenLaw {
    /// The index of the operation that broke it.
    pub op: usize,
    /// The rule that guarantees it.
    pub rule: &'static str,
    /// A description of the violation.
    pub text: String,
}

/// Returns the first invariant that an answer breaks.
pub fn broken_law(request: &Request, response: &Response) -> Option<BrokenLaw> {
    let config = GridConfig::from_value(&request.config).ok()?;
    let config_rules = rules_of(&config);
    let mut before: Option<&Snapshot> = None;
    let mut obstacles: Vec<Vec<u8>> = Vec::new();
    for (op, record) in response.records.iter().enumerate() {
        if let Record::Reset(reset) = record {
            obstacles = reset.map.iter().map(|row| row.bytes().collect()).collect();
        }
        let Some(state) = record.state() else { continue };
        let broken =
            broken_in_state(config_rules, &config, state).or_else(|| match (record.step(), before) {
                (Some(_), Some(before)) => broken_in_step(config_rules, &config, &obstacles, before, state),
                _ => None,
            });
        if let Some((rule, text)) = broken {
            return Some(BrokenLaw { op, rule, text });
        }
        before = Some(state);
    }
    None
}

fn broken_in_state(
    config_rules: ConfigRules,
    config: &GridConfig,
    state: &Snapshot,
) -> Option<(&'static str, String)> {
    let active = || (0..state.cells.len()).filter(|&agent| state.active[agent]);
    let mut seen = HashSet::new();
    if let Some(agent) = active().find(|&agent| !seen.insert(state.cells[agent])) {
        return Some((
            config_rules.collide,
            format!("agent {agent} shares cell {} with another active agent", state.cells[agent]),
        ));
    }
    if let Some(cell) = state.occupied.iter().find(|cell| !seen.contains(cell)) {
        return Some((
            config_rules.occupancy,
            format!("cell {cell} is marked as occupied without an active agent"),
        ));
    }
    let shows_all = config.collision_system != Collision::Soft || config.occupancy == Occupancy::Exact;
    if shows_all && state.occupied.iter().collect::<HashSet<_>>().len() != seen.len() {
        return Some((config_rules.occupancy, "the occupancy grid does not show every active agent".into()));
    }
    if config.on_target != OnGoal::Finish && active().count() != state.cells.len() {
        return Some((config_rules.goal, "an agent became inactive".into()));
    }
    None
}

fn broken_in_step(
    config_rules: ConfigRules,
    config: &GridConfig,
    obstacles: &[Vec<u8>],
    before: &Snapshot,
    after: &Snapshot,
) -> Option<(&'static str, String)> {
    for agent in 0..before.cells.len() {
        let (from, to) = (before.cells[agent], after.cells[agent]);
        if !before.active[agent] && from != to {
            return Some(("move/inactive", format!("finished agent {agent} moved from {from} to {to}")));
        }
        if from.distance(to) > 1 {
            let moved =
                format!("agent {agent} moved from {from} to {to} in one step, expected at most one cell");
            return Some(("move/actions", moved));
        }
        let row = obstacles.get(usize::from(to.row));
        match row.and_then(|row| row.get(usize::from(to.col))) {
            None => return Some((config_rules.collide, format!("agent {agent} left the map to {to}"))),
            Some(b'#') if from != to => {
                return Some((config_rules.collide, format!("agent {agent} entered the obstacle at {to}")));
            }
            Some(_) => {}
        }
        if after.active[agent] && !before.active[agent] {
            return Some((config_rules.goal, format!("agent {agent} became active again")));
        }
        let swaps = (0..agent).any(|other| {
            let both = before.active[agent] && before.active[other] && from != to;
            both && before.cells[other] == to && after.cells[other] == from
        });
        if swaps {
            return Some((config_rules.collide, format!("agent {agent} swapped cells with another agent")));
        }
        if config.on_target != OnGoal::Restart && before.goals[agent] != after.goals[agent] {
            return Some((config_rules.goal, format!("the goal of agent {agent} changed")));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use pogema_core::Cell;

    use super::*;

    #[test]
    fn a_move_of_a_finished_agent_and_a_jump_break_different_rules() {
        let config = GridConfig::from_yaml("{map: '....', on_target: finish}").unwrap();
        let state = |col: u16, active: bool| {
            let (cells, goals) = (vec![Cell::new(0, col)], vec![Cell::new(0, 3)]);
            Snapshot { cells, goals, active: vec![active], ..Snapshot::default() }
        };
        let obstacles = [b"....".to_vec()];
        let broken =
            |from: Snapshot, to: Snapshot| broken_in_step(rules_of(&config), &config, &obstacles, &from, &to);
        let (rule, text) = broken(state(0, false), state(1, false)).unwrap();
        assert_eq!((rule, text.as_str()), ("move/inactive", "finished agent 0 moved from (0, 0) to (0, 1)"));
        let (rule, text) = broken(state(0, true), state(2, true)).unwrap();
        let jump = "agent 0 moved from (0, 0) to (0, 2) in one step, expected at most one cell";
        assert_eq!((rule, text.as_str()), ("move/actions", jump));
        assert_eq!(broken(state(0, true), state(1, true)), None);
        assert_eq!(broken(state(1, false), state(1, false)), None);
    }
}
