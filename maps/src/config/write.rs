//! Writes a config as an object that POGEMA can read.

use serde_json::{Value, json};

use super::GridConfig;

impl GridConfig {
    /// Returns the config as an object under POGEMA's field names, derived values included.
    ///
    /// If a map is given, `width` and `height` are null, because its sides may exceed the limits of these fields.
    pub fn to_value(&self) -> Value {
        let side = |length: usize| self.map.is_none().then_some(length);
        json!({
            "on_target": self.on_target,
            "seed": self.seed,
            "width": side(self.width),
            "height": side(self.height),
            "density": self.density,
            "obs_radius": self.obs_radius,
            "agents_xy": self.agents_xy,
            "targets_xy": self.targets_xy,
            "num_agents": self.num_agents,
            "possible_agents_xy": self.possible_agents_xy,
            "possible_targets_xy": self.possible_targets_xy,
            "collision_system": self.collision_system,
            "persistent": self.persistent,
            "observation_type": self.observation_type,
            "map": self.map.as_ref().map(rows_of_numbers),
            "map_name": self.map_name,
            "integration": self.integration,
            "max_episode_steps": self.max_episode_steps,
            "auto_reset": self.auto_reset,
            "empty_outside": self.empty_outside,
            "occupancy": self.occupancy,
            "reward": self.reward,
            "limits": self.limits,
        })
    }
}

fn rows_of_numbers(map: &pogema_core::Map) -> Value {
    let number = |&obstacle: &bool| u8::from(obstacle);
    let rows: Vec<Vec<u8>> =
        map.obstacles().chunks(map.width()).map(|row| row.iter().map(number).collect()).collect();
    json!(rows)
}
