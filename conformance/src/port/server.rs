//! An engine that answers the protocol, in this process or over a pipe.

use std::io::{BufRead, Write};

use pogema_core::{Cell, Change, Config, Environment, Error, Instance, Words};

use super::link::{Link, Misbehaviour};
use super::observations;
use super::protocol::{Ask, Beginning, Hello, PROTOCOL, Policy, Reply, WireCell, WireChange};
use crate::play::{Make, Measured, NamedEngine, Player};
use crate::request::{Op, Record, Request, numbers};

/// An engine as a port. It claims everything.
pub struct Server {
    name: String,
    make: Box<Make<'static>>,
    player: Option<Player>,
    /// The observations and metrics of the last reset or step, for `observe` and `metrics`.
    last: Reply,
}

impl Server {
    /// Creates a port that plays on an engine.
    pub fn new(engine: NamedEngine) -> Self {
        Self::with(engine.name, engine.make)
    }

    /// Creates a port that plays on the environments that `make` creates.
    pub fn with(
        name: &str,
        make: impl Fn(Config) -> Result<Box<dyn Environment>, Error> + Send + 'static,
    ) -> Self {
        Self { name: name.into(), make: Box::new(make), player: None, last: Reply::default() }
    }

    /// Begins an episode of an instance whose goals cannot be written as lists.
    ///
    /// # Errors
    /// If the instance does not fit the rules.
    pub fn begin_with(&mut self, rules: &Config, instance: Instance) -> Result<Reply, Error> {
        let player = self.player.insert(Player::of_instance(&self.make, rules, instance, &[])?);
        player.perform(&Op::Reset(None)).map(reply_of)
    }

    fn answer(&mut self, ask: &Ask) -> Result<Reply, Error> {
        let before_reset = || Error::Port { reason: "call `reset` first".into() };
        let op = match ask {
            Ask::Hello { .. } | Ask::Bye => return Ok(Reply::default()),
            Ask::Observe | Ask::Metrics if self.player.is_none() => return Err(before_reset()),
            Ask::Observe => {
                return Ok(Reply { observations: self.last.observations.clone(), ..Reply::default() });
            }
            Ask::Metrics => return Ok(Reply { metrics: self.last.metrics.clone(), ..Reply::default() }),
            Ask::Reset(beginning) => return self.begin(beginning),
            Ask::Step { actions } => Op::Step(actions.clone()),
            Ask::Act { policy: Policy::Astar } => Op::Astar,
            Ask::Act { policy: Policy::Sample } => Op::Sample,
            Ask::Back => Op::Back,
            Ask::History => Op::History,
        };
        self.player.as_mut().ok_or_else(before_reset)?.perform(&op).map(reply_of)
    }

    fn begin(&mut self, beginning: &Beginning) -> Result<Reply, Error> {
        if let Some(header) = &beginning.instance {
            let instance = header.instance()?;
            let player = Player::of_instance(&self.make, &header.config, instance, &beginning.measure)?;
            self.player = Some(player);
        } else if let Some(config) = &beginning.config {
            let Measured { density, collisions } = Measured::of(&beginning.measure);
            let request = Request {
                id: 0,
                config: config.clone(),
                register: beginning.register.clone(),
                density,
                collisions,
                ops: Vec::new(),
            };
            self.player = None;
            self.player = Some(Player::new(&self.make, &request)?);
        }
        let nothing = || Error::Port {
            reason: "reset needs an instance or a config, since there is no environment yet".into(),
        };
        let op = Op::Reset(beginning.seed);
        self.player.as_mut().ok_or_else(nothing)?.perform(&op).map(reply_of)
    }
}

impl Link for Server {
    fn hello(&mut self) -> Result<Hello, Misbehaviour> {
        let metrics =
            "ISR CSR ep_length SoC makespan avg_throughput avg_agents_density a_collisions o_collisions";
        Ok(Hello {
            protocol: PROTOCOL.into(),
            name: self.name.clone(),
            version: env!("CARGO_PKG_VERSION").into(),
            profiles: all(),
            collision: all(),
            on_goal: all(),
            observation: all(),
            occupancy: all(),
            reward: all(),
            noise: true,
            metrics: metrics.split(' ').map(str::to_owned).collect(),
            tells: all(),
            max_agents: usize::MAX,
            max_side: usize::MAX,
            max_radius: usize::MAX,
        })
    }

    fn ask(&mut self, ask: &Ask) -> Result<Reply, Misbehaviour> {
        let refused = |error: Error| Reply { error: Some(error.to_string()), ..Reply::default() };
        let reply = self.answer(ask).unwrap_or_else(refused);
        if reply.error.is_none() && matches!(ask, Ask::Reset(_) | Ask::Step { .. } | Ask::Act { .. }) {
            let (observations, metrics) = (reply.observations.clone(), reply.metrics.clone().given().into());
            self.last = Reply { observations, metrics, ..Reply::default() };
        }
        Ok(reply)
    }
}

fn all<T: Words>() -> Vec<T> {
    T::all().collect()
}

/// Serves an engine over a pair of pipes until the runner sends `bye` or closes its pipe.
///
/// A port in Rust needs nothing else.
///
/// # Errors
/// [`Error::Io`] if a pipe breaks.
pub fn serve(engine: NamedEngine, input: impl BufRead, mut output: impl Write) -> Result<(), Error> {
    let failed = |error: std::io::Error| Error::io("pipe", error);
    let mut server = Server::new(engine);
    for line in input.lines() {
        let line = line.map_err(failed)?;
        let answer = match serde_json::from_str(&line) {
            Ok(Ask::Bye) => return Ok(()),
            Ok(Ask::Hello { .. }) => server.hello().map(|hello| serde_json::to_string(&hello)),
            Ok(ask) => server.ask(&ask).map(|reply| serde_json::to_string(&reply)),
            Err(error) => {
                let reply = Reply { error: Some(error.to_string()), ..Reply::default() };
                Ok(serde_json::to_string(&reply))
            }
        };
        let text =
            answer.map_err(|fault| Error::io("pipe", fault))?.map_err(|error| Error::io("pipe", error))?;
        writeln!(output, "{text}").and_then(|()| output.flush()).map_err(failed)?;
    }
    Ok(())
}

fn wire_cell(cell: Cell) -> WireCell {
    [i64::from(cell.row), i64::from(cell.col)]
}

fn wire_changes(lists: Vec<Vec<Change>>) -> Vec<Vec<WireChange>> {
    let change = |change: Change| {
        let ([row, col], [goal_row, goal_col]) = (wire_cell(change.cell), wire_cell(change.goal));
        (row, col, goal_row, goal_col, change.step as i64, change.active)
    };
    lists.into_iter().map(|list| list.into_iter().map(change).collect()).collect()
}

/// Converts a record to an answer.
fn reply_of(record: Record) -> Reply {
    let mut reply = Reply::default();
    if let Some(state) = record.state() {
        let pairs = |cells: &[Cell]| cells.iter().copied().map(wire_cell).collect();
        reply.cells = Some(pairs(&state.cells));
        reply.goals = Some(pairs(&state.goals));
        reply.occupied = Some(pairs(&state.occupied));
        reply.active = Some(state.active.clone());
        reply.on_goal = Some(state.on_goal.clone());
    }
    match record {
        Record::Reset(reset) => {
            reply.observations = reset.observations.as_ref().map(observations::write);
            reply.map = Some(reset.map);
            reply.padded = Some(reset.padded.rows);
            reply.derived = Some(reset.derived);
            let lists = |lists: Vec<Vec<Cell>>| -> Vec<Vec<WireCell>> {
                lists.into_iter().map(|list| list.into_iter().map(wire_cell).collect()).collect()
            };
            reply.foretold = reset.goal_lists.map(lists).into();
        }
        Record::Step(step) | Record::Astar(step) | Record::Sample(step) => {
            reply.observations = step.step.observations.as_ref().map(observations::write);
            reply.actions = Some(numbers(&step.step.actions));
            reply.rewards = Some(step.step.rewards);
            reply.terminated = Some(step.step.terminated);
            reply.truncated = Some(step.step.truncated);
            reply.metrics = step.step.metrics.into();
            reply.actions_after = Some(step.actions_after);
        }
        Record::Back(back) => reply.moved = Some(back.moved),
        Record::History(history) => {
            reply.full = Some(wire_changes(history.full));
            reply.changes = Some(wire_changes(history.changes));
        }
        Record::Odd(_) => {}
    }
    reply
}
