//! The one error type of the workspace.

use std::sync::Arc;

/// Everything that can be wrong with input, each told in one line.
///
/// An error leaves the state that it came from as it was. Whatever the input holds, the text stays on one line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A config field holds what it may not hold.
    #[error("{}", one_line(format_args!("config: {}", wrong_field(field, value, expected))))]
    Config {
        /// The field, by the name the file gives it.
        field: String,
        /// The offending value.
        value: String,
        /// What would have been right.
        expected: String,
    },
    /// An argument of a call, or a flag of the program, holds what it may not hold.
    #[error("{}", one_line(wrong_field(name, value, expected)))]
    Argument {
        /// The argument, or the flag with its hyphens.
        name: String,
        /// The offending value.
        value: String,
        /// What is accepted.
        expected: String,
    },
    /// A config field names a cell outside the map.
    #[error(
        "{}",
        one_line(format_args!(
            "config: `{field}` is `{cell}`, expected cells inside the map of {height} rows and {width} columns"
        ))
    )]
    CellOutside {
        /// The field.
        field: String,
        /// The cell.
        cell: String,
        /// Rows of the map.
        height: usize,
        /// Columns of the map.
        width: usize,
    },
    /// A config could not be read at all.
    #[error("{}", one_line(format_args!("config: {reason}")))]
    Syntax {
        /// What the parser says, with its place.
        reason: String,
    },
    /// A map text is wrong.
    #[error("{}", one_line(format_args!("map: line {line}, column {column}: {reason}")))]
    Map {
        /// Line of the map, counted from 1.
        line: usize,
        /// Column of the map, counted from 1.
        column: usize,
        /// What is wrong there.
        reason: String,
    },
    /// A map text holds a character without a meaning.
    #[error("{}", one_line(format_args!("map: line {line}, column {column}: {}", unknown_letter(*letter))))]
    UnknownLetter {
        /// Line of the map, counted from 1.
        line: usize,
        /// Column of the map, counted from 1.
        column: usize,
        /// The character.
        letter: char,
    },
    /// The instance as a whole cannot be played.
    #[error("{}", one_line(format_args!("instance: {reason}")))]
    Instance {
        /// What is wrong.
        reason: String,
    },
    /// One agent of an instance cannot be played.
    #[error("{}", one_line(format_args!("instance: agent {agent}: {reason}")))]
    Agent {
        /// The agent's index.
        agent: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// A number that is no action.
    #[error("action{} is `{number}`, expected 0 (stay), 1 (up), 2 (down), 3 (left) or 4 (right)", of_agent(*.agent))]
    Action {
        /// The agent, where it is known.
        agent: Option<usize>,
        /// The number given.
        number: i64,
    },
    /// A list or buffer has the wrong length.
    #[error("{what} has length {got}, expected {want}")]
    Length {
        /// Which list or buffer.
        what: &'static str,
        /// The length that was needed.
        want: usize,
        /// The length that was given.
        got: usize,
    },
    /// A call that needs an episode, before the first reset.
    #[error("the environment was not reset yet")]
    NotReset,
    /// A step back where the config keeps no steps.
    ///
    /// Rule: history/step-back
    #[error("steps are only kept with persistent: true")]
    StepsNotKept,
    /// A trace of an episode that is not recorded.
    #[error("the episode is not recorded: ask for the recording before the reset")]
    NotRecorded,
    /// A saved state that does not belong to the instance: wrong lengths, a cell outside the map, or two active agents on
    /// one cell.
    #[error("the state does not fit the map and its agents")]
    ForeignState,
    /// A request for something that does not exist, such as a frame after the end.
    #[error("{}", one_line(format_args!("{what} is `{value}`, expected {expected}")))]
    OutOfRange {
        /// What was requested.
        what: String,
        /// The value given.
        value: String,
        /// The values that exist.
        expected: String,
    },
    /// Saved goals that belong to another episode.
    #[error("the saved goals belong to another episode")]
    ForeignGoals,
    /// A lane of a batch whose first episode has not ended.
    #[error("no episode of lane {lane} ended yet")]
    NotEnded {
        /// The lane.
        lane: usize,
    },
    /// An object that another thread is using.
    #[error("another thread is using {what}, expected one thread at a time")]
    Busy {
        /// The object, with its article.
        what: &'static str,
    },
    /// A policy that sees a state which is not the next one of its episode.
    #[error("{}", one_line(reason))]
    OutOfStep {
        /// What was expected.
        reason: String,
    },
    /// A plan that breaks a rule or does not fit its text format.
    #[error("{}", one_line(reason))]
    Plan {
        /// What is wrong, with the line where there is one.
        reason: String,
    },
    /// A request that contradicts itself or has nothing to work on; flags and keys stand in it by name.
    #[error("{}", one_line(reason))]
    Request {
        /// What is wrong, and what is accepted.
        reason: String,
    },
    /// An answer of a port that is no answer to its question, or a refusal.
    #[error("{}", one_line(reason))]
    Port {
        /// What the port said or did.
        reason: String,
    },
    /// Data from elsewhere that is not what it should be.
    #[error("{}", one_line(format_args!("{what}: {reason}")))]
    Corrupt {
        /// The data.
        what: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A failure of the operating system or of a library.
    #[error("{}", one_line(format_args!("{what}: {cause}")))]
    External {
        /// What failed.
        what: String,
        /// Why it failed.
        #[source]
        cause: Cause,
    },
    /// A file could not be read or written, or its content is wrong.
    #[error("{}", one_line(format_args!("{path}: {cause}")))]
    Io {
        /// The file.
        path: String,
        /// What the system says, or what is wrong with the content.
        #[source]
        cause: Cause,
    },
    /// A trace that cannot be read.
    #[error("{}", one_line(format_args!("trace: line {line}: {reason}")))]
    Trace {
        /// Line of the trace, counted from 1.
        line: usize,
        /// What is wrong there.
        reason: String,
    },
}

/// Any error, or a text.
pub type BoxedError = Box<dyn std::error::Error + Send + Sync>;

/// The error behind another one. Two are equal if their texts are.
#[derive(Clone)]
pub struct Cause(Arc<dyn std::error::Error + Send + Sync>);

impl Cause {
    /// Takes any error, or a text.
    pub fn new(cause: impl Into<BoxedError>) -> Self {
        Self(cause.into().into())
    }

    /// The error, to ask for its type.
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

fn wrong_field(field: &str, value: &str, expected: &str) -> String {
    format!("`{field}` is `{value}`, expected {expected}")
}

impl Error {
    /// So much of a value of the input is quoted. Units: characters.
    pub const LONGEST_QUOTE: usize = 60;

    /// An error about one config field.
    pub fn config(field: &str, value: impl std::fmt::Display, expected: impl Into<String>) -> Self {
        let value = shorten(&value.to_string(), Self::LONGEST_QUOTE);
        Self::Config { field: field.into(), value, expected: expected.into() }
    }

    /// An error about one argument of a call, or one flag of the program.
    pub fn argument(name: &str, value: impl std::fmt::Display, expected: impl Into<String>) -> Self {
        let value = shorten(&value.to_string(), Self::LONGEST_QUOTE);
        Self::Argument { name: name.into(), value, expected: expected.into() }
    }

    /// An error about a requested value that does not exist.
    pub fn out_of_range(what: &str, value: impl std::fmt::Display, expected: impl Into<String>) -> Self {
        let value = shorten(&value.to_string(), Self::LONGEST_QUOTE);
        Self::OutOfRange { what: what.into(), value, expected: expected.into() }
    }

    /// An error about a cell of a config field that lies outside the map.
    pub fn cell_outside(field: &str, cell: impl std::fmt::Display, (height, width): (usize, usize)) -> Self {
        Self::CellOutside { field: field.into(), cell: cell.to_string(), height, width }
    }

    /// The config field that is wrong, if it is one.
    pub fn field(&self) -> Option<&str> {
        match self {
            Self::Config { field, .. } | Self::CellOutside { field, .. } => Some(field),
            _ => None,
        }
    }

    /// Returns the text of a wrong config without the leading `config:`, for messages that name the config already.
    pub fn reason(&self) -> String {
        match self {
            Self::Config { field, value, expected } => one_line(wrong_field(field, value, expected)),
            Self::Syntax { reason } => one_line(reason),
            other => other.to_string(),
        }
    }

    /// An error about an instance as a whole.
    pub fn instance(reason: impl Into<String>) -> Self {
        Self::Instance { reason: reason.into() }
    }

    /// An error about one agent of an instance.
    pub fn agent(agent: usize, reason: impl Into<String>) -> Self {
        Self::Agent { agent, reason: reason.into() }
    }

    /// An error about a cell that lies outside a map.
    pub fn outside(
        agent: usize,
        what: &str,
        cell: impl std::fmt::Display,
        height: usize,
        width: usize,
    ) -> Self {
        Self::agent(agent, format!("{what} {cell} is outside the map of {height} rows and {width} columns"))
    }

    /// An error about a file.
    pub fn io(path: impl AsRef<std::path::Path>, cause: impl Into<BoxedError>) -> Self {
        Self::Io { path: path.as_ref().display().to_string(), cause: Cause::new(cause) }
    }

    /// A failure of the operating system or of a library.
    pub fn external(what: impl Into<String>, cause: impl Into<BoxedError>) -> Self {
        Self::External { what: what.into(), cause: Cause::new(cause) }
    }

    /// An error about a request.
    pub fn request(reason: impl Into<String>) -> Self {
        Self::Request { reason: reason.into() }
    }

    /// Passes if a list or buffer has the length it must have.
    pub fn check_length(what: &'static str, want: usize, got: usize) -> Result<(), Self> {
        if want == got { Ok(()) } else { Err(Self::Length { what, want, got }) }
    }
}

/// What is wrong with a character that has no meaning in a map text.
pub fn unknown_letter(letter: char) -> String {
    format!("unknown character `{letter}`, expected one of `.#@$!`, a-z or A-Z")
}

/// The beginning of a text, for a message that quotes it.
pub fn shorten(text: &str, longest: usize) -> String {
    match text.char_indices().nth(longest) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

/// A text with its control characters written out, so that quoted input can neither end the line nor move the
/// cursor.
fn one_line(text: impl std::fmt::Display) -> String {
    let is_unfit = |letter: char| letter.is_control() || matches!(letter, '\u{2028}' | '\u{2029}');
    let mut line = String::new();
    for letter in text.to_string().chars() {
        if is_unfit(letter) { line.extend(letter.escape_debug()) } else { line.push(letter) }
    }
    line
}
