//! An episode as the list of changes of each agent, as in POGEMA's persistent mode.

use serde::{Deserialize, Serialize};

use crate::{Cell, Snapshot};

/// The state of one agent from `step` on, until its next change.
///
/// Rule: history/changes
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "(u16, u16, u16, u16, u64, bool)", into = "(u16, u16, u16, u16, u64, bool)")]
pub struct Change {
    /// The cell of the agent.
    pub cell: Cell,
    /// The current goal of the agent.
    pub goal: Cell,
    /// The number of steps since the reset.
    pub step: u64,
    /// Whether the agent is active.
    pub active: bool,
}

impl From<(u16, u16, u16, u16, u64, bool)> for Change {
    fn from((row, col, goal_row, goal_col, step, active): (u16, u16, u16, u16, u64, bool)) -> Self {
        Self { cell: Cell::new(row, col), goal: Cell::new(goal_row, goal_col), step, active }
    }
}

impl From<Change> for (u16, u16, u16, u16, u64, bool) {
    fn from(change: Change) -> Self {
        let Change { cell, goal, step, active } = change;
        (cell.row, cell.col, goal.row, goal.col, step, active)
    }
}

/// Returns for each agent its first state and each later state that differs from the previous one.
///
/// `past` holds the states after the reset and after each step.
///
/// Rule: history/changes
///
/// Source: POGEMA 1.4.0, `wrappers/persistence.py`, `PersistentWrapper`
pub fn changes(past: &[Snapshot]) -> Vec<Vec<Change>> {
    let num_agents = past.first().map_or(0, |snapshot| snapshot.cells.len());
    let state = |step: u64, snapshot: &Snapshot, agent: usize| Change {
        cell: snapshot.cells[agent],
        goal: snapshot.goals[agent],
        step,
        active: snapshot.active[agent],
    };
    let of_agent = |agent: usize| {
        let mut kept: Vec<Change> = Vec::new();
        for (step, snapshot) in (0..).zip(past) {
            let now = state(step, snapshot, agent);
            if kept
                .last()
                .is_none_or(|last| (last.cell, last.goal, last.active) != (now.cell, now.goal, now.active))
            {
                kept.push(now);
            }
        }
        kept
    };
    (0..num_agents).map(of_agent).collect()
}

/// Returns the state of one agent at each of the steps `0..=last_step`, from its changes: the last change up to the
/// step. Steps before the first change have no entry.
///
/// Rule: history/changes
pub fn states_at_every_step(changes: &[Change], last_step: u64) -> Vec<Change> {
    let at = |step: u64| changes.iter().rev().find(|change| change.step <= step).copied();
    (0..=last_step).filter_map(at).collect()
}
