//! The interface to programs that speak the protocol.

use serde::Serialize;

use super::protocol::{Ask, Hello, Reply};

/// A connection to a program that speaks the protocol.
pub trait Link: Send {
    /// Asks the port for its name and claims.
    ///
    /// # Errors
    /// If the answer is missing or cannot be parsed.
    fn hello(&mut self) -> Result<Hello, Misbehaviour>;

    /// Sends a question and returns the answer.
    ///
    /// # Errors
    /// If the answer is missing or cannot be parsed.
    fn ask(&mut self, ask: &Ask) -> Result<Reply, Misbehaviour>;
}

/// A violation of the protocol, after which the rules cannot be checked.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Misbehaviour {
    /// A one-line description.
    pub what: String,
    /// The end of the port's stderr.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub stderr: String,
}

impl Misbehaviour {
    /// Creates a misbehaviour without stderr.
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
