//! A session with a port for one config.

use pogema_core::{Cell, Change, Config, Error, Instance, Observed, OnGoal, Snapshot, TraceHeader, counted};

use super::link::{FaultKind, Link, Misbehaviour};
use super::observations;
use super::protocol::{Ask, Beginning, Hello, Key, Profile, Reply, ReplyKey, WireCell, WireChange};
use crate::request::History;

/// A session with a port for one config.
///
/// An answer that breaks the protocol is an error; [`Port::fault`] then returns the details.
pub struct Port<'l> {
    link: &'l mut dyn Link,
    hello: &'l Hello,
    config: Config,
    padded_dtype: &'static str,
    num_goals: usize,
    reply: Reply,
    observed: Option<Observed>,
    fault: Option<Misbehaviour>,
    misshapen: Option<String>,
}

impl<'l> Port<'l> {
    /// Creates a session that plays episodes of a config.
    pub fn new(link: &'l mut dyn Link, hello: &'l Hello, config: Config) -> Self {
        // The goals that an instance lists for each agent. An agent reaches at most one goal per step.
        let num_goals = usize::try_from(config.max_steps).unwrap_or(0) + 2;
        let (reply, observed) = (Reply::default(), None);
        let (padded_dtype, fault, misshapen) = ("float64", None, None);
        Self { link, hello, config, padded_dtype, num_goals, reply, observed, fault, misshapen }
    }

    /// Sets the element type to record for maps with their border, since the protocol does not report it.
    pub fn set_padded_dtype(&mut self, dtype: &'static str) {
        self.padded_dtype = dtype;
    }

    /// Sets the number of goals that an instance lists for each agent (at least 2).
    pub fn set_num_goals(&mut self, num_goals: usize) {
        self.num_goals = num_goals.max(2);
    }

    /// Returns the misbehaviour of the port, if any.
    pub fn fault(&self) -> Option<&Misbehaviour> {
        self.fault.as_ref()
    }

    /// Returns what is wrong with the form of the first observations that cannot be read, if any.
    pub fn misshapen(&self) -> Option<&str> {
        self.misshapen.as_deref()
    }

    /// Returns the last answer.
    pub fn reply(&self) -> &Reply {
        &self.reply
    }

    /// Returns the last observations, if the port claims to report them.
    pub fn observed(&self) -> Option<&Observed> {
        self.observed.as_ref()
    }

    /// Returns an instance in the form that a port receives.
    pub fn header(&self, instance: &Instance) -> TraceHeader {
        TraceHeader::new(self.config, instance, self.num_goals)
    }

    /// Begins an episode.
    ///
    /// # Errors
    /// If the port answers with an error or breaks the protocol.
    pub fn begin(&mut self, beginning: Beginning) -> Result<(), Error> {
        let is_drawn = beginning.instance.is_none();
        let reply = self.ask(&Ask::Reset(Box::new(beginning)))?;
        if is_drawn {
            self.require("map", reply.map.as_ref())?;
            self.check_num_agents(&reply)?;
            if self.tells(ReplyKey::Derived) {
                self.require("derived", reply.derived.as_ref())?;
            }
            if self.tells(ReplyKey::Foretold) && self.config.on_goal == OnGoal::Restart {
                self.require("foretold", (!reply.foretold.is_left_out()).then_some(&()))?;
            }
        }
        if self.tells(ReplyKey::Padded) {
            self.require("padded", reply.padded.as_ref())?;
        }
        self.check_state(&reply)?;
        self.observed = None;
        self.take_observations(reply)?;
        Ok(())
    }

    /// Plays a step with the given actions, or with actions that the port chooses.
    ///
    /// # Errors
    /// If the port answers with an error or breaks the protocol.
    pub fn advance(&mut self, ask: &Ask) -> Result<(), Error> {
        let mut reply = self.ask(ask)?;
        self.check_state(&reply)?;
        self.require_list("rewards", reply.rewards.as_ref())?;
        self.require_list("terminated", reply.terminated.as_ref())?;
        self.require_list("truncated", reply.truncated.as_ref())?;
        if matches!(ask, Ask::Act { .. }) {
            self.require_list("actions", reply.actions.as_ref())?;
        }
        if self.tells(ReplyKey::ActionsAfter) {
            self.require_list("actions_after", reply.actions_after.as_ref())?;
        }
        if self.claims(Profile::Metrics) && reply.metrics.is_left_out() {
            reply.metrics = self.ask(&Ask::Metrics)?.metrics;
            self.require("metrics", (!reply.metrics.is_left_out()).then_some(&()))?;
        }
        self.take_observations(reply)?;
        Ok(())
    }

    /// Returns the recorded history of the episode.
    ///
    /// # Errors
    /// If the port answers with an error or breaks the protocol.
    pub fn history(&mut self) -> Result<History, Error> {
        let reply = self.ask(&Ask::History)?;
        self.require_list("full", reply.full.as_ref())?;
        self.require_list("changes", reply.changes.as_ref())?;
        Ok(History { full: as_changes(reply.full)?, changes: as_changes(reply.changes)? })
    }

    /// Returns the foretold goals of the last answer, if it has any.
    ///
    /// # Errors
    /// If a number is out of range for every map.
    pub fn foretold(&self) -> Result<Option<Vec<Vec<Cell>>>, Error> {
        let Key::Given(lists) = &self.reply.foretold else { return Ok(None) };
        let cell = |pair: &WireCell| as_cell(pair).ok_or_else(|| out_of_range("foretold goal", *pair));
        lists.iter().map(|list| list.iter().map(cell).collect()).collect::<Result<_, _>>().map(Some)
    }

    /// Takes the last step back; returns whether there was one.
    ///
    /// # Errors
    /// If the port answers with an error or breaks the protocol.
    pub fn step_back(&mut self) -> Result<bool, Error> {
        let reply = self.ask(&Ask::Back)?;
        self.check_state(&reply)?;
        self.require("moved", reply.moved.as_ref())?;
        let moved = reply.moved == Some(true);
        self.reply = reply;
        Ok(moved)
    }

    /// Returns the state after the last answer. If the port does not report `on_goal`, the state's `on_goal` is false
    /// for every agent. If the port does not report `occupied`, the state's `occupied` has the cell of every active
    /// agent.
    pub fn snapshot(&self) -> Snapshot {
        let reply = &self.reply;
        let cells = as_cells(reply.cells.as_ref()).unwrap_or_default();
        let active = reply.active.clone().unwrap_or_default();
        let occupied = as_cells(reply.occupied.as_ref()).unwrap_or_else(|| {
            let mut marked: Vec<Cell> =
                cells.iter().zip(&active).filter(|(_, active)| **active).map(|(cell, _)| *cell).collect();
            marked.sort_unstable();
            marked
        });
        Snapshot {
            goals: as_cells(reply.goals.as_ref()).unwrap_or_default(),
            on_goal: reply.on_goal.clone().unwrap_or_else(|| vec![false; cells.len()]),
            cells,
            active,
            occupied,
        }
    }

    fn claims(&self, profile: Profile) -> bool {
        self.hello.profiles.contains(&profile)
    }

    fn tells(&self, key: ReplyKey) -> bool {
        self.hello.tells.contains(&key)
    }

    fn ask(&mut self, ask: &Ask) -> Result<Reply, Error> {
        let reply = self.link.ask(ask).map_err(|fault| self.misbehaved(fault))?;
        match reply.error {
            Some(reason) => Err(Error::Port { reason }),
            None => Ok(reply),
        }
    }

    fn misbehaved(&mut self, fault: Misbehaviour) -> Error {
        let reason = fault.what.clone();
        self.fault = Some(fault);
        Error::Port { reason }
    }

    fn require<T>(&mut self, key: &'static str, value: Option<&T>) -> Result<(), Error> {
        if value.is_some() {
            return Ok(());
        }
        Err(self.misbehaved(Misbehaviour::new(FaultKind::LeftOut { key }, "")))
    }

    fn require_list<T>(&mut self, key: &'static str, list: Option<&Vec<T>>) -> Result<(), Error> {
        self.require(key, list)?;
        let (length, expected) = (list.map_or(0, Vec::len), self.config.num_agents);
        if length == expected {
            return Ok(());
        }
        let details = format!(": it has length {length}, expected {expected}");
        Err(self.misbehaved(Misbehaviour::new(FaultKind::WrongLength { key }, &details)))
    }

    /// Returns an error if `cells` and `goals` have the same wrong length: the form is valid, but the answer is wrong.
    fn check_num_agents(&self, reply: &Reply) -> Result<(), Error> {
        let lengths = [reply.cells.as_ref().map(Vec::len), reply.goals.as_ref().map(Vec::len)];
        let expected = self.config.num_agents;
        match lengths {
            [Some(cells), Some(goals)] if cells == goals && cells != expected => {
                let reason = format!("the answer has {}, expected {expected}", counted(cells, "agent"));
                Err(Error::Port { reason })
            }
            _ => Ok(()),
        }
    }

    fn check_state(&mut self, reply: &Reply) -> Result<(), Error> {
        self.require_list("cells", reply.cells.as_ref())?;
        self.require_list("goals", reply.goals.as_ref())?;
        self.require_list("active", reply.active.as_ref())?;
        if self.tells(ReplyKey::OnGoal) {
            self.require_list("on_goal", reply.on_goal.as_ref())?;
        }
        if self.tells(ReplyKey::Occupied) {
            self.require("occupied", reply.occupied.as_ref())?;
        }
        for (what, cells) in
            [("cell", &reply.cells), ("goal", &reply.goals), ("marked cell", &reply.occupied)]
        {
            for cell in cells.iter().flatten() {
                if as_cell(cell).is_none() {
                    return Err(out_of_range(what, *cell));
                }
            }
        }
        Ok(())
    }

    fn take_observations(&mut self, mut reply: Reply) -> Result<(), Error> {
        if self.claims(Profile::Observations) {
            if reply.observations.is_none() {
                reply.observations = self.ask(&Ask::Observe)?.observations;
                self.require("observations", reply.observations.as_ref())?;
            }
            if let Some(value) = reply.observations.take() {
                match observations::read(&value, &self.config, self.padded_dtype) {
                    Ok(observed) => self.observed = Some(observed),
                    Err(what) => {
                        self.observed = None;
                        self.misshapen.get_or_insert(what);
                    }
                }
            }
        }
        self.reply = reply;
        Ok(())
    }
}

/// Returns the cell, unless a number is out of range for every map.
fn as_cell(&[row, col]: &WireCell) -> Option<Cell> {
    Cell::checked((row, col))
}

/// Returns the error for a cell that is out of range: the form of the answer is valid, but the answer is wrong.
fn out_of_range(what: &str, [row, col]: WireCell) -> Error {
    let expected = format!("expected numbers from 0 to {}", u16::MAX);
    Error::Port { reason: format!("{what} ({row}, {col}) is out of range, {expected}") }
}

fn as_changes(lists: Option<Vec<Vec<WireChange>>>) -> Result<Vec<Vec<Change>>, Error> {
    let change = |(row, col, goal_row, goal_col, step, active): WireChange| {
        let cell = |pair| as_cell(&pair).ok_or_else(|| out_of_range("cell of a change", pair));
        let (cell, goal) = (cell([row, col])?, cell([goal_row, goal_col])?);
        let wrong_step =
            |_| Error::Port { reason: format!("step {step} of a change is negative, expected 0 or more") };
        Ok(Change { cell, goal, step: u64::try_from(step).map_err(wrong_step)?, active })
    };
    let list = |list: Vec<WireChange>| list.into_iter().map(change).collect::<Result<_, _>>();
    lists.unwrap_or_default().into_iter().map(list).collect()
}

fn as_cells(pairs: Option<&Vec<WireCell>>) -> Option<Vec<Cell>> {
    pairs?.iter().map(as_cell).collect()
}
