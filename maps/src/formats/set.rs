//! Map sets: map texts by name, in YAML.

use std::collections::BTreeSet;
use std::fmt;

use pogema_core::{Error, printable_json, shorten, unknown_character};
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_saphyr::Spanned;

use crate::config::yaml_document;
use crate::text::{MapText, parse_map_text};

/// A map and its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedMap {
    /// The name.
    pub name: String,
    /// The map, with starts and goals where its text has them.
    pub text: MapText,
}

/// Reads a map set, in the order of the file.
///
/// # Errors
/// [`Error::Map`] with line and column for a map that [`parse_map_text`] rejects; [`Error::Request`] with line and
/// column for invalid YAML or a duplicate name.
///
/// Source: pogema-toolbox 0.1.1, `registry.py`, `ToolboxRegistry._initialize_maps`
pub fn read_set(text: &str) -> Result<Vec<NamedMap>, Error> {
    if text.trim().is_empty() {
        return Ok(Vec::new());
    }
    let entries: Entries = yaml_document(text).map_err(|error| match error {
        Error::Syntax { reason } => Error::Request { reason: format!("map set: {reason}") },
        other => other,
    })?;
    let mut names = BTreeSet::new();
    let read = |(name, block): (String, Spanned<String>)| {
        let place = Place { source: text, block: &block, name: &name };
        if !names.insert(name.clone()) {
            let (line, column) = place.find(1, 1);
            let name = shorten(&name, Error::LONGEST_QUOTE);
            let reason = format!("map set: line {line}, column {column}: duplicate key `{name}`");
            return Err(Error::request(reason));
        }
        let map = parse_map_text(&block.value).map_err(|error| match error {
            Error::Map { line, column, reason } => place.error(line, column, &reason),
            Error::UnknownCharacter { line, column, character } => {
                place.error(line, column, &unknown_character(character))
            }
            Error::Instance { reason } => place.error(1, 1, &reason),
            other => other,
        })?;
        Ok(NamedMap { name, text: map })
    };
    entries.0.into_iter().map(read).collect()
}

/// Writes a map set in the format of the published ones.
///
/// # Errors
/// Those of [`MapText::rows`].
pub fn write_set(maps: &[NamedMap]) -> Result<String, Error> {
    maps.iter().map(set_entry).collect()
}

/// Writes one map as an entry of a map set; a set is a sequence of entries.
///
/// # Errors
/// Those of [`MapText::rows`].
pub fn set_entry(NamedMap { name, text }: &NamedMap) -> Result<String, Error> {
    // A quoted JSON string is also a YAML string.
    let name = printable_json(&serde_json::Value::from(name.as_str()).to_string());
    let rows = text.rows()?;
    let lines = std::iter::once(format!("{name}: |-\n")).chain(rows.iter().map(|row| format!("  {row}\n")));
    Ok(lines.collect())
}

/// The place of a map in the file.
struct Place<'a> {
    source: &'a str,
    block: &'a Spanned<String>,
    name: &'a str,
}

impl Place<'_> {
    /// Returns an error about a row of the map, counted from 1, with its line and column in the file.
    fn error(&self, row: usize, column: usize, reason: &str) -> Error {
        let (line, column) = self.find(row, column);
        let quoted = shorten(self.name, Error::LONGEST_QUOTE);
        Error::Map { line, column, reason: format!("in `{quoted}`: {reason}") }
    }

    fn find(&self, row: usize, column: usize) -> (usize, usize) {
        let (first, begin) = (self.block.defined.line() as usize, self.block.defined.column() as usize);
        let text = self.block.value.as_str();
        // The parser reports the first line that is not empty.
        let num_blank = text.lines().take_while(|line| line.is_empty()).count();
        let line = (first + row).saturating_sub(1 + num_blank);
        let row_text = text.lines().nth(row - 1).unwrap_or_default();
        let found = self.source.lines().nth(line.saturating_sub(1)).and_then(|there| {
            let offset = there.find(row_text).filter(|_| !row_text.is_empty())?;
            Some(there[..offset].chars().count())
        });
        // The rows of a quoted text are not always lines of the file.
        found.map_or((first, begin), |offset| (line, offset + column))
    }
}

/// The entries of a set in the order of the file, duplicate names included.
struct Entries(Vec<(String, Spanned<String>)>);

impl<'de> Deserialize<'de> for Entries {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reader;
        impl<'de> Visitor<'de> for Reader {
            type Value = Entries;

            fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
                out.write_str("names and map texts such as `small: \"a.A\"`")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Entries, A::Error> {
                let mut list = Vec::new();
                while let Some(name) = entries.next_key::<String>()? {
                    let block = entries.next_value()?;
                    list.push((name, block));
                }
                Ok(Entries(list))
            }
        }
        deserializer.deserialize_map(Reader)
    }
}
