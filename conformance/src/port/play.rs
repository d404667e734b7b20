//! A port's answer to a complete request, in the form of a [`Response`].

use pogema_core::{Error, Metrics, Padded, TraceStep};
use pogema_maps::{GridConfig, InstanceSource};
use serde_json::json;

use super::claims::Mode;
use super::link::{Link, Misbehaviour};
use super::protocol::{Ask, Beginning, Hello, Policy, Profile};
use super::session::Port;
use crate::request::{
    Back, Derived, Failure, Op, Record, Request, ResetRecord, Response, StepRecord, When, actions_of,
    numbers, padded_dtype,
};

/// The answers of a port, and its misbehaviour, if any.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answered {
    /// The answers, up to the first refusal or misbehaviour.
    pub response: Response,
    /// The misbehaviour that ended the answers.
    pub fault: Option<Misbehaviour>,
    /// The first operation whose observations could not be read, and the reason.
    pub misshapen: Option<(usize, String)>,
}

/// Plays a request on a port.
///
/// `expected` is the right answer. A port that does not claim policies receives the actions of `expected`.
pub fn play_on_port(
    link: &mut dyn Link,
    hello: &Hello,
    mode: Mode,
    request: &Request,
    expected: &Response,
) -> Answered {
    let mut answered = Answered { response: Response::to(request), fault: None, misshapen: None };
    match PortPlay::new(link, hello, mode, request, expected) {
        Ok(mut play) => {
            answered.response.record(request, |index, op| {
                let performed = play.perform(index, op);
                let misshapen = || Some((index, play.port.misshapen()?.to_owned()));
                answered.misshapen = answered.misshapen.take().or_else(misshapen);
                performed
            });
            let op = Some(answered.response.records.len());
            answered.fault = play.port.fault().cloned().map(|fault| Misbehaviour { op, ..fault });
        }
        Err(Unplayable::Config(link)) => send_invalid_config(link, request, &mut answered),
        Err(Unplayable::Instance(error)) => {
            answered.response.error = Some(Failure::new(When::Phase("instance".into()), &error));
        }
    }
    answered
}

/// Sends an invalid config to a port. The port should answer with an error; no other key is required.
fn send_invalid_config(link: &mut dyn Link, request: &Request, answered: &mut Answered) {
    let beginning = Beginning {
        config: Some(request.config.clone()),
        register: request.register.clone(),
        ..Beginning::default()
    };
    match link.ask(&Ask::Reset(Box::new(beginning))) {
        Ok(reply) => {
            let failed = |reason| Failure::new(When::Phase("config".into()), &Error::Port { reason });
            answered.response.error = reply.error.map(failed);
        }
        Err(fault) => answered.fault = Some(Misbehaviour { op: Some(0), ..fault }),
    }
}

enum Unplayable<'l> {
    Config(&'l mut dyn Link),
    Instance(Error),
}

/// A constructor of the record of a step.
type Kind = fn(Box<StepRecord>) -> Record;

/// The state of a request that is being played on a port.
struct PortPlay<'l> {
    port: Port<'l>,
    config: GridConfig,
    /// The source of instances; `None` if the port draws them from the config.
    source: Option<InstanceSource>,
    request: &'l Request,
    expected: &'l Response,
    plays_astar: bool,
    /// Whether the port draws the actions that POGEMA samples; their seed comes from a config.
    plays_samples: bool,
    has_begun: bool,
}

impl<'l> PortPlay<'l> {
    fn new(
        link: &'l mut dyn Link,
        hello: &'l Hello,
        mode: Mode,
        request: &'l Request,
        expected: &'l Response,
    ) -> Result<Self, Unplayable<'l>> {
        let Ok(config) = GridConfig::from_value(&request.config) else {
            return Err(Unplayable::Config(link));
        };
        let source = (mode == Mode::Instance).then(|| request.source(&config)).transpose();
        let source = source.map_err(Unplayable::Instance)?;
        let mut port = Port::new(link, hello, config.rules());
        port.set_padded_dtype(padded_dtype(&config));
        let plays_astar = hello.profiles.contains(&Profile::Policies);
        let plays_samples = plays_astar && mode == Mode::Config;
        Ok(Self { port, config, source, request, expected, plays_astar, plays_samples, has_begun: false })
    }

    fn perform(&mut self, index: usize, op: &Op) -> Result<Record, Error> {
        match op {
            Op::Reset(seed) => self.reset(index, *seed).map(|record| Record::Reset(Box::new(record))),
            Op::Step(actions) => self.step(&Ask::Step { actions: actions.clone() }, Record::Step),
            Op::Astar => self.act(Policy::Astar, index, Record::Astar),
            Op::Sample => self.act(Policy::Sample, index, Record::Sample),
            Op::Back => {
                let moved = self.port.step_back()?;
                Ok(Record::Back(Back { moved, state: self.port.snapshot() }))
            }
            Op::History => self.port.history().map(Record::History),
        }
    }

    fn reset(&mut self, index: usize, seed: Option<u64>) -> Result<ResetRecord, Error> {
        let beginning = self.beginning(index, seed)?;
        self.port.begin(beginning)?;
        self.has_begun = true;
        let reply = self.port.reply();
        let padded = Padded {
            dtype: padded_dtype(&self.config).into(),
            rows: reply.padded.clone().unwrap_or_default(),
        };
        Ok(ResetRecord {
            derived: reply.derived.clone().unwrap_or_else(|| Derived::of(&self.config)),
            map: reply.map.clone().unwrap_or_default(),
            padded,
            goal_lists: self.port.foretold()?,
            goal_lists_error: None,
            state: self.port.snapshot(),
            observations: self.port.observed().cloned(),
        })
    }

    fn beginning(&mut self, index: usize, seed: Option<u64>) -> Result<Beginning, Error> {
        let mut measure = Vec::new();
        if self.request.density {
            measure.push("avg_agents_density".to_owned());
        }
        if self.request.collisions {
            measure.extend(["a_collisions".to_owned(), "o_collisions".to_owned()]);
        }
        if let Some(source) = &mut self.source {
            let ops = &self.request.ops[index + 1..];
            self.port.set_num_goals(ops.iter().take_while(|op| !matches!(op, Op::Reset(_))).count() + 2);
            let generated = source.generate()?;
            let instance = Some(self.port.header(&generated.instance));
            return Ok(Beginning { instance, measure, ..Beginning::default() });
        }
        if self.has_begun {
            return Ok(Beginning { seed, ..Beginning::default() });
        }
        let (config, register) = (Some(self.request.config.clone()), self.request.register.clone());
        Ok(Beginning { config, register, seed, measure, instance: None })
    }

    fn act(&mut self, policy: Policy, index: usize, kind: Kind) -> Result<Record, Error> {
        let plays = match policy {
            Policy::Astar => self.plays_astar,
            Policy::Sample => self.plays_samples,
        };
        if plays {
            return self.step(&Ask::Act { policy }, kind);
        }
        let chosen = self.expected.records.get(index).and_then(Record::step);
        let missing =
            || Error::Port { reason: "the expected answer has no actions for this operation".into() };
        let actions = numbers(&chosen.ok_or_else(missing)?.step.actions);
        self.step(&Ask::Step { actions }, kind)
    }

    fn step(&mut self, ask: &Ask, kind: Kind) -> Result<Record, Error> {
        self.port.advance(ask)?;
        let state = self.port.snapshot();
        let reply = self.port.reply().clone();
        let numbers = match ask {
            Ask::Step { actions } => actions.clone(),
            _ => reply.actions.unwrap_or_default(),
        };
        // The port played a number that is not an action, so no `StepRecord` can represent the step.
        let Ok(actions) = actions_of(&numbers) else { return Ok(Record::Odd(json!({ "played": numbers }))) };
        let step = TraceStep {
            actions,
            rewards: reply.rewards.unwrap_or_default(),
            terminated: reply.terminated.unwrap_or_default(),
            truncated: reply.truncated.unwrap_or_default(),
            observations: self.port.observed().cloned(),
            metrics: reply.metrics.given().filter(|metrics| *metrics != Metrics::default()),
            state,
        };
        let infos_active = step.state.active.clone();
        let actions_after = reply.actions_after.unwrap_or_default();
        Ok(kind(Box::new(StepRecord { step, actions_after, infos_active })))
    }
}
