//! Ports that answer as the reference does, except in one or two ways.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use pogema_conformance::NamedEngine;
use pogema_conformance::port::{Ask, FaultKind, Hello, Link, Misbehaviour, Profile, Reply, Server, Subject};

/// The way in which a port differs from the reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Behaviour {
    /// Refuses instances with a start on an obstacle.
    RefusesObstacles,
    /// Ends at every 97th question, and doubles rewards if there are at least two agents.
    CrashesAtTimesAndDoublesRewards,
    /// Ends if agents 0 and 1 move in one step.
    CrashesIfTwoMove,
    /// Leaves out `active` if agents 0 and 1 move in one step.
    ForgetsActiveIfTwoMove,
    /// Does not answer if agents 0 and 1 move in one step.
    HangsIfTwoMove,
    /// Never answers.
    IsMute,
    /// Doubles rewards if an agent started on an obstacle, or if an agent had finished before.
    DoublesRewardsInTwoCases,
    /// Doubles the rewards of the first hundred questions of all processes.
    DoublesRewardsAtFirst,
    /// Draws instances from configs, and doubles rewards after a reset with a seed.
    DoublesRewardsAfterSeeds,
}

/// Counts of the questions, the configs and the faults of all processes of a port.
#[derive(Clone, Debug, Default)]
pub struct Log(Arc<Counts>);

#[derive(Debug, Default)]
struct Counts {
    asked: AtomicUsize,
    configs: AtomicUsize,
    faults: AtomicUsize,
}

impl Log {
    pub fn num_configs(&self) -> usize {
        self.0.configs.load(Ordering::Relaxed)
    }

    pub fn num_faults(&self) -> usize {
        self.0.faults.load(Ordering::Relaxed)
    }
}

pub fn subject(behaviour: Behaviour, log: &Log) -> Subject<'static> {
    let log = log.clone();
    Subject {
        command: format!("{behaviour:?}"),
        replay: vec!["check".into()],
        start: Box::new(move || Ok(Box::new(Unreliable::new(behaviour, log.clone())) as Box<dyn Link>)),
    }
}

struct Unreliable {
    behaviour: Behaviour,
    log: Log,
    server: Server,
    has_obstacle_start: bool,
    has_reset_seed: bool,
    active: Vec<bool>,
}

impl Unreliable {
    fn new(behaviour: Behaviour, log: Log) -> Self {
        let server = Server::new(NamedEngine::REFERENCE);
        Self { behaviour, log, server, has_obstacle_start: false, has_reset_seed: false, active: Vec::new() }
    }

    fn fault(&self, kind: FaultKind) -> Misbehaviour {
        self.log.0.faults.fetch_add(1, Ordering::Relaxed);
        Misbehaviour::new(kind, "")
    }

    /// Changes the answer to a step.
    fn change(&self, ask: &Ask, reply: &mut Reply, num_asked: usize) -> Result<(), Misbehaviour> {
        let Ask::Step { actions } = ask else { return Ok(()) };
        let two_move = actions.iter().take(2).filter(|&&action| (1..5).contains(&action)).count() == 2;
        let has_finished = self.active.contains(&false);
        let is_wrong = match self.behaviour {
            Behaviour::CrashesIfTwoMove if two_move => {
                let status = "exit status: 1".into();
                return Err(self.fault(FaultKind::Ended { status, question: "step" }));
            }
            Behaviour::HangsIfTwoMove if two_move => {
                return Err(self.fault(FaultKind::NoAnswer { question: "step", limit_ms: 10_000 }));
            }
            Behaviour::ForgetsActiveIfTwoMove if two_move => {
                reply.active = None;
                false
            }
            Behaviour::CrashesAtTimesAndDoublesRewards => actions.len() >= 2,
            Behaviour::DoublesRewardsInTwoCases => self.has_obstacle_start || has_finished,
            Behaviour::DoublesRewardsAtFirst => num_asked < 100,
            Behaviour::DoublesRewardsAfterSeeds => self.has_reset_seed,
            _ => false,
        };
        if is_wrong {
            reply.rewards.iter_mut().flatten().for_each(|reward| *reward *= 2.0);
        }
        Ok(())
    }
}

impl Link for Unreliable {
    fn hello(&mut self) -> Result<Hello, Misbehaviour> {
        if self.behaviour == Behaviour::IsMute {
            return Err(self.fault(FaultKind::NoAnswer { question: "hello", limit_ms: 60_000 }));
        }
        let hello = self.server.hello()?;
        let draws = self.behaviour == Behaviour::DoublesRewardsAfterSeeds;
        Ok(Hello {
            profiles: if draws { vec![Profile::Core, Profile::Seeding] } else { vec![Profile::Core] },
            tells: Vec::new(),
            metrics: Vec::new(),
            noise: false,
            ..hello
        })
    }

    fn ask(&mut self, ask: &Ask) -> Result<Reply, Misbehaviour> {
        let num_asked = self.log.0.asked.fetch_add(1, Ordering::Relaxed);
        if self.behaviour == Behaviour::CrashesAtTimesAndDoublesRewards && num_asked % 97 == 96 {
            let status = "signal: 11".into();
            return Err(self.fault(FaultKind::Ended { status, question: "step" }));
        }
        if let Ask::Reset(beginning) = ask {
            self.log.0.configs.fetch_add(usize::from(beginning.config.is_some()), Ordering::Relaxed);
            self.has_reset_seed = beginning.seed.is_some();
            self.has_obstacle_start = beginning.instance.as_ref().is_some_and(|header| {
                let instance = header.instance().unwrap();
                let map = instance.map();
                instance.starts().iter().any(|&cell| map.is_obstacle(cell))
            });
            if self.has_obstacle_start && self.behaviour == Behaviour::RefusesObstacles {
                return Ok(Reply { error: Some("a start is an obstacle".into()), ..Reply::default() });
            }
        }
        let mut reply = self.server.ask(ask)?;
        self.change(ask, &mut reply, num_asked)?;
        if let Some(active) = &reply.active {
            self.active.clone_from(active);
        }
        Ok(reply)
    }
}
