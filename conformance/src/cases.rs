//! Hand-written cases: small, readable examples of one rule each.
//!
//! A case is a YAML file whose path begins with the name of its rule:
//!
//! ```yaml
//! rule: collide/priority/contest
//! says: If two agents move to one free cell, the lower index gets it.
//! config: {map: "a.b\nB.A", collision_system: priority}
//! steps:
//!   - do: [right, left]
//!     picture: |
//!       .ab
//!       B.A
//! ```
//!
//! `config` is a POGEMA config. `start` lists the expectations after the reset. Each step lists the expectations after
//! this step. Keys that are left out are not checked. `error` is a part of the message that rejects the config or the
//! last operation. `seed` is the argument of the first reset or, in a step, of `op: reset`.

mod draw;
mod expect;

use std::io::Read as _;
use std::path::{Path, PathBuf};

use pogema_core::{Error, Map};
use serde::Deserialize;
use serde_json::Value;

use crate::data;
use crate::files;
use crate::request::{Op, Record, Registered, Request, Response};

pub use expect::{Expect, Sees};

/// One hand-written case.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// The rule it tests.
    pub rule: String,
    /// One sentence on what happens.
    pub says: String,
    /// A POGEMA config.
    pub config: Value,
    /// A map to register before the config is read.
    pub register: Option<Registered>,
    /// The argument `seed` of the first reset.
    pub seed: Option<u64>,
    /// Whether to measure the density of agents.
    #[serde(default)]
    pub density: bool,
    /// Whether to count collisions.
    #[serde(default)]
    pub collisions: bool,
    /// Expectations after the reset.
    #[serde(default)]
    pub start: Expect,
    /// The operations after the reset.
    #[serde(default)]
    pub steps: Vec<CaseStep>,
    /// A part of the expected error of the config, the reset or the last step.
    pub error: Option<String>,
    /// What POGEMA 1.4.0 does instead, if this project deviates from it by decision.
    pub pogema: Option<String>,
}

/// One operation and the expectations after it.
#[derive(Clone, Debug, Deserialize)]
pub struct CaseStep {
    /// The actions, if the operation is a step.
    #[serde(rename = "do")]
    actions: Option<Vec<ActionWord>>,
    /// Any other operation: `reset`, `back`, `astar`, `sample` or `history`.
    op: Option<String>,
    /// The argument `seed` of a reset.
    seed: Option<u64>,
    /// Expectations after the operation.
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

/// Returns the folder of the cases: in this crate or, in a release, next to the program.
pub fn folder() -> PathBuf {
    data::folder("cases")
}

/// Reads one case.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read or is not a case, or if a step has an unknown action or operation.
pub fn read(path: &Path) -> Result<Case, Error> {
    let mut text = String::new();
    files::open(path)?.read_to_string(&mut text).map_err(|error| Error::io(path, error))?;
    let case: Case = serde_saphyr::from_str(&text).map_err(|error| {
        let text = error.to_string();
        Error::io(path, text.lines().next().unwrap_or("unreadable"))
    })?;
    case.request().map_err(|error| Error::io(path, error))?;
    Ok(case)
}

impl Case {
    /// Returns the request that plays the case.
    ///
    /// # Errors
    /// If a step has an unknown action or operation.
    pub fn request(&self) -> Result<Request, Error> {
        let mut ops = vec![Op::Reset(self.seed)];
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

    /// Returns whether POGEMA can play the case. POGEMA counts no collisions and lacks the fields that this project
    /// adds.
    pub fn is_for_pogema(&self) -> bool {
        !self.collisions
            && !["occupancy", "reward", "limits"].iter().any(|field| self.config.get(field).is_some())
    }

    /// Describes the first deviation of an answer from the case.
    pub fn mismatch(&self, response: &Response) -> Option<String> {
        if let (None, Some(error)) = (&self.error, &response.error) {
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
        let expected = self.error.as_ref()?;
        let (num_done, num_steps) = (response.records.len(), self.steps.len());
        // The config or the first reset is rejected before anything is recorded.
        if response.error.is_some() && num_done != 0 && num_done != num_steps {
            return Some(format!("expected the error in the last step, got it in operation {num_done}"));
        }
        if num_done > 0 && self.steps.last().is_some_and(|step| !step.expect.is_empty()) {
            return Some("the last step has an expectation in addition to its error".into());
        }
        match &response.error {
            Some(error) if error.message.contains(expected.as_str()) => None,
            Some(error) => Some(format!("expected the error `{expected}`, got `{}`", error.message)),
            None => Some(format!("expected the error `{expected}`, got none")),
        }
    }

    /// Returns whether the case has any expectation.
    pub fn checks_something(&self) -> bool {
        self.error.is_some() || self.expectations().any(|expect| !expect.is_empty())
    }

    /// Returns the expectations after each operation.
    fn expectations(&self) -> impl Iterator<Item = &Expect> {
        std::iter::once(&self.start).chain(self.steps.iter().map(|step| &step.expect))
    }
}

impl CaseStep {
    fn op(&self) -> Result<Op, Error> {
        match (&self.actions, self.op.as_deref()) {
            (Some(_), Some(word)) => Err(Error::config("op", word, "no `op`, because the step has `do`")),
            (None, Some("reset")) => Ok(Op::Reset(self.seed)),
            _ if self.seed.is_some() => Err(Error::config(
                "seed",
                self.seed.unwrap_or_default(),
                "no seed, because only `op: reset` takes one",
            )),
            (Some(actions), None) => {
                actions.iter().map(ActionWord::number).collect::<Result<_, _>>().map(Op::Step)
            }
            (None, word) => word.and_then(Op::of_word).ok_or_else(|| {
                let word = word.unwrap_or("absent");
                Error::config("op", word, "either `do` or one of reset, back, astar, sample, history")
            }),
        }
    }
}
