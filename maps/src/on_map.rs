//! Combines configs with maps and scenarios from other files.

use pogema_core::Error;
use serde_json::{Map as Object, Value};

use crate::config::{GridConfig, Targets};
use crate::formats::Scenario;
use crate::text::MapText;

impl GridConfig {
    /// Reads a config whose map comes from another source and replaces the fields for the map and its sides.
    ///
    /// The first agents take the starts and goals of the map, unless the field `agents_xy` is given.
    ///
    /// # Errors
    /// Those of [`GridConfig::from_value`]; [`Error::Config`] for more agents than the map has starts, or for a map
    /// with unequal numbers of starts and goals.
    pub fn on_map(fields: &Object<String, Value>, text: &MapText) -> Result<Self, Error> {
        let has_scenario = !text.starts.is_empty() && !fields.contains_key("agents_xy");
        let mut others = fields.clone();
        others.retain(|field, _| match field.as_str() {
            "map" | "width" | "height" | "size" => false,
            "targets_xy" => !has_scenario,
            _ => true,
        });
        let plain = MapText { starts: Vec::new(), goals: Targets::default(), ..text.clone() };
        let config = Self::read(&others, Some(plain))?;
        if !has_scenario {
            return Ok(config);
        }
        let scenario = Scenario::new(text.starts.clone(), text.goals.clone())?;
        config.with_scenario(&scenario, fields)
    }

    /// Replaces starts and goals with those of a scenario.
    ///
    /// If the fields of the config include `num_agents`, only that many of the scenario's agents are used.
    ///
    /// # Errors
    /// [`Error::Config`] for more agents than the scenario has, or goals that do not fit the config.
    pub fn with_scenario(
        mut self,
        scenario: &Scenario,
        fields: &Object<String, Value>,
    ) -> Result<Self, Error> {
        let num_agents = fields.get("num_agents").and_then(Value::as_u64);
        let num_agents = num_agents.map_or(scenario.starts.len(), |number| number as usize);
        let Scenario { starts, goals } = scenario.truncated(num_agents)?;
        self.num_agents = num_agents.max(1);
        (self.agents_xy, self.targets_xy) = (Some(starts), Some(goals));
        self.check_places()?;
        Ok(self)
    }
}
