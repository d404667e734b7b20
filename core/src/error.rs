//! The error type of the workspace.

use std::sync::Arc;

use crate::printable::one_line;

/// Any error of the workspace, with a message of one line.
///
/// A call that fails leaves the state unchanged, unless its documentation says otherwise. Control characters in the
/// input are escaped, so the message always stays on one line. Lines and columns count from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the fields are named as in the messages")]
pub enum Error {
    /// A config field has a wrong value. `field` is its name in the config.
    #[error("{}", one_line(format_args!("config: {}", wrong_field(field, value, expected))))]
    Config { field: String, value: String, expected: String },
    /// An argument of a call or a flag of the program has a wrong value. The name of a flag includes its hyphens.
    #[error("{}", one_line(wrong_field(name, value, expected)))]
    Argument { name: String, value: String, expected: String },
    /// A config field names a cell outside the map.
    #[error("{}", one_line(format_args!("config: {}", cell_outside(field, cell, *height, *width))))]
    CellOutside { field: String, cell: String, height: usize, width: usize },
    /// A config cannot be parsed. The reason is the message of the parser, with line and column.
    #[error("{}", one_line(format_args!("config: {reason}")))]
    Syntax { reason: String },
    /// A map text is wrong.
    #[error("{}", one_line(format_args!("map: line {line}, column {column}: {reason}")))]
    Map { line: usize, column: usize, reason: String },
    /// A map text contains a character that has no meaning.
    #[error("{}", one_line(format_args!("map: line {line}, column {column}: {}", unknown_character(*character))))]
    UnknownCharacter { line: usize, column: usize, character: char },
    /// The instance as a whole cannot be played.
    #[error("{}", one_line(format_args!("instance: {reason}")))]
    Instance { reason: String },
    /// One agent of an instance is invalid; `agent` is its index.
    #[error("{}", one_line(format_args!("instance: agent {agent}: {reason}")))]
    Agent { agent: usize, reason: String },
    /// A number is not an action. The agent is given if it is known.
    #[error("action{} is `{number}`, expected {}", of_agent(*.agent), Error::ACTIONS)]
    Action { agent: Option<usize>, number: i64 },
    /// A list or buffer has the wrong length.
    #[error("{what} has length {got}, expected {want}")]
    Length { what: &'static str, want: usize, got: usize },
    /// A call requires an episode, but the environment has not been reset.
    #[error("the environment has not been reset yet; call `reset` first")]
    NotReset,
    /// A call undoes a step, but the config keeps no steps.
    ///
    /// Rule: history/step-back
    #[error("steps are kept only with `persistent: true`")]
    StepsNotKept,
    /// A call requires the trace of an episode that is not recorded.
    #[error("the episode is not recorded: request the recording before the reset")]
    NotRecorded,
    /// A saved state does not belong to the instance: a list has the wrong length, a cell lies outside the map, or two
    /// active agents are on one cell.
    #[error("the state does not fit the map and its agents")]
    ForeignState,
    /// A call requests something that does not exist, such as a frame after the end.
    #[error("{}", one_line(format_args!("{what} is `{value}`, expected {expected}")))]
    OutOfRange { what: String, value: String, expected: String },
    /// The saved goals belong to another episode.
    #[error("the saved goals belong to another episode")]
    ForeignGoals,
    /// The goals come from a source that cannot be saved, so the episode cannot be saved either.
    #[error("the goals come from a source that cannot be saved")]
    UnsavedGoals,
    /// A call requires the last ended episode of a lane, but no episode of the lane has ended.
    #[error("no episode of lane {lane} has ended yet")]
    NotEnded { lane: usize },
    /// Another thread is using an object. `what` names the object with its article.
    #[error("another thread is using {what}, expected one thread at a time")]
    Busy { what: &'static str },
    /// A policy received a state that is not the next one of its episode.
    #[error("{}", one_line(reason))]
    OutOfStep { reason: String },
    /// A plan breaks a rule or does not follow its text format. The reason names the line if there is one.
    #[error("{}", one_line(reason))]
    Plan { reason: String },
    /// A request contradicts itself or has no input. The reason names flags and keys, and what is accepted.
    #[error("{}", one_line(reason))]
    Request { reason: String },
    /// A port refused a request or gave an answer that does not fit it. The reason is what the port answered or did.
    #[error("{}", one_line(reason))]
    Port { reason: String },
    /// Data from another source is wrong.
    #[error("{}", one_line(format_args!("{what}: {reason}")))]
    Corrupt { what: String, reason: String },
    /// The caller cancelled the work.
    #[error("the work was cancelled")]
    Cancelled,
    /// The system does not provide the memory. The number of bytes is unknown if it cannot be counted.
    #[error("{}", one_line(format_args!("not enough memory: {what} needs {}", number_of_bytes(*bytes))))]
    Memory { what: String, bytes: Option<usize> },
    /// The operating system or a library failed.
    #[error("{}", one_line(format_args!("{what}: {cause}")))]
    External {
        what: String,
        #[source]
        cause: Cause,
    },
    /// A file could not be read or written, or its content is wrong.
    #[error("{}", one_line(format_args!("{path}: {cause}")))]
    Io {
        path: String,
        #[source]
        cause: Cause,
    },
    /// A trace cannot be read.
    #[error("{}", one_line(format_args!("trace: line {line}: {reason}")))]
    Trace { line: usize, reason: String },
}

fn number_of_bytes(bytes: Option<usize>) -> String {
    bytes.map_or("more bytes than can be counted".into(), |bytes| counted(bytes, "byte"))
}

/// Any error, or a text.
pub type BoxedError = Box<dyn std::error::Error + Send + Sync>;

/// The cause of an error. Two causes are equal if their texts are equal.
#[derive(Clone)]
pub struct Cause(Arc<dyn std::error::Error + Send + Sync>);

impl Cause {
    /// Creates a cause from any error, or from a text.
    pub fn new(cause: impl Into<BoxedError>) -> Self {
        Self(cause.into().into())
    }

    /// Returns the error, for example to downcast it.
    pub fn get(&self) -> &(dyn std::error::Error + Send + Sync + 'static) {
        &*self.0
    }
}

impl std::fmt::Display for Cause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl std::fmt::Debug for Cause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl PartialEq for Cause {
    fn eq(&self, other: &Self) -> bool {
        self.to_string() == other.to_string()
    }
}

impl std::error::Error for Cause {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.0.source()
    }
}

fn of_agent(agent: Option<usize>) -> String {
    agent.map(|index| format!(" of agent {index}")).unwrap_or_default()
}

/// Returns a number with its noun for a message, such as `1 start` or `2 starts`.
pub fn counted(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

/// Returns a list for a message, such as `a, b and c`.
pub fn listed<T: AsRef<str>>(words: &[T]) -> String {
    let words: Vec<&str> = words.iter().map(AsRef::as_ref).collect();
    match words.as_slice() {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Returns the size of a map for a message, such as `1 row and 3 columns`.
pub fn rows_and_columns(rows: usize, columns: usize) -> String {
    format!("{} and {}", counted(rows, "row"), counted(columns, "column"))
}

fn wrong_field(field: &str, value: &str, expected: &str) -> String {
    format!("`{field}` is `{value}`, expected {expected}")
}

fn cell_outside(field: &str, cell: &str, height: usize, width: usize) -> String {
    let size = rows_and_columns(height, width);
    format!("`{field}` is `{cell}`, expected cells inside the map of {size}")
}

impl Error {
    /// The numbers of all actions, for a message that says what was expected.
    pub const ACTIONS: &str = "0 (stay), 1 (up), 2 (down), 3 (left) or 4 (right)";

    /// Longest part of an input value that a message quotes. Units: characters.
    pub const LONGEST_QUOTE: usize = 60;

    /// Creates an error about one config field.
    pub fn config(field: &str, value: impl std::fmt::Display, expected: impl Into<String>) -> Self {
        let value = shorten(&value.to_string(), Self::LONGEST_QUOTE);
        Self::Config { field: field.into(), value, expected: expected.into() }
    }

    /// Creates an error about one argument of a call, or one flag of the program.
    pub fn argument(name: &str, value: impl std::fmt::Display, expected: impl Into<String>) -> Self {
        let value = shorten(&value.to_string(), Self::LONGEST_QUOTE);
        Self::Argument { name: name.into(), value, expected: expected.into() }
    }

    /// Creates an error about a requested value that does not exist.
    pub fn out_of_range(what: &str, value: impl std::fmt::Display, expected: impl Into<String>) -> Self {
        let value = shorten(&value.to_string(), Self::LONGEST_QUOTE);
        Self::OutOfRange { what: what.into(), value, expected: expected.into() }
    }

    /// Creates an error about a cell of a config field that lies outside the map.
    pub fn cell_outside(field: &str, cell: impl std::fmt::Display, (height, width): (usize, usize)) -> Self {
        Self::CellOutside { field: field.into(), cell: cell.to_string(), height, width }
    }

    /// Returns the name of the wrong config field, if the error is about one.
    pub fn field(&self) -> Option<&str> {
        match self {
            Self::Config { field, .. } | Self::CellOutside { field, .. } => Some(field),
            _ => None,
        }
    }

    /// Returns the message without the leading `config:`, for messages that already name the config.
    pub fn reason(&self) -> String {
        match self {
            Self::Config { field, value, expected } => one_line(wrong_field(field, value, expected)),
            Self::CellOutside { field, cell, height, width } => {
                one_line(cell_outside(field, cell, *height, *width))
            }
            Self::Syntax { reason } => one_line(reason),
            other => other.to_string(),
        }
    }

    /// Creates an error about an instance as a whole.
    pub fn instance(reason: impl Into<String>) -> Self {
        Self::Instance { reason: reason.into() }
    }

    /// Creates an error about one agent of an instance.
    pub fn agent(agent: usize, reason: impl Into<String>) -> Self {
        Self::Agent { agent, reason: reason.into() }
    }

    /// Creates an error about a cell that lies outside a map.
    pub fn outside(
        agent: usize,
        what: &str,
        cell: impl std::fmt::Display,
        height: usize,
        width: usize,
    ) -> Self {
        Self::agent(agent, format!("{what} {cell} is outside the map of {}", rows_and_columns(height, width)))
    }

    /// Creates an error about a file.
    pub fn io(path: impl AsRef<std::path::Path>, cause: impl Into<BoxedError>) -> Self {
        Self::Io { path: path.as_ref().display().to_string(), cause: Cause::new(cause) }
    }

    /// Creates an error about a failure of the operating system or of a library.
    pub fn external(what: impl Into<String>, cause: impl Into<BoxedError>) -> Self {
        Self::External { what: what.into(), cause: Cause::new(cause) }
    }

    /// Creates an error about a request.
    pub fn request(reason: impl Into<String>) -> Self {
        Self::Request { reason: reason.into() }
    }

    /// Checks the length of a list or buffer.
    ///
    /// # Errors
    /// [`Error::Length`] if the two lengths differ.
    pub fn check_length(what: &'static str, want: usize, got: usize) -> Result<(), Self> {
        if want == got { Ok(()) } else { Err(Self::Length { what, want, got }) }
    }
}

/// Returns the message about a character that has no meaning in a map text.
pub fn unknown_character(character: char) -> String {
    format!("unknown character `{character}`, expected one of `.#@$!`, a-z or A-Z")
}

/// Returns the first `longest` characters of a text, for a message that quotes it; `…` marks a longer text.
pub fn shorten(text: &str, longest: usize) -> String {
    match text.char_indices().nth(longest) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}
