//! Checks across the fields of a config.

use pogema_core::{Error, OnGoal};

use super::{GridConfig, Integration, Targets};
use crate::source::check_on_map;

impl GridConfig {
    /// Checks that starts and goals lie on the map and that the fields fit each other, and rejects the integration
    /// `rllib`.
    ///
    /// Rule: config/positions, config/fields
    pub(crate) fn check_consistency(&self) -> Result<(), Error> {
        let sides = (self.height, self.width);
        check_on_map(sides, "agents_xy", self.agents_xy.as_deref().unwrap_or_default())?;
        check_on_map(sides, "targets_xy", &self.targets_xy.as_ref().map(Targets::all).unwrap_or_default())?;
        if self.on_target == OnGoal::Restart && matches!(self.targets_xy, Some(Targets::Single(_))) {
            let expected = "goal sequences such as [[[0, 0], [1, 1]]] with on_target `restart`";
            return Err(Error::config("targets_xy", "one goal per agent", expected));
        }
        // In persistent mode POGEMA computes no metrics, so 0 is allowed there.
        if self.on_target == OnGoal::Restart && self.max_episode_steps == 0 && !self.persistent {
            let expected =
                "a number other than 0 with on_target `restart`, because the throughput is divided by it";
            return Err(Error::config("max_episode_steps", 0, expected));
        }
        if self.auto_reset == Some(true) && self.integration != Some(Integration::SampleFactory) {
            let expected = "false, because only the integration `SampleFactory` resets automatically";
            return Err(Error::config("auto_reset", true, expected));
        }
        if self.integration == Some(Integration::Rllib) {
            return Err(Error::config("integration", "rllib", "`PettingZoo`, which replaces it in POGEMA"));
        }
        Ok(())
    }
}
