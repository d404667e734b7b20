//! The config of a run: a file, and flags that override it.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use pogema_core::Error;
use pogema_maps::{GridConfig, map_names, named_map, nearest, parse_map_text};
use serde_json::{Map as Object, Number, Value};

#[derive(Args, Debug)]
pub struct Settings {
    /// A config file with POGEMA's fields, YAML or JSON
    config: Option<PathBuf>,
    /// A named map, or a file with a map text
    #[arg(long, value_name = "NAME|FILE")]
    map: Option<String>,
    /// Seed of everything that is drawn
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Number of agents
    #[arg(long, value_name = "N")]
    num_agents: Option<u64>,
    /// Side of a drawn map
    #[arg(long, value_name = "N")]
    size: Option<u64>,
    /// Share of obstacles of a drawn map
    #[arg(long, value_name = "P")]
    density: Option<f64>,
    /// How far agents see
    #[arg(long, value_name = "R")]
    obs_radius: Option<u64>,
    /// Most steps of the episode
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    steps: Option<i64>,
    /// What reaching a goal does
    #[arg(long)]
    on_target: Option<OnTarget>,
    /// How conflicts are resolved
    #[arg(long)]
    collision_system: Option<CollisionSystem>,
    /// Any other field, such as `empty_outside=false`
    #[arg(long = "set", value_name = "FIELD=VALUE")]
    others: Vec<String>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum OnTarget {
    Finish,
    Nothing,
    Restart,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
#[value(rename_all = "snake_case")]
enum CollisionSystem {
    Priority,
    BlockBoth,
    Soft,
}

impl Settings {
    /// The config that file and flags make together.
    pub fn config(&self) -> Result<GridConfig, Error> {
        let mut fields = match &self.config {
            Some(path) => fields_of(path)?,
            None => Object::new(),
        };
        let mut set = |field: &str, value: Option<Value>| {
            if let Some(value) = value {
                fields.insert(field.into(), value);
            }
        };
        set("seed", self.seed.map(Into::into));
        set("num_agents", self.num_agents.map(Into::into));
        set("size", self.size.map(Into::into));
        set("density", self.density.map(number));
        set("obs_radius", self.obs_radius.map(Into::into));
        set("max_episode_steps", self.steps.map(Into::into));
        set("on_target", word(self.on_target).map(Into::into));
        set("collision_system", word(self.collision_system).map(Into::into));
        set("map", self.map.as_deref().map(map_text).transpose()?.map(Into::into));
        for other in &self.others {
            let (field, value) = other
                .split_once('=')
                .ok_or_else(|| Error::Syntax { reason: format!("`--set {other}`, expected FIELD=VALUE") })?;
            set(field, Some(value_of(value)));
        }
        if self.size.is_some() {
            fields.remove("width");
            fields.remove("height");
        }
        GridConfig::from_value(&Value::Object(fields))
    }
}

fn word(choice: Option<impl ValueEnum>) -> Option<String> {
    choice?.to_possible_value().map(|value| value.get_name().to_owned())
}

/// JSON has no NaN and would make it null, so it is left to the config to refuse the word.
fn number(value: f64) -> Value {
    Number::from_f64(value).map_or_else(|| value.to_string().into(), Value::Number)
}

fn value_of(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|_| text.into())
}

fn fields_of(path: &Path) -> Result<Object<String, Value>, Error> {
    let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, error))?;
    let is_json = path.extension().is_some_and(|ending| ending == "json");
    let value =
        if is_json { pogema_maps::value_from_json(&text) } else { pogema_maps::value_from_yaml(&text) };
    match value.map_err(|error| Error::io(path, error))? {
        Value::Object(fields) => Ok(fields),
        Value::Null => Ok(Object::new()),
        _ => Err(Error::io(path, "expected fields and values such as `size: 8`")),
    }
}

/// The text of a map, by name or from a file.
fn map_text(name: &str) -> Result<String, Error> {
    if let Ok(map) = named_map(name) {
        return Ok(map.rows().join("\n"));
    }
    let text = std::fs::read_to_string(name).map_err(|error| {
        let hint = nearest(name, map_names()).unwrap_or_default();
        Error::io(name, format!("{error}; it is no known map either, the nearest of those is `{hint}`"))
    })?;
    // Read here for the sake of the file's name in the error.
    parse_map_text(&text).map_err(|error| Error::io(name, error))?;
    Ok(text)
}
