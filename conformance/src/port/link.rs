//! The interface to programs that speak the protocol.

use std::fmt;

use serde::{Serialize, Serializer};

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

    /// Shortens the time limit of all further answers, because this port has already exceeded it [default: does
    /// nothing].
    fn hurry(&mut self) {}
}

/// A violation of the protocol, after which the rules cannot be checked.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Misbehaviour {
    /// The kind. Misbehaviours of one kind are one entry of a report.
    pub kind: FaultKind,
    /// A one-line description: the kind and its details.
    pub what: String,
    /// The index of the operation during which it occurred; none at the start and during `hello`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub op: Option<usize>,
    /// The end of the port's stderr.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub stderr: String,
}

/// The kind of a misbehaviour. [`Misbehaviour::what`] adds the details of one occurrence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// The program cannot be started.
    NotStarted {
        /// The program.
        program: String,
    },
    /// The port ended before it answered.
    Ended {
        /// The exit status or signal.
        status: String,
        /// The type of the question.
        question: &'static str,
    },
    /// The port closed its output before it answered.
    ClosedOutput {
        /// The type of the question.
        question: &'static str,
    },
    /// The port did not answer in time.
    NoAnswer {
        /// The type of the question.
        question: &'static str,
        /// The time limit. Units: milliseconds.
        limit_ms: u128,
    },
    /// The answer does not have the protocol's form.
    Unreadable {
        /// The type of the question.
        question: &'static str,
    },
    /// The answer is too long.
    TooLong {
        /// The type of the question.
        question: &'static str,
        /// The maximum length. Units: bytes.
        limit: usize,
    },
    /// The port wrote a line that no question asked for.
    Unrequested,
    /// The port speaks another protocol.
    OtherProtocol {
        /// The name of that protocol.
        protocol: String,
        /// The name of the runner's protocol.
        expected: &'static str,
    },
    /// An answer lacks a required key.
    LeftOut {
        /// The key.
        key: &'static str,
    },
    /// A list does not have one entry per agent.
    WrongLength {
        /// The key of the list.
        key: &'static str,
    },
    /// Any other kind, for example one of an implementation of [`Link`] outside this crate.
    Other(String),
}

impl fmt::Display for FaultKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotStarted { program } => write!(f, "`{program}` cannot be started"),
            Self::Ended { status, question } => {
                write!(f, "ended ({status}) instead of answering `{question}`")
            }
            Self::ClosedOutput { question } => {
                write!(f, "closed its output instead of answering `{question}`")
            }
            Self::NoAnswer { question, limit_ms } => {
                write!(f, "gave no answer to `{question}` within {} s", *limit_ms as f64 / 1000.0)
            }
            Self::Unreadable { question } => write!(f, "gave no readable answer to `{question}`"),
            Self::TooLong { question, limit } => {
                write!(f, "answered `{question}` with a line of more than {limit} bytes")
            }
            Self::Unrequested => f.write_str("wrote an unrequested line"),
            Self::OtherProtocol { protocol, expected } => {
                write!(f, "speaks `{protocol}`, expected `{expected}`")
            }
            Self::LeftOut { key } => write!(f, "left `{key}` out of an answer that needs it"),
            Self::WrongLength { key } => write!(f, "did not give `{key}` one entry per agent"),
            Self::Other(what) => f.write_str(what),
        }
    }
}

impl Serialize for FaultKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl Misbehaviour {
    /// Creates a misbehaviour without stderr. `details` follow the description of the kind and may be empty.
    pub fn new(kind: FaultKind, details: &str) -> Self {
        Self { what: format!("{kind}{details}"), kind, op: None, stderr: String::new() }
    }

    /// Returns whether the port did not answer in time. Each repetition of such a misbehaviour costs the time limit.
    pub fn is_hang(&self) -> bool {
        matches!(self.kind, FaultKind::NoAnswer { .. })
    }

    /// Returns whether another misbehaviour is of the same kind, regardless of the time limit.
    pub fn is_like(&self, other: &Self) -> bool {
        match (&self.kind, &other.kind) {
            (FaultKind::NoAnswer { question: one, .. }, FaultKind::NoAnswer { question: other, .. }) => {
                one == other
            }
            (one, other) => one == other,
        }
    }
}

impl std::error::Error for Misbehaviour {}

impl fmt::Display for Misbehaviour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.what)?;
        for line in self.stderr.lines() {
            write!(f, "\n  stderr: {line}")?;
        }
        Ok(())
    }
}
