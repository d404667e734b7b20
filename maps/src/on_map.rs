//! Combines configs with maps and scenarios from other files.

use pogema_core::Error;
use serde_json::{Map as Object, Value};

use crate::config::{GridConfig, Targets};
use crate::formats::Scenario;
use crate::text::MapText;

impl GridConfig {
    /// Reads a config whose map comes from another source. That map replaces the fields for the map and its sides.
    ///
    /// The agents take the starts and goals of the map in order, unless the field `agents_xy` is given and not null.
    ///
    /// # Errors
    /// Those of [`GridConfig::from_value`]; [`Error::Config`] for more agents than the map has starts, for a map with
    /// unequal numbers of starts and goals, or for `targets_xy` without `agents_xy` if the map has starts.
    pub fn on_map(fields: &Object<String, Value>, text: &MapText) -> Result<Self, Error> {
        let given = |field: &str| fields.get(field).filter(|value| !value.is_null());
        let has_scenario = !text.starts.is_empty() && given("agents_xy").is_none();
        if let (true, Some(targets)) = (has_scenario, given("targets_xy")) {
            let expected = "`agents_xy` beside it, because the map has its own starts and goals";
            return Err(Error::config("targets_xy", targets, expected));
        }
        let mut others = fields.clone();
        others.retain(|field, _| !["map", "width", "height", "size"].contains(&field.as_str()));
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
        self.check_consistency()?;
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::Library;

    fn on_map(fields: Value) -> Result<GridConfig, Error> {
        let (library, fields) = (Library::built_in(), serde_json::from_value(fields).unwrap());
        GridConfig::on_map(&fields, library.map("puzzle-crossroads").unwrap())
    }

    #[test]
    fn null_leaves_the_agents_of_the_map() {
        let own = on_map(json!({})).unwrap();
        assert_eq!(own.num_agents, 4);
        assert_eq!(on_map(json!({"agents_xy": null, "targets_xy": null})).unwrap(), own);
    }

    #[test]
    fn goals_alone_do_not_replace_those_of_the_map() {
        let error = on_map(json!({"targets_xy": [[0, 0], [0, 1], [0, 2], [0, 3]]})).unwrap_err();
        assert_eq!(error.field(), Some("targets_xy"));
    }
}
