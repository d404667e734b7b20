//! Names of values that differ.

use serde::{Serialize, Serializer};

/// A value that differs between two answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// The name of the value or list, such as `cell`.
    pub name: &'static str,
    /// The part that differs.
    pub part: FieldPart,
}

/// The part of a value or list that differs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldPart {
    /// The value as a whole.
    Whole,
    /// The length of the list.
    Length,
    /// One element of the list.
    Element(usize),
    /// The window of one agent.
    Window {
        /// The agent.
        agent: usize,
        /// The row-major index of the first value that differs; none for a hash, which has no values.
        value: Option<usize>,
    },
}

impl Field {
    /// Returns the field without its index. A report groups the differences of one rule and kind.
    pub fn kind(&self) -> String {
        match self.part {
            FieldPart::Length => format!("number of {} entries", self.name),
            _ => self.name.into(),
        }
    }

    /// Returns the index of the agent or list element.
    pub fn index(&self) -> Option<usize> {
        match self.part {
            FieldPart::Element(index) | FieldPart::Window { agent: index, .. } => Some(index),
            FieldPart::Whole | FieldPart::Length => None,
        }
    }
}

impl std::fmt::Display for Field {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = self.name;
        match self.part {
            FieldPart::Whole | FieldPart::Length => f.write_str(&self.kind()),
            FieldPart::Element(index) => write!(f, "{name} {index}"),
            FieldPart::Window { agent, value: None } => write!(f, "{name} of agent {agent}"),
            FieldPart::Window { agent, value: Some(value) } => {
                write!(f, "{name} of agent {agent}, value {value} in row-major order")
            }
        }
    }
}

impl Serialize for Field {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
