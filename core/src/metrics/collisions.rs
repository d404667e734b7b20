//! The number of reverted moves.

use serde::{Deserialize, Serialize};

use crate::{Action, Cell, Map};

/// Counts moves that an obstacle or another agent prevented.
///
/// Rule: metrics/collisions
///
/// Source: the paper's Coordination metric; POGEMA 1.4.0 itself counts no collisions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CollisionMeter {
    /// Moves that an obstacle or the wall prevented.
    pub with_obstacles: u64,
    /// Moves that another agent prevented, although the target cell had no obstacle.
    pub with_agents: u64,
}

impl CollisionMeter {
    /// Counts one step, given each agent's cell before, whether it was active, its action, and its cell after.
    pub fn feed(&mut self, map: &Map, before: &[Cell], active: &[bool], actions: &[Action], after: &[Cell]) {
        for (agent, &action) in actions.iter().enumerate() {
            if !active[agent] || action == Action::Stay || before[agent] != after[agent] {
                continue;
            }
            let target = Cell::checked(before[agent].toward(action));
            if target.is_some_and(|cell| !map.is_obstacle(cell)) {
                self.with_agents += 1;
            } else {
                self.with_obstacles += 1;
            }
        }
    }
}
