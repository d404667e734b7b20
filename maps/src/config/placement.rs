//! How a config places its agents.

use pogema_core::Cell;

use super::{GridConfig, Targets};

impl GridConfig {
    /// Returns the explicit starts and goals, if the config gives both and at least one start. They take
    /// precedence over pools.
    ///
    /// Rule: place/explicit
    pub fn explicit_placement(&self) -> Option<(&[Cell], &Targets)> {
        match (&self.agents_xy, &self.targets_xy) {
            (Some(starts), Some(targets)) if !starts.is_empty() => Some((starts, targets)),
            _ => None,
        }
    }

    /// Returns the possible starts and goals, if the config gives at least one of each.
    ///
    /// Rule: place/pools
    pub fn pools(&self) -> Option<(&[Cell], &[Cell])> {
        match (&self.possible_agents_xy, &self.possible_targets_xy) {
            (Some(starts), Some(goals)) if !starts.is_empty() && !goals.is_empty() => Some((starts, goals)),
            _ => None,
        }
    }
}
