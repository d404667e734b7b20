//! Maps by name: built-in maps and maps from the user's files.

use std::collections::{BTreeMap, BTreeSet};

use pogema_core::{Error, Words};
use regex::Regex;

use crate::catalogue::named_maps;
use crate::config::did_you_mean;
use crate::formats::NamedMap;
use crate::generators::Preset;
use crate::text::MapText;
use pogema_numpy::Generator;

/// A collection of maps, sorted by name.
#[derive(Clone, Debug, Default)]
pub struct Library {
    maps: BTreeMap<String, MapText>,
}

impl Library {
    /// Creates a library without maps.
    pub fn empty() -> Self {
        Self::default()
    }

    /// Creates a library of the built-in maps.
    pub fn built_in() -> Self {
        Self { maps: named_maps().map(|map| (map.name, map.text)).collect() }
    }

    /// Adds maps and returns the names that were already taken. A new map replaces an existing one of the same name.
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

    /// Adds the maps of the paper's generators that are selected by names or patterns. A name or pattern that matches a
    /// map of the library adds none.
    ///
    /// # Errors
    /// None: the settings of the paper's maps are in range.
    pub fn add_published<'a>(&mut self, names: impl IntoIterator<Item = &'a str>) -> Result<(), Error> {
        let names: BTreeSet<&str> = names.into_iter().filter(|name| !self.maps.contains_key(*name)).collect();
        let published = published_names();
        // Most suites list whole names, which need no pattern.
        let (whole, patterns): (BTreeSet<&str>, _) =
            names.into_iter().partition(|name| published.contains(*name));
        // Invalid patterns are skipped here. They cause an error when their maps are used.
        let patterns = patterns.into_iter().filter_map(|name| Pattern::new(name).ok());
        let patterns: Vec<Pattern> =
            patterns.filter(|pattern| !self.names().any(|name| pattern.matches(name))).collect();
        let is_selected =
            |name: &str| whole.contains(name) || patterns.iter().any(|pattern| pattern.matches(name));
        for preset in Preset::all() {
            self.register(preset.selected(is_selected)?);
        }
        Ok(())
    }

    /// Returns all names, sorted.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.maps.keys().map(String::as_str)
    }

    /// Returns the map with the given name.
    ///
    /// # Errors
    /// [`Error::Config`] with the nearest known name.
    pub fn map(&self, name: &str) -> Result<&MapText, Error> {
        self.maps.get(name).ok_or_else(|| self.unknown(name, "a known map"))
    }

    /// Returns the names that match a pattern, sorted.
    ///
    /// The pattern is a regular expression, and `^PATTERN$` must match at the beginning of the name. So `a|b` matches
    /// names that begin with `a`, and the name `b`.
    ///
    /// # Errors
    /// [`Error::Config`] for an invalid pattern; [`Error::Config`] with the nearest known name if nothing matches.
    ///
    /// Source: pogema-toolbox 0.1.1, `create_env.py`, `MultiMapWrapper.__init__`
    pub fn matching(&self, pattern: &str) -> Result<Vec<&str>, Error> {
        let expression = Pattern::new(pattern)?;
        let names: Vec<&str> = self.names().filter(|name| expression.matches(name)).collect();
        if names.is_empty() {
            return Err(self.unknown(pattern, "a pattern that matches a known map"));
        }
        Ok(names)
    }

    /// Checks that a pattern is valid, whether or not it matches a name.
    ///
    /// # Errors
    /// [`Error::Config`] if the pattern is invalid.
    pub fn check_pattern(pattern: &str) -> Result<(), Error> {
        Pattern::new(pattern).map(drop)
    }

    /// Returns the map with the given name. If no map has this name, the name is a pattern that selects maps, and the
    /// seed chooses one of them.
    ///
    /// # Errors
    /// Those of [`Library::matching`].
    pub fn named_or_chosen(&self, name: &str, seed: u64) -> Result<(&str, &MapText), Error> {
        self.maps.get_key_value(name).map_or_else(|| self.choose(name, seed), |(name, text)| Ok((name, text)))
    }

    /// Returns the map that a seed chooses among those that match a pattern.
    ///
    /// # Errors
    /// Those of [`Library::matching`].
    ///
    /// Source: pogema-toolbox 0.1.1, `create_env.py`, `MultiMapWrapper.reset`
    pub fn choose(&self, pattern: &str, seed: u64) -> Result<(&str, &MapText), Error> {
        let names = self.matching(pattern)?;
        let index = Generator::seeded(seed).integers(0, names.len() as i64).unwrap_or_default();
        let name = names[index as usize];
        Ok((name, self.map(name)?))
    }

    fn unknown(&self, name: &str, expected: &str) -> Error {
        let published = published_names();
        let hint = did_you_mean(name, self.names().chain(published.iter().map(String::as_str)));
        Error::config("map_name", name, format!("{expected}{hint}"))
    }
}

/// Returns the names of the maps of the paper's generators.
fn published_names() -> BTreeSet<String> {
    Preset::all().flat_map(Preset::names).map(|(_, name)| name).collect()
}

/// A pattern of names, see [`Library::matching`].
struct Pattern(Regex);

impl Pattern {
    fn new(pattern: &str) -> Result<Self, Error> {
        Regex::new(&format!("^{pattern}$")).map(Self).map_err(|error| {
            let reason = error.to_string();
            let last = reason.lines().last().unwrap_or_default().trim_start_matches("error: ");
            Error::config("map_name", pattern, format!("a regular expression: {last}"))
        })
    }

    /// Returns whether a name matches. In `^a|b$`, `^` does not anchor the second alternative, so the start of the
    /// match is checked.
    fn matches(&self, name: &str) -> bool {
        self.0.find(name).is_some_and(|found| found.start() == 0)
    }
}
