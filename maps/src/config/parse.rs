//! Parses YAML and JSON into an object of fields, without guessing values or silently dropping any.

use std::fmt;

use pogema_core::Error;
use serde::de::{Deserialize, DeserializeSeed, Deserializer, Error as _, MapAccess, SeqAccess, Visitor};
use serde_json::{Map as Object, Number, Value};
use serde_saphyr::budget::BudgetBreach;
use serde_saphyr::options::NonFiniteFloatPolicy;
use serde_saphyr::{Error as YamlError, MessageFormatter, Options, UserMessageFormatter};

use super::fields::quoted;

/// Parses YAML; an empty text is null.
///
/// # Errors
/// [`Error::Syntax`] with line and column.
pub fn value_from_yaml(text: &str) -> Result<Value, Error> {
    if text.trim().is_empty() {
        return Ok(Value::Null);
    }
    yaml_document::<Document>(text).map(|document| document.0)
}

/// Reads one YAML document that is not empty.
///
/// # Errors
/// [`Error::Syntax`] with line and column; also if aliases expand the text far beyond its length.
pub fn yaml_document<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, Error> {
    serde_saphyr::from_str_with_options(text, options(text)).map_err(|error| yaml_error(&error))
}

/// Parses JSON.
///
/// # Errors
/// [`Error::Syntax`] with line and column.
pub fn value_from_json(text: &str) -> Result<Value, Error> {
    let document: Document = serde_json::from_str(text).map_err(|error| {
        let (line, column) = (error.line(), error.column());
        let message = error.to_string();
        let bare = message.strip_suffix(&format!(" at line {line} column {column}")).unwrap_or(&message);
        syntax(line as u64, column as u64, bare)
    })?;
    Ok(document.0)
}

fn options(text: &str) -> Options {
    // A text has at most one node and two events per character. Only aliases can produce more.
    let (spare_nodes, spare_events) = (250_000, 1_000_000);
    serde_saphyr::options! {
        budget: serde_saphyr::budget! {
            max_nodes: text.len() + spare_nodes,
            max_events: 2 * text.len() + spare_events,
        },
        // `Node` rejects non-finite numbers and names the field.
        non_finite_float_policy: NonFiniteFloatPolicy::PassThrough,
        // The map text `!..` parses as a tag without a value. Without this option it would be read as an absent map.
        reject_unsupported_tags: true,
        with_snippet: false,
    }
}

fn yaml_error(error: &YamlError) -> Error {
    let place = error.location().unwrap_or(serde_saphyr::Location::UNKNOWN);
    syntax(place.line(), place.column(), &yaml_reason(error))
}

fn yaml_reason(error: &YamlError) -> String {
    match error.without_snippet() {
        YamlError::AliasError { error, .. } => yaml_reason(error),
        YamlError::DuplicateMappingKey { key: Some(key), .. } => duplicate(key),
        YamlError::MultipleDocuments { .. } => "found a second document, expected one".into(),
        YamlError::UnknownAnchor { .. } => "unknown alias".into(),
        YamlError::RecursiveReferencesRequireWeakTypes { .. } => {
            "an alias refers to a value that contains it".into()
        }
        YamlError::Budget { breach: BudgetBreach::Depth { .. }, .. } => "too many levels of nesting".into(),
        YamlError::Budget { .. } | YamlError::AliasReplayLimitExceeded { .. } => {
            "too large, or too many aliases".into()
        }
        other => UserMessageFormatter.format_message(other).into_owned(),
    }
}

fn duplicate(key: &str) -> String {
    format!("duplicate key {}", quoted(key))
}

fn syntax(line: u64, column: u64, reason: &str) -> Error {
    // Parsers count lines from 1; 0 means that the line is unknown.
    let place = if line == 0 { String::new() } else { format!("line {line}, column {column}: ") };
    Error::Syntax { reason: place + reason }
}

struct Document(Value);

impl<'de> Deserialize<'de> for Document {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Node { field: "the config" }.deserialize(deserializer).map(Document)
    }
}

/// Reads a value, but rejects NaN, infinities and duplicate keys. [`Value`] would accept them: it turns NaN and
/// infinities into null and keeps the last of two equal keys.
#[derive(Clone, Copy)]
struct Node<'a> {
    /// The innermost key above the value, for messages.
    field: &'a str,
}

impl<'de> DeserializeSeed<'de> for Node<'_> {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Node<'_> {
    type Value = Value;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a value")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, flag: bool) -> Result<Value, E> {
        Ok(flag.into())
    }

    fn visit_i64<E>(self, number: i64) -> Result<Value, E> {
        Ok(number.into())
    }

    fn visit_u64<E>(self, number: u64) -> Result<Value, E> {
        Ok(number.into())
    }

    fn visit_f64<E: serde::de::Error>(self, number: f64) -> Result<Value, E> {
        let finite = Number::from_f64(number).map(Value::Number);
        finite.ok_or_else(|| {
            E::custom(format!("{} is `{number}`, expected a finite number", quoted(self.field)))
        })
    }

    fn visit_str<E>(self, text: &str) -> Result<Value, E> {
        Ok(text.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Value, A::Error> {
        let mut list = Vec::new();
        while let Some(item) = items.next_element_seed(self)? {
            list.push(item);
        }
        Ok(list.into())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut object = Object::new();
        while let Some(key) = entries.next_key::<String>()? {
            if object.contains_key(&key) {
                return Err(A::Error::custom(duplicate(&key)));
            }
            let value = entries.next_value_seed(Node { field: &key })?;
            object.insert(key, value);
        }
        Ok(object.into())
    }
}
