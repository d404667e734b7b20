//! Whoever answers the questions of the protocol.

use serde::Serialize;

use super::protocol::{Ask, Hello, Reply};

/// Somebody who speaks the protocol.
pub trait Link: Send {
    /// Who is it, and what does it claim?
    ///
    /// # Errors
    /// If it gives no answer, or none that can be understood.
    fn hello(&mut self) -> Result<Hello, Misbehaviour>;

    /// The answer to a question.
    ///
    /// # Errors
    /// If it gives no answer, or none that can be understood.
    fn ask(&mut self, ask: &Ask) -> Result<Reply, Misbehaviour>;
}

/// A port did not keep to the protocol, so that nothing can be said of its rules.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Misbehaviour {
    /// What was seen, in a line.
    pub what: String,
    /// The end of what it wrote to stderr.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub stderr: String,
}

impl Misbehaviour {
    /// Something seen in an answer.
    pub fn new(what: impl Into<String>) -> Self {
        Self { what: what.into(), stderr: String::new() }
    }
}

impl std::error::Error for Misbehaviour {}

impl std::fmt::Display for Misbehaviour {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.what)?;
        for line in self.stderr.lines() {
            write!(f, "\n  stderr: {line}")?;
        }
        Ok(())
    }
}
