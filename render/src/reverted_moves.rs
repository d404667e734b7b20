//! The rule that reverted each reverted move.

use std::collections::HashMap;

use pogema_core::{Action, Cell, Collision, Config, Map, Snapshot};

/// A move that an active agent requested and that was reverted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RevertedMove {
    /// The index of the agent.
    pub agent: usize,
    /// The id of the rule that reverted the move.
    pub rule: &'static str,
    /// The wall, obstacle or agent that blocked the move.
    pub blocker: Blocker,
}

/// The cause of a reverted move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blocker {
    /// The wall around the map.
    Wall,
    /// The obstacle on a cell.
    Obstacle(Cell),
    /// Another agent, by index: one that occupies the target cell, moves to it instead, or also aims at it.
    Agent(usize),
    /// No cause under the rules of the config: the step was recorded under other rules.
    Unknown,
}

impl Blocker {
    /// Returns the kind of the cause: `wall`, `obstacle`, `agent` or `unknown`.
    pub fn kind(self) -> &'static str {
        match self {
            Self::Wall => "wall",
            Self::Obstacle(_) => "obstacle",
            Self::Agent(_) => "agent",
            Self::Unknown => "unknown",
        }
    }
}

/// Returns the reverted moves of one step, in ascending order of agent index.
///
/// A move is reverted if an active agent's action is not stay, but its cell does not change. Each reverted move has one
/// reason. If several apply, the first of these counts: obstacle or wall, then
/// - under `priority`: lost contest, swap, occupied cell, agent that had not left yet;
/// - under `block_both`: occupied cell, lost contest;
/// - under `soft`: swap, occupied cell, lost contest.
///
/// Shape: `actions` and the lists of `before` and `after` have one entry per agent; entries beyond the shortest list
/// are ignored.
///
/// Rule: move/actions, collide/priority, collide/block-both, collide/soft
pub fn reverted_moves(
    config: &Config,
    map: &Map,
    before: &Snapshot,
    actions: &[Action],
    after: &Snapshot,
) -> Vec<RevertedMove> {
    let step = Step::new(map, before, actions, after);
    let reason = |agent| {
        let (rule, blocker) = step.reason(config.collision, agent);
        RevertedMove { agent, rule, blocker }
    };
    (0..step.num_agents).filter(|&agent| step.is_reverted(agent)).map(reason).collect()
}

type Reason = (&'static str, Blocker);

/// One step, with its active agents indexed by cell.
struct Step<'a> {
    num_agents: usize,
    map: &'a Map,
    before: &'a Snapshot,
    actions: &'a [Action],
    after: &'a Snapshot,
    /// The agent on each cell before the step.
    occupants: HashMap<Cell, usize>,
    /// The agent that moved to each cell.
    arrivals: HashMap<Cell, usize>,
    /// The two lowest indices of the agents that aim at each cell.
    aiming: HashMap<Cell, (usize, Option<usize>)>,
}

impl<'a> Step<'a> {
    fn new(map: &'a Map, before: &'a Snapshot, actions: &'a [Action], after: &'a Snapshot) -> Self {
        let lengths = [before.cells.len(), before.active.len(), actions.len(), after.cells.len()];
        let num_agents = lengths.into_iter().min().unwrap_or(0);
        let [occupants, arrivals] = [HashMap::new(), HashMap::new()];
        let aiming = HashMap::new();
        let mut step = Self { num_agents, map, before, actions, after, occupants, arrivals, aiming };
        for agent in (0..num_agents).filter(|&agent| before.active[agent]) {
            step.occupants.insert(before.cells[agent], agent);
            if step.has_moved(agent) {
                step.arrivals.insert(after.cells[agent], agent);
            }
            if let Some(target) = step.target(agent) {
                let (lowest, second) = step.aiming.entry(target).or_insert((agent, None));
                if *lowest != agent {
                    second.get_or_insert(agent);
                }
            }
        }
        step
    }

    fn has_moved(&self, agent: usize) -> bool {
        self.before.cells[agent] != self.after.cells[agent]
    }

    fn is_reverted(&self, agent: usize) -> bool {
        self.before.active[agent] && self.actions[agent] != Action::Stay && !self.has_moved(agent)
    }

    /// Returns the cell that an agent aims at, if the cell is on the map.
    fn target(&self, agent: usize) -> Option<Cell> {
        let cell = Cell::checked(self.before.cells[agent].toward(self.actions[agent]))?;
        self.map.contains(cell).then_some(cell)
    }

    fn reason(&self, collision: Collision, agent: usize) -> Reason {
        let blocked = if collision == Collision::Soft { "collide/soft/stay" } else { "move/actions" };
        let Some(target) = self.target(agent) else { return (blocked, Blocker::Wall) };
        if self.map.obstacles()[self.map.index(target)] {
            return (blocked, Blocker::Obstacle(target));
        }
        match collision {
            Collision::Priority => self.reason_by_priority(agent, target),
            Collision::BlockBoth => self.reason_under_block_both(agent, target),
            Collision::Soft => self.reason_under_soft(agent, target),
        }
    }

    /// Finds the other agent that occupies the cell at the agent's turn: one with a lower index that moved there, or
    /// one that has not left yet.
    ///
    /// Rule: collide/priority/contest, collide/priority/follow, collide/priority/swap
    fn reason_by_priority(&self, agent: usize, target: Cell) -> Reason {
        if let Some(&winner) = self.arrivals.get(&target).filter(|&&other| other < agent) {
            return ("collide/priority/contest", Blocker::Agent(winner));
        }
        match self.occupants.get(&target) {
            Some(&other) if self.is_in_ring(agent) => ("collide/priority/swap", Blocker::Agent(other)),
            Some(&other) if !self.has_moved(other) => ("collide/priority", Blocker::Agent(other)),
            Some(&other) if other > agent => ("collide/priority/follow", Blocker::Agent(other)),
            _ => ("collide/priority", Blocker::Unknown),
        }
    }

    /// Rule: collide/block-both/occupied, collide/block-both/contest
    fn reason_under_block_both(&self, agent: usize, target: Cell) -> Reason {
        if let Some(&other) = self.occupants.get(&target) {
            return ("collide/block-both/occupied", Blocker::Agent(other));
        }
        match self.aiming.get(&target) {
            Some(&(other, _)) if other != agent => ("collide/block-both/contest", Blocker::Agent(other)),
            Some(&(_, Some(other))) => ("collide/block-both/contest", Blocker::Agent(other)),
            _ => ("collide/block-both", Blocker::Unknown),
        }
    }

    /// Rule: collide/soft/swap, collide/soft/chain, collide/soft/contest
    fn reason_under_soft(&self, agent: usize, target: Cell) -> Reason {
        match (self.occupants.get(&target), self.arrivals.get(&target)) {
            (Some(&other), _) if self.target(other) == Some(self.before.cells[agent]) => {
                ("collide/soft/swap", Blocker::Agent(other))
            }
            (Some(&other), _) if !self.has_moved(other) => ("collide/soft/chain", Blocker::Agent(other)),
            (_, Some(&winner)) => ("collide/soft/contest", Blocker::Agent(winner)),
            _ => ("collide/soft", Blocker::Unknown),
        }
    }

    /// Returns whether the agent is part of a ring, in which each agent aims at the cell of the next.
    fn is_in_ring(&self, agent: usize) -> bool {
        let next = |other: &usize| self.target(*other).and_then(|cell| self.occupants.get(&cell)).copied();
        // If the chain leads into a ring without the agent, it never ends, hence the limit.
        let mut ahead = std::iter::successors(next(&agent), next).take(self.num_agents);
        ahead.any(|other| other == agent)
    }
}

#[cfg(test)]
#[path = "../examples/pages/play.rs"]
pub(crate) mod play;

#[cfg(test)]
mod tests;
