//! Reads single fields of a config and checks their type and range.

use std::ops::RangeInclusive;

use pogema_core::{Cell, Error, Words, shorten};
use serde_json::{Map as Object, Value};

/// All keys of a config: those of POGEMA first, then our extensions.
pub const FIELDS: [&str; 27] = [
    "MOVES",
    "FREE",
    "OBSTACLE",
    "empty_outside",
    "on_target",
    "seed",
    "width",
    "height",
    "size",
    "density",
    "obs_radius",
    "agents_xy",
    "targets_xy",
    "num_agents",
    "possible_agents_xy",
    "possible_targets_xy",
    "collision_system",
    "persistent",
    "observation_type",
    "map",
    "map_name",
    "integration",
    "max_episode_steps",
    "auto_reset",
    "occupancy",
    "reward",
    "limits",
];

/// Least similarity of a suggested word to the given one, from 0 to 1.
const MIN_SIMILARITY: f64 = 0.6;

/// Returns the end of a message that suggests the known word most similar to a given one: `; did you mean …?`, or
/// nothing if no known word is similar.
pub fn did_you_mean<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let word = word.to_lowercase();
    let rated = known.into_iter().map(|other| (strsim::jaro_winkler(&word, &other.to_lowercase()), other));
    let nearest = rated.max_by(|one, other| one.0.total_cmp(&other.0));
    let similar = nearest.filter(|(similarity, _)| *similarity >= MIN_SIMILARITY);
    let suggest = |known: &str| format!("; did you mean `{}`?", shorten(known, Error::LONGEST_QUOTE));
    similar.map_or_else(String::new, |(_, known)| suggest(known))
}

/// Quotes a key of the input for a message, shortened if it is long.
pub(super) fn quoted(key: &str) -> String {
    format!("`{}`", shorten(key, Error::LONGEST_QUOTE))
}

/// The fields of a config, unchecked, as in the file.
pub(super) struct Fields<'a>(&'a Object<String, Value>);

impl<'a> Fields<'a> {
    /// Wraps the fields of a file if all of them are known.
    pub fn new(object: &'a Object<String, Value>) -> Result<Self, Error> {
        if let Some(key) = object.keys().find(|key| !FIELDS.contains(&key.as_str())) {
            let reason = format!("unknown field {}{}", quoted(key), did_you_mean(key, FIELDS));
            return Err(Error::Syntax { reason });
        }
        Ok(Self(object))
    }

    /// Returns the value of a field; `None` if it is absent or null.
    pub fn optional(&self, field: &str) -> Option<&'a Value> {
        self.0.get(field).filter(|value| !value.is_null())
    }

    /// Returns the value of a field that may be absent but not null.
    pub fn non_null(&self, field: &str, expected: &str) -> Result<Option<&'a Value>, Error> {
        match self.0.get(field) {
            Some(Value::Null) => Err(Error::config(field, "null", expected)),
            value => Ok(value),
        }
    }

    /// Reads a whole number in a range; null means absent.
    pub fn optional_integer(&self, field: &str, range: RangeInclusive<i64>) -> Result<Option<i64>, Error> {
        self.optional(field).map(|value| integer(field, value, &range)).transpose()
    }

    /// Reads a whole number in a range.
    pub fn integer(&self, field: &str, range: RangeInclusive<i64>, default: i64) -> Result<i64, Error> {
        let value = self.non_null(field, &whole_number_in(&range))?;
        value.map_or(Ok(default), |value| integer(field, value, &range))
    }

    /// Reads a number in a range.
    pub fn number(&self, field: &str, range: RangeInclusive<f64>, default: f64) -> Result<f64, Error> {
        let expected = format!("a number from {} to {}", range.start(), range.end());
        let Some(value) = self.non_null(field, &expected)? else { return Ok(default) };
        let number = value.as_f64().filter(|number| range.contains(number));
        number.ok_or_else(|| Error::config(field, value, expected))
    }

    /// Reads true or false; null means absent.
    pub fn optional_flag(&self, field: &str) -> Result<Option<bool>, Error> {
        self.optional(field).map(|value| flag(field, value)).transpose()
    }

    /// Reads true or false.
    pub fn flag(&self, field: &str, default: bool) -> Result<bool, Error> {
        self.non_null(field, "true or false")?.map_or(Ok(default), |value| flag(field, value))
    }

    /// Reads a keyword; null means absent.
    pub fn optional_word<T: Words>(&self, field: &str) -> Result<Option<T>, Error> {
        self.optional(field).map(|value| word(field, value)).transpose()
    }

    /// Reads a keyword; if it is absent, returns the default.
    pub fn word<T: Words + Default>(&self, field: &str) -> Result<T, Error> {
        self.non_null(field, &T::expected())?.map_or_else(|| Ok(T::default()), |value| word(field, value))
    }

    /// Reads a string; null means absent.
    pub fn text(&self, field: &str) -> Result<Option<&'a str>, Error> {
        let Some(value) = self.optional(field) else { return Ok(None) };
        value.as_str().map(Some).ok_or_else(|| Error::config(field, value, "a string"))
    }

    /// Reads a list of cells; null means absent.
    pub fn cells(&self, field: &str) -> Result<Option<Vec<Cell>>, Error> {
        self.optional(field).map(|value| cells(field, value)).transpose()
    }
}

fn whole_number_in(range: &RangeInclusive<i64>) -> String {
    if *range == (i64::MIN..=i64::MAX) {
        return "a 64-bit whole number".into();
    }
    format!("a whole number from {} to {}", range.start(), range.end())
}

fn integer(field: &str, value: &Value, range: &RangeInclusive<i64>) -> Result<i64, Error> {
    let number = value.as_i64().filter(|number| range.contains(number));
    number.ok_or_else(|| Error::config(field, value, whole_number_in(range)))
}

fn flag(field: &str, value: &Value) -> Result<bool, Error> {
    value.as_bool().ok_or_else(|| Error::config(field, value, "true or false"))
}

fn word<T: Words>(field: &str, value: &Value) -> Result<T, Error> {
    let known = value.as_str().and_then(T::of_word);
    known.ok_or_else(|| Error::config(field, value, T::expected()))
}

/// Reads a list of `[row, col]` pairs.
pub(crate) fn cells(field: &str, value: &Value) -> Result<Vec<Cell>, Error> {
    let list = value.as_array().ok_or_else(|| Error::config(field, value, "a list of [row, col] pairs"))?;
    list.iter().map(|pair| cell(field, pair)).collect()
}

fn cell(field: &str, value: &Value) -> Result<Cell, Error> {
    let coordinate = |at: usize| value.get(at)?.as_i64().and_then(|number| u16::try_from(number).ok());
    let pair =
        value.as_array().filter(|pair| pair.len() == 2).and_then(|_| Some((coordinate(0)?, coordinate(1)?)));
    let (row, col) = pair.ok_or_else(|| {
        Error::config(field, value, format!("a pair [row, col] of whole numbers from 0 to {}", u16::MAX))
    })?;
    Ok(Cell::new(row, col))
}
