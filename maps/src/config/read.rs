//! Reads configs from YAML and JSON.

use pogema_core::{Cell, Config, Error, Map};
use serde_json::{Map as Object, Value, json};

use super::fields::{Fields, cells};
use super::parse::{value_from_json, value_from_yaml};
use super::{GridConfig, Limits, Targets};
use crate::text::{MapText, parse_map_text};

/// Largest side that POGEMA 1.4.0 accepts.
const RELEASED_SIDE: i64 = 4096;
/// Largest number of agents that POGEMA 1.4.0 accepts.
const RELEASED_AGENTS: i64 = 10_000_000;

impl GridConfig {
    /// Reads a config from YAML.
    ///
    /// # Errors
    /// [`Error::Syntax`] for invalid YAML, a document that is not an object, or an unknown field; otherwise one line
    /// that names the field or the place in the map, what was found, and what is expected.
    ///
    /// Rule: config/fields
    pub fn from_yaml(text: &str) -> Result<Self, Error> {
        match value_from_yaml(text)? {
            Value::Null => Ok(Self::default()),
            value => Self::from_value(&value),
        }
    }

    /// Reads a config from JSON.
    ///
    /// # Errors
    /// As for [`GridConfig::from_yaml`], for invalid JSON instead of invalid YAML.
    ///
    /// Rule: config/fields
    pub fn from_json(text: &str) -> Result<Self, Error> {
        Self::from_value(&value_from_json(text)?)
    }

    /// Reads a config from an already parsed object.
    ///
    /// # Errors
    /// As for [`GridConfig::from_yaml`], except those for invalid YAML.
    ///
    /// Rule: config/fields
    pub fn from_value(value: &Value) -> Result<Self, Error> {
        Self::read(value.as_object().ok_or_else(|| no_object(value))?, None)
    }

    /// Reads a config from its fields; a given map replaces the field `map`.
    pub(crate) fn read(object: &Object<String, Value>, map: Option<MapText>) -> Result<Self, Error> {
        let fields = Fields::new(object)?;
        check_constants(&fields)?;
        let mut config =
            Self { on_target: fields.word("on_target")?, limits: fields.word("limits")?, ..Self::default() };
        config.read_sizes(&fields)?;
        config.read_places(&fields)?;
        config.read_rules(&fields)?;
        config.read_map(&fields, map)?;
        config.check_consistency()?;
        Ok(config)
    }

    /// Reads seed, sides, density, radius, starts and number of agents.
    ///
    /// Rule: config/size, config/agents, config/limits
    fn read_sizes(&mut self, fields: &Fields<'_>) -> Result<(), Error> {
        let (longest, agents) = match self.limits {
            Limits::AsReleased => (RELEASED_SIDE, RELEASED_AGENTS),
            Limits::Extended => (Map::LONGEST_SIDE as i64, i64::from(u32::MAX)),
        };
        self.seed = fields.optional_integer("seed", 0..=i64::MAX - 1)?.map(|seed| seed as u64);
        let size = fields.integer("size", 2..=longest, 8)? as usize;
        let width = fields.optional_integer("width", 1..=longest)?;
        let height = fields.optional_integer("height", 1..=longest)?;
        (self.width, self.height) = match (width, height) {
            (Some(width), Some(height)) => (width as usize, height as usize),
            (None, None) => (size, size),
            // A map sets both sides itself.
            _ if fields.optional("map").is_some() => (size, size),
            (Some(width), None) => return Err(Error::config("width", width, "the field `height`, too")),
            (None, Some(height)) => return Err(Error::config("height", height, "the field `width`, too")),
        };
        self.size = self.width.max(self.height);
        self.density = fields.number("density", 0.0..=1.0, 0.3)?;
        self.obs_radius = fields.integer("obs_radius", 1..=Config::LARGEST_RADIUS as i64, 5)? as usize;
        self.agents_xy = fields.cells("agents_xy")?;
        let default = self.agents_xy.as_ref().map_or(1, |starts| starts.len().max(1));
        self.num_agents =
            fields.optional_integer("num_agents", 1..=agents)?.map_or(default, |num| num as usize);
        Ok(())
    }

    /// Reads goals and pools.
    ///
    /// Rule: config/positions
    fn read_places(&mut self, fields: &Fields<'_>) -> Result<(), Error> {
        self.targets_xy = fields.optional("targets_xy").map(read_targets).transpose()?;
        self.possible_agents_xy = fields.cells("possible_agents_xy")?;
        self.possible_targets_xy = fields.cells("possible_targets_xy")?;
        Ok(())
    }

    fn read_rules(&mut self, fields: &Fields<'_>) -> Result<(), Error> {
        self.collision_system = fields.word("collision_system")?;
        self.observation_type = fields.word("observation_type")?;
        self.max_episode_steps = fields.integer("max_episode_steps", i64::MIN..=i64::MAX, 64)?;
        self.persistent = fields.flag("persistent", false)?;
        self.empty_outside = fields.flag("empty_outside", true)?;
        self.map_name = fields.text("map_name")?.map(str::to_owned);
        self.integration = fields.optional_word("integration")?;
        self.auto_reset = fields.optional_flag("auto_reset")?;
        self.occupancy = fields.word("occupancy")?;
        self.reward = fields.word("reward")?;
        Ok(())
    }

    /// Reads the map, and derives sides and density from it.
    ///
    /// Rule: config/map
    fn read_map(&mut self, fields: &Fields<'_>, given: Option<MapText>) -> Result<(), Error> {
        let map = match (given, fields.optional("map")) {
            (None, None) => return Ok(()),
            (Some(text), _) => self.take_map_text(text)?,
            (None, Some(Value::String(text))) => self.take_map_text(parse_map_text(text)?)?,
            (None, Some(Value::Array(rows))) => map_from_rows(rows)?,
            (None, Some(other)) => return Err(Error::config("map", other, "a string or a list of rows")),
        };
        (self.width, self.height) = (map.width(), map.height());
        self.size = self.width.max(self.height);
        let num_cells = map.width() * map.height();
        self.density = (num_cells - map.num_free()) as f64 / num_cells as f64;
        self.map = Some(map);
        Ok(())
    }

    /// Takes starts, goals and pools from a map text.
    ///
    /// Rule: grid/letters, grid/pools
    fn take_map_text(&mut self, text: MapText) -> Result<Map, Error> {
        let both_given = self.agents_xy.is_some() && self.targets_xy.is_some();
        if !text.starts.is_empty() {
            if both_given {
                let expected = "starts and goals either in the map or in agents_xy and targets_xy";
                return Err(Error::config("map", "a map with letters", expected));
            }
            self.num_agents = text.starts.len();
            self.agents_xy = Some(text.starts);
            self.targets_xy = Some(text.goals);
        } else if let (false, Some((starts, goals))) = (both_given, text.pools)
            && !starts.is_empty()
            && !goals.is_empty()
        {
            self.possible_agents_xy = Some(starts);
            self.possible_targets_xy = Some(goals);
        }
        Ok(text.map)
    }
}

fn no_object(value: &Value) -> Error {
    let found = match value {
        Value::Null => "nothing",
        Value::Bool(_) => "true or false",
        Value::Number(_) => "a number",
        Value::String(_) => "a string",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    };
    Error::Syntax { reason: format!("found {found}, expected fields and values such as `size: 8`") }
}

/// Checks the constants. POGEMA lets a config redefine them; we accept only the values that the rules assume.
///
/// Rule: config/constants
fn check_constants(fields: &Fields<'_>) -> Result<(), Error> {
    let moves = json!([[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]]);
    for (field, constant) in [("MOVES", moves), ("FREE", json!(0)), ("OBSTACLE", json!(1))] {
        let value = fields.non_null(field, &constant.to_string())?;
        if let Some(other) = value.filter(|value| **value != constant) {
            return Err(Error::config(field, other, constant.to_string()));
        }
    }
    Ok(())
}

pub(crate) fn read_targets(value: &Value) -> Result<Targets, Error> {
    let expected = "a list of [row, col] goals, or of lists of at least two such goals";
    let list = value.as_array().filter(|list| !list.is_empty());
    let list = list.ok_or_else(|| Error::config("targets_xy", value, expected))?;
    let is_sequence = |value: &Value| value.get(0).is_some_and(Value::is_array);
    if !is_sequence(&list[0]) {
        return Ok(Targets::Single(cells("targets_xy", value)?));
    }
    let sequence = |value: &Value| -> Result<Vec<Cell>, Error> {
        let goals = cells("targets_xy", value)?;
        if goals.len() < 2 {
            return Err(Error::config("targets_xy", value, "at least two goals in the sequence of an agent"));
        }
        Ok(goals)
    };
    Ok(Targets::Sequences(list.iter().map(sequence).collect::<Result<_, _>>()?))
}

/// Reads a map given as rows of 0 and 1.
///
/// Rule: config/map
fn map_from_rows(rows: &[Value]) -> Result<Map, Error> {
    if rows.iter().all(|row| row.as_array().is_some_and(Vec::is_empty)) {
        return Err(Error::config("map", Value::from(rows), "at least one row of at least one cell"));
    }
    let mut obstacles = Vec::new();
    let mut width = 0;
    for (index, row) in rows.iter().enumerate() {
        let list = row.as_array().ok_or_else(|| Error::config("map", row, "a row as a list of 0 and 1"))?;
        width = if index == 0 { list.len() } else { width };
        pogema_core::check_row_length(index, list.len(), width)?;
        for (column, value) in list.iter().enumerate() {
            match value.as_i64() {
                Some(0) => obstacles.push(false),
                Some(1) => obstacles.push(true),
                _ => {
                    let reason = format!("`{value}` is not 0 (free) or 1 (obstacle)");
                    return Err(Error::Map { line: index + 1, column: column + 1, reason });
                }
            }
        }
    }
    Map::new(rows.len(), width, obstacles)
}
