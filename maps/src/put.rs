//! Maps and scenarios in the place of a config's fields.

use pogema_core::Error;
use serde_json::{Map as Object, Value};

use crate::config::Targets;
use crate::formats::Scenario;
use crate::text::MapText;

/// Puts a map in the place of whatever a config's fields have.
///
/// # Errors
/// For a map that has fewer starts than agents are wanted.
pub fn put_map(text: &MapText, fields: &mut Object<String, Value>) -> Result<(), Error> {
    for derived in ["width", "height", "size"] {
        fields.remove(derived);
    }
    let plain = MapText { starts: Vec::new(), goals: Vec::new(), ..text.clone() };
    fields.insert("map".into(), plain.to_text()?.into());
    if text.starts.is_empty() || fields.contains_key("agents_xy") {
        return Ok(());
    }
    put_scenario(
        &Scenario { starts: text.starts.clone(), goals: Targets::Single(text.goals.clone()) },
        fields,
    )
}

/// Puts starts and goals in their place among a config's fields: those of the first agents, where their number is given.
///
/// # Errors
/// For more agents than the scenario has.
pub fn put_scenario(scenario: &Scenario, fields: &mut Object<String, Value>) -> Result<(), Error> {
    let num_agents = fields.get("num_agents").and_then(Value::as_u64);
    let num_agents = num_agents.map_or(scenario.starts.len(), |number| number as usize);
    fields.extend(scenario.truncated(num_agents)?.fields());
    Ok(())
}
