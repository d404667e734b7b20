//! Hand-written cases: one rule each, small enough to be read.
//!
//! A case is a YAML file in the folder of its rule:
//!
//! ```yaml
//! rule: collide/priority/contest
//! says: Of two agents that want one free cell, the lower index gets it.
//! config: {map: "a.b\nB.A", collision_system: priority}
//! steps:
//!   - do: [right, left]
//!     picture: |
//!       .ab
//!       B.A
//! ```
//!
//! `config` is a POGEMA config. `start` says what holds after the reset, each step what holds after it; only what
//! is written is checked. `error` says what the last operation, or the config, is refused with.

mod draw;
mod expect;

use std::path::{Path, PathBuf};

use pogema_core::{Error, Map};
use serde::Deserialize;
use serde_json::Value;

use crate::request::{Op, Record, Registered, Request, Response};

pub use expect::{Expect, Sees};

/// One hand-written case.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// The rule that it shows.
    pub rule: String,
    /// What happens, in a sentence.
    pub says: String,
    /// A POGEMA config.
    pub config: Value,
    /// A map to register first.
    pub register: Option<Registered>,
    /// Whether to measure the density of agents.
    #[serde(default)]
    pub density: bool,
    /// Whether to count collisions.
    #[serde(default)]
    pub collisions: bool,
    /// What holds after the reset.
    #[serde(default)]
    pub start: Expect,
    /// What is done then.
    #[serde(default)]
    pub steps: Vec<CaseStep>,
    /// A part of the error that the config, the reset or the last step gives.
    pub error: Option<String>,
    /// Where POGEMA 1.4.0 does something else, by decision: what it does.
    pub pogema: Option<String>,
}

/// One operation and what holds after it.
#[derive(Clone, Debug, Deserialize)]
pub struct CaseStep {
    /// A step with these actions.
    #[serde(rename = "do")]
    actions: Option<Vec<ActionWord>>,
    /// Any other operation: `reset`, `back`, `astar`, `sample` or `history`.
    op: Option<String>,
    /// What holds then.
    #[serde(flatten)]
    expect: Expect,
}

/// An action by name or number.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
enum ActionWord {
    Number(i64),
    Word(String),
}

impl ActionWord {
    fn number(&self) -> Result<i64, Error> {
        const WORDS: [&str; 5] = ["stay", "up", "down", "left", "right"];
        match self {
            Self::Number(number) => Ok(*number),
            Self::Word(word) => {
                WORDS.iter().position(|known| known == word).map(|at| at as i64).ok_or_else(|| {
                    Error::config("do", word, format!("a number or one of {}", WORDS.join(", ")))
                })
            }
        }
    }
}

/// The cases that come with this crate.
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("cases")
}

/// Reads one case.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read or is no case.
pub fn read(path: &Path) -> Result<Case, Error> {
    let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, error))?;
    serde_saphyr::from_str(&text).map_err(|error| {
        let text = error.to_string();
        Error::io(path, text.lines().next().unwrap_or("unreadable"))
    })
}

impl Case {
    /// What to ask of an implementation.
    ///
    /// # Errors
    /// For a step that names no action or operation.
    pub fn request(&self) -> Result<Request, Error> {
        let mut ops = vec![Op::Reset(None)];
        for step in &self.steps {
            ops.push(step.op()?);
        }
        Ok(Request {
            id: 0,
            config: self.config.clone(),
            register: self.register.clone(),
            density: self.density,
            collisions: self.collisions,
            ops,
        })
    }

    /// Whether POGEMA can be asked: it does not know our own fields.
    pub fn is_for_pogema(&self) -> bool {
        !self.collisions
            && !["occupancy", "reward", "limits"].iter().any(|field| self.config.get(field).is_some())
    }

    /// The first thing in an answer that is not as the case says, in words.
    pub fn mismatch(&self, response: &Response) -> Option<String> {
        if let Some(wanted) = &self.error {
            return match &response.error {
                Some(error) if error.message.contains(wanted.as_str()) => None,
                Some(error) => Some(format!("expected the error `{wanted}`, got `{}`", error.message)),
                None => Some(format!("expected the error `{wanted}`, got none")),
            };
        }
        if let Some(error) = &response.error {
            return Some(format!("unexpected error: {}", error.message));
        }
        let mut map: Option<Map> = None;
        for (op, (record, expect)) in response.records.iter().zip(self.expectations()).enumerate() {
            if let Record::Reset(reset) = record {
                map = Map::from_rows(&reset.map).ok();
            }
            if let Some(map) = &map
                && let Some(mismatch) = expect.mismatch(record, map)
            {
                return Some(format!("after operation {op}: {mismatch}"));
            }
        }
        None
    }

    /// Whether the case says anything that could fail.
    pub fn checks_something(&self) -> bool {
        self.error.is_some() || self.expectations().any(|expect| !expect.is_empty())
    }

    /// What holds after each operation.
    fn expectations(&self) -> impl Iterator<Item = &Expect> {
        std::iter::once(&self.start).chain(self.steps.iter().map(|step| &step.expect))
    }
}

impl CaseStep {
    fn op(&self) -> Result<Op, Error> {
        match (&self.actions, self.op.as_deref()) {
            (Some(actions), None) => {
                actions.iter().map(ActionWord::number).collect::<Result<_, _>>().map(Op::Step)
            }
            (actions, word) => {
                let op = word.filter(|_| actions.is_none()).and_then(Op::of_word);
                let word = word.unwrap_or("absent");
                op.ok_or_else(|| Error::config("op", word, "a known operation, or `do`"))
            }
        }
    }
}
