//! Derived config fields, and the instance source of a config.

use pogema_core::{Cell, Error, Map};
use pogema_maps::{GridConfig, InstanceSource, parse_map_text};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;
use crate::fields::Fields;
use crate::guard::guarded;

guarded! {
/// Returns the fields that POGEMA derives from a config.
#[pyfunction]
pub fn derive_config(py: Python<'_>, fields: Fields) -> PyResult<Bound<'_, PyDict>> {
    let config = GridConfig::from_value(&fields.0).map_err(|error| errors::config(py, &error))?;
    let derived = PyDict::new(py);
    derived.set_item("width", config.width)?;
    derived.set_item("height", config.height)?;
    derived.set_item("size", config.size)?;
    derived.set_item("density", config.density)?;
    derived.set_item("num_agents", config.num_agents)?;
    let rows = config.map.as_ref().map(|map| {
        let number = |&is_obstacle: &bool| i64::from(is_obstacle);
        map.obstacles().chunks(map.width()).map(|row| row.iter().map(number).collect()).collect()
    });
    derived.set_item::<_, Option<Vec<Vec<i64>>>>("map", rows)?;
    let pairs = |cells: &[Cell]| cells.iter().map(|cell| [cell.row, cell.col]).collect::<Vec<_>>();
    let cells = |cells: &Option<Vec<Cell>>| cells.as_deref().map(pairs);
    derived.set_item("agents_xy", cells(&config.agents_xy))?;
    derived.set_item("possible_agents_xy", cells(&config.possible_agents_xy))?;
    derived.set_item("possible_targets_xy", cells(&config.possible_targets_xy))?;
    let goals = config.targets_xy.map(|goals| pairs(&goals.first()));
    derived.set_item("targets_xy", goals)?;
    Ok(derived)
}
}

guarded! {
/// Returns the end of a message that suggests the known name most similar to `name`, or an empty string if no known
/// name is similar.
#[pyfunction]
pub fn did_you_mean(name: &str, known: Vec<String>) -> PyResult<String> {
    Ok(pogema_maps::did_you_mean(name, known.iter().map(String::as_str)))
}
}

/// Returns the instance source of a config.
pub fn source(fields: &Fields, registered: Option<&str>) -> Result<InstanceSource, Error> {
    let (config, map) = read(fields, registered)?;
    InstanceSource::new(config, map)
}

/// Returns a config and the map that its `map_name` names. `registered` is the text of that map, if it is registered.
pub fn read(fields: &Fields, registered: Option<&str>) -> Result<(GridConfig, Option<Map>), Error> {
    let mut config = GridConfig::from_value(&fields.0)?;
    // POGEMA ignores an unregistered name.
    if registered.is_none() {
        config.map_name = None;
    }
    let map = registered.map(parse_map_text).transpose()?.map(|text| text.map);
    Ok((config, map))
}
