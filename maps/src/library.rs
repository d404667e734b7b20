//! Maps by name: those that come with the program and those of the user's files.

use std::collections::BTreeMap;

use pogema_core::{Error, shorten};
use regex::Regex;

use crate::catalogue::named_maps;
use crate::config::nearest;
use crate::formats::NamedMap;
use crate::text::MapText;
use pogema_numpy::Generator;

/// Maps by name, in the order of their names.
#[derive(Clone, Debug, Default)]
pub struct Library {
    maps: BTreeMap<String, MapText>,
}

impl Library {
    /// No map.
    pub fn empty() -> Self {
        Self::default()
    }

    /// The maps that come with the program.
    pub fn built_in() -> Self {
        Self { maps: named_maps().map(|map| (map.name, map.text)).collect() }
    }

    /// Takes in further maps, each in the place of one that had its name; says which names were taken.
    ///
    /// Source: pogema-toolbox 0.1.1, `registry.py`, `ToolboxRegistry.register_maps`
    pub fn register(&mut self, maps: impl IntoIterator<Item = NamedMap>) -> Vec<String> {
        let mut replaced = Vec::new();
        for NamedMap { name, text } in maps {
            if self.maps.insert(name.clone(), text).is_some() {
                replaced.push(name);
            }
        }
        replaced
    }

    /// All names, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.maps.keys().map(String::as_str)
    }

    /// The map of a name.
    ///
    /// # Errors
    /// [`Error::Config`] with the nearest known name.
    pub fn map(&self, name: &str) -> Result<&MapText, Error> {
        self.maps.get(name).ok_or_else(|| self.unknown(name, "a known map"))
    }

    /// The names that a pattern matches, in order.
    ///
    /// The pattern is a regular expression, and `^PATTERN$` has to match from the beginning of the name on; so `a|b`
    /// means names that begin with `a` and names that are `b`.
    ///
    /// # Errors
    /// [`Error::Config`] for a pattern that is none, and with the nearest known name for one that matches nothing.
    ///
    /// Source: pogema-toolbox 0.1.1, `create_env.py`, `MultiMapWrapper.__init__`
    pub fn matching(&self, pattern: &str) -> Result<Vec<&str>, Error> {
        let expression = Regex::new(&format!("^{pattern}$")).map_err(|error| {
            let reason = error.to_string();
            let last = reason.lines().last().unwrap_or_default().trim_start_matches("error: ");
            Error::config("map_name", pattern, format!("a regular expression: {last}"))
        })?;
        // A second part of `a|b` is not held to the beginning by `^`, but by where the match begins.
        let matches = |name: &&str| expression.find(name).is_some_and(|found| found.start() == 0);
        let names: Vec<&str> = self.names().filter(matches).collect();
        if names.is_empty() {
            return Err(self.unknown(pattern, "a pattern that matches a known map"));
        }
        Ok(names)
    }

    /// Returns the map of a name; without such a map, the name is a pattern from which a seed chooses.
    ///
    /// # Errors
    /// As [`Library::matching`].
    pub fn named_or_chosen(&self, name: &str, seed: u64) -> Result<(&str, &MapText), Error> {
        self.maps.get_key_value(name).map_or_else(|| self.choose(name, seed), |(name, text)| Ok((name, text)))
    }

    /// The map that a seed chooses among those that a pattern matches.
    ///
    /// # Errors
    /// As [`Library::matching`].
    ///
    /// Source: pogema-toolbox 0.1.1, `create_env.py`, `MultiMapWrapper.reset`
    pub fn choose(&self, pattern: &str, seed: u64) -> Result<(&str, &MapText), Error> {
        let names = self.matching(pattern)?;
        let index = Generator::seeded(seed).integers(0, names.len() as i64).unwrap_or_default();
        let name = names[index as usize];
        Ok((name, self.map(name)?))
    }

    fn unknown(&self, name: &str, expected: &str) -> Error {
        let hint = nearest(name, self.names());
        let hint = hint.map(|hint| format!("; the nearest is `{}`", shorten(hint, Error::LONGEST_QUOTE)));
        Error::config("map_name", name, format!("{expected}{}", hint.unwrap_or_default()))
    }
}
