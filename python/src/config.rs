//! What is derived of a config.

use pogema_core::{Error, Map};
use pogema_maps::{GridConfig, InstanceSource, nearest, parse_map_text};
use pyo3::prelude::*;
use serde_json::json;

use crate::errors;

/// Everything that POGEMA derives of a config, from and to an object in JSON.
#[pyfunction]
pub fn derive_config(py: Python<'_>, config: &str) -> PyResult<String> {
    let config = GridConfig::from_json(config).map_err(|error| errors::config(py, &error))?;
    let mut fields = config.to_value();
    fields["width"] = json!(config.width);
    fields["height"] = json!(config.height);
    fields["size"] = json!(config.size);
    Ok(fields.to_string())
}

/// The known name that is most like the one given.
#[pyfunction]
pub fn nearest_name(name: &str, known: Vec<String>) -> String {
    nearest(name, known.iter().map(String::as_str)).unwrap_or_default().to_owned()
}

/// The source of a config's instances, and the config.
pub fn source(config: &str, registered: Option<&str>) -> Result<InstanceSource, Error> {
    let (config, map) = read(config, registered)?;
    InstanceSource::new(config, map)
}

/// A config, and the map that its `map_name` names.
pub fn read(config: &str, registered: Option<&str>) -> Result<(GridConfig, Option<Map>), Error> {
    let mut config = GridConfig::from_json(config)?;
    // A name that nobody registered means nothing to POGEMA.
    if registered.is_none() {
        config.map_name = None;
    }
    let map = registered.map(parse_map_text).transpose()?.map(|text| text.map);
    Ok((config, map))
}
