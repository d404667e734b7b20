//! Map sets: map texts by name, in YAML.

use std::collections::BTreeSet;
use std::fmt;

use pogema_core::{Error, shorten};
use serde::de::{Deserialize, Deserializer, Error as _, MapAccess, Visitor};
use serde_saphyr::Spanned;

use crate::config::yaml_document;
use crate::text::{MapText, parse_map_text};

/// A map under its name.
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
/// [`Error::Syntax`] with line and column for what is no YAML, a name that stands twice, or a map that
/// [`parse_map_text`] refuses.
///
/// Source: pogema-toolbox 0.1.1, `registry.py`, `ToolboxRegistry._initialize_maps`
pub fn read_set(text: &str) -> Result<Vec<NamedMap>, Error> {
    if text.trim().is_empty() {
        return Ok(Vec::new());
    }
    let entries: Entries = yaml_document(text)?;
    let mut names = BTreeSet::new();
    let read = |(name, block): (String, Spanned<String>)| {
        let place = Place::of(text, &block);
        if !names.insert(name.clone()) {
            return Err(place.error(1, 1, &name, "the name stands twice"));
        }
        let map = parse_map_text(&block.value).map_err(|error| match error {
            Error::Map { line, column, reason } => place.error(line, column, &name, &reason),
            Error::Instance { reason } => place.error(1, 1, &name, &reason),
            other => other,
        })?;
        Ok(NamedMap { name, text: map })
    };
    entries.0.into_iter().map(read).collect()
}

/// Writes a map set as the published ones are written.
///
/// # Errors
/// [`Error::Instance`] for a map whose starts have no letters.
pub fn write_set(maps: &[NamedMap]) -> Result<String, Error> {
    let mut lines = Vec::new();
    for NamedMap { name, text } in maps {
        // What JSON writes between quotes, YAML reads.
        lines.push(format!("{}: |-\n", serde_json::Value::from(name.as_str())));
        lines.extend(text.rows()?.iter().map(|row| format!("  {row}\n")));
    }
    Ok(lines.concat())
}

/// Where a block stands in the file.
struct Place<'a> {
    source: &'a str,
    /// Line of the block's first row, counted from 1.
    first_line: usize,
    /// Whether rows of the block are lines of the file.
    is_block: bool,
    column: usize,
}

impl<'a> Place<'a> {
    fn of(source: &'a str, block: &Spanned<String>) -> Self {
        let line = block.defined.line() as usize;
        let column = block.defined.column() as usize;
        let line_text = source.lines().nth(line.saturating_sub(1)).unwrap_or_default();
        let begins = line_text.chars().nth(column.saturating_sub(1));
        let is_block = begins == Some('|');
        Self { source, first_line: line + usize::from(is_block), is_block, column }
    }

    fn error(&self, line: usize, column: usize, name: &str, reason: &str) -> Error {
        let quoted = shorten(name, Error::LONGEST_QUOTE);
        let (line, column) = if self.is_block {
            let line = self.first_line + line - 1;
            let text = self.source.lines().nth(line - 1).unwrap_or_default();
            let indent = text.chars().take_while(|letter| *letter == ' ').count();
            (line, indent + column)
        } else {
            (self.first_line, self.column)
        };
        Error::Syntax { reason: format!("line {line}, column {column}: map `{quoted}`: {reason}") }
    }
}

/// The entries of a set in their order, those of equal names as well.
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
                    let block = entries.next_value().map_err(|error| {
                        let quoted = shorten(&name, Error::LONGEST_QUOTE);
                        A::Error::custom(format!("map `{quoted}`: {error}"))
                    })?;
                    list.push((name, block));
                }
                Ok(Entries(list))
            }
        }
        deserializer.deserialize_map(Reader)
    }
}
