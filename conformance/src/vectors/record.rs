//! Conversations with the reference.

use std::collections::BTreeMap;

use pogema_core::Error;
use serde::Serialize;

use super::{Needs, Vector};
use crate::cases::{self, Case};
use crate::golden;
use crate::play::{NamedEngine, play};
use crate::port::{
    Ask, Hello, Judged, Key, Link, Misbehaviour, Mode, Profile, Reply, Server, judge, profile_of,
};
use crate::request::{Op, Request, Response};

/// A question and the answer of the reference.
#[derive(Clone, Debug, Serialize)]
pub struct Exchange {
    question: Ask,
    answer: Reply,
}

/// The reference as a port that records the conversation.
struct Recorder {
    server: Server,
    mode: Mode,
    exchanges: Vec<Exchange>,
}

impl Link for Recorder {
    fn hello(&mut self) -> Result<Hello, Misbehaviour> {
        self.server.hello()
    }

    fn ask(&mut self, ask: &Ask) -> Result<Reply, Misbehaviour> {
        let answer = self.server.ask(ask)?;
        let compared = compared(self.mode, ask, answer.clone());
        self.exchanges.push(Exchange { question: ask.clone(), answer: compared });
        Ok(answer)
    }
}

/// Returns an answer without the keys that are not compared, because the question determines them.
fn compared(mode: Mode, ask: &Ask, mut answer: Reply) -> Reply {
    if matches!(ask, Ask::Step { .. }) {
        answer.actions = None;
    }
    if mode == Mode::Instance {
        answer.map = None;
        answer.derived = None;
        answer.foretold = Key::LeftOut;
    }
    answer
}

/// A recorded conversation, and what it compares.
pub struct Conversation {
    pub mode: Mode,
    pub judged: Judged,
    pub exchanges: Vec<Exchange>,
}

/// Plays a request on the reference in a mode.
///
/// # Errors
/// [`Error::Port`] if the answer of the reference differs from the expected one.
pub fn converse(
    name: &str,
    mode: Mode,
    request: &Request,
    expected: &Response,
) -> Result<Conversation, Error> {
    let mut recorder = Recorder { server: Server::new(NamedEngine::REFERENCE), mode, exchanges: Vec::new() };
    let wrong = |what: String| Error::Port { reason: format!("{name}: {what}") };
    let hello = recorder.hello().map_err(|fault| wrong(fault.what))?;
    let judged = judge(&mut recorder, &hello, mode, request, expected);
    match (&judged.fault, judged.divergences.first()) {
        (Some(fault), _) => Err(wrong(fault.what.clone())),
        (None, Some(found)) => Err(wrong(format!("the reference breaks {}", found.rule))),
        (None, None) => Ok(Conversation { mode, judged, exchanges: recorder.exchanges }),
    }
}

impl Conversation {
    /// Returns the vector that tests a rule with this conversation.
    pub fn vector(self, name: String, rule: &str, case: Option<&Case>, expected: &Response) -> Vector {
        Vector {
            name,
            says: case.map(|case| case.says.clone()),
            pogema: case.and_then(|case| case.pogema.clone()),
            needs: Needs::of(rule, self.mode, &self.judged.request, expected),
            exchanges: self.exchanges,
        }
    }
}

/// Returns the vectors of all cases by rule.
pub fn cases() -> Result<BTreeMap<String, Vec<Vector>>, Error> {
    let mut by_rule: BTreeMap<String, Vec<Vector>> = BTreeMap::new();
    let root = cases::folder();
    for path in golden::files(&root, ".yaml")? {
        let case = cases::read(&path)?;
        let name = path.strip_prefix(&root).unwrap_or(&path).with_extension("");
        let name = name.to_string_lossy().replace(std::path::MAIN_SEPARATOR, "/");
        let request = case.request()?;
        let expected = play(&request);
        let mut recorded = converse(&name, mode_of(&case.rule), &request, &expected)?;
        let steps_back = |request: &Request| request.ops.contains(&Op::Back);
        // An instance cannot express every case.
        if recorded.exchanges.is_empty() || steps_back(&request) != steps_back(&recorded.judged.request) {
            recorded = converse(&name, Mode::Config, &request, &expected)?;
        }
        let vector = recorded.vector(name, &case.rule, Some(&case), &expected);
        by_rule.entry(case.rule).or_default().push(vector);
    }
    Ok(by_rule)
}

/// Returns the mode in which a rule is tested: a config for rules of seeding and policies, otherwise an instance.
pub fn mode_of(rule: &str) -> Mode {
    match profile_of(rule) {
        Profile::Seeding | Profile::Policies => Mode::Config,
        _ => Mode::Instance,
    }
}
