//! The tree of a YAML file, with keys in the order of the file and the line of each value.

use std::fmt;

use pogema_core::Error;
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::Value;
use serde_saphyr::Spanned;

/// A value of a file, and its line.
#[derive(Clone, Debug)]
pub struct Node {
    /// The line, counted from 1.
    pub line: u64,
    /// The value.
    pub content: Content,
}

/// A value of a file.
#[derive(Clone, Debug)]
pub enum Content {
    /// A scalar.
    Plain(Value),
    /// A list of values.
    List(Vec<Node>),
    /// Values by key, in the order of the file.
    Fields(Vec<(String, Node)>),
}

impl Node {
    /// Parses the text of a file.
    ///
    /// # Errors
    /// [`Error::Syntax`] with line and column for invalid YAML.
    pub fn parse(text: &str) -> Result<Self, Error> {
        pogema_maps::yaml_document(text)
    }

    /// Returns the fields, if the value has fields.
    pub fn fields(&self) -> Option<&[(String, Node)]> {
        match &self.content {
            Content::Fields(fields) => Some(fields),
            _ => None,
        }
    }

    /// Returns the field with a key.
    pub fn field(&self, key: &str) -> Option<&Node> {
        self.fields()?.iter().find(|(name, _)| name == key).map(|(_, node)| node)
    }

    /// Returns the elements, if the value is a list.
    pub fn list(&self) -> Option<&[Node]> {
        match &self.content {
            Content::List(nodes) => Some(nodes),
            _ => None,
        }
    }

    /// Returns the text, if the value is a string.
    pub fn text(&self) -> Option<&str> {
        match &self.content {
            Content::Plain(Value::String(text)) => Some(text),
            _ => None,
        }
    }

    /// Returns the value as JSON, without line numbers.
    pub fn value(&self) -> Value {
        match &self.content {
            Content::Plain(value) => value.clone(),
            Content::List(nodes) => nodes.iter().map(Self::value).collect(),
            Content::Fields(fields) => fields.iter().map(|(key, node)| (key.clone(), node.value())).collect(),
        }
    }
}

impl<'de> Deserialize<'de> for Node {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let read = Spanned::<Content>::deserialize(deserializer)?;
        Ok(Self { line: read.referenced.line(), content: read.value })
    }
}

impl<'de> Deserialize<'de> for Content {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Reader)
    }
}

struct Reader;

impl<'de> Visitor<'de> for Reader {
    type Value = Content;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value, a list or fields")
    }

    fn visit_unit<E>(self) -> Result<Content, E> {
        Ok(Content::Plain(Value::Null))
    }

    fn visit_bool<E>(self, value: bool) -> Result<Content, E> {
        Ok(Content::Plain(value.into()))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Content, E> {
        Ok(Content::Plain(value.into()))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Content, E> {
        Ok(Content::Plain(value.into()))
    }

    fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<Content, E> {
        let number = serde_json::Number::from_f64(value).map(Value::Number);
        number
            .map(Content::Plain)
            .ok_or_else(|| E::custom(format!("found the number {value}, expected a finite number")))
    }

    fn visit_str<E>(self, value: &str) -> Result<Content, E> {
        Ok(Content::Plain(value.into()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Content, A::Error> {
        let mut nodes = Vec::new();
        while let Some(node) = list.next_element()? {
            nodes.push(node);
        }
        Ok(Content::List(nodes))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Content, A::Error> {
        let mut fields = Vec::new();
        while let Some(entry) = map.next_entry()? {
            fields.push(entry);
        }
        Ok(Content::Fields(fields))
    }
}
