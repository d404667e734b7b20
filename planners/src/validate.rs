//! The plan validator, independent of the planners: it shares only the type of the plans with them.

use std::collections::HashMap;
use std::fmt;

use pogema_core::{Cell, Map, counted};

use crate::plan::Plan;

/// The first conflict in a plan: a collision of two agents, or another violation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Conflict {
    /// The step after which it occurs, counted from 1; 0 is the start.
    pub step: usize,
    /// The agents involved, in ascending order.
    pub agents: Vec<usize>,
    /// The cell where it occurs, if it concerns a cell.
    pub cell: Option<Cell>,
    /// The kind of conflict.
    pub kind: ConflictKind,
}

/// The kinds of conflicts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConflictKind {
    /// The number of agents in the plan differs from the number of starts.
    NumStarts {
        /// The number of agents in the plan.
        found: usize,
        /// The number of starts.
        expected: usize,
    },
    /// The number of agents in the plan differs from the number of goals.
    NumGoals {
        /// The number of agents in the plan.
        found: usize,
        /// The number of goals.
        expected: usize,
    },
    /// The agent is not at its start.
    Start {
        /// Its start.
        expected: Cell,
    },
    /// The agent is off the map.
    Outside,
    /// The agent is on an obstacle.
    Obstacle,
    /// The agent moved more than one cell.
    Jump {
        /// The cell before the step.
        from: Cell,
    },
    /// Two agents are in one cell.
    Vertex,
    /// Two agents swapped their cells.
    Edge,
    /// The agent is not at its goal at the end.
    Goal {
        /// Its goal.
        expected: Cell,
    },
    /// The agent arrives after the step limit.
    Late {
        /// The step in which it arrives.
        arrival: usize,
        /// The step limit.
        max_steps: usize,
    },
}

impl fmt::Display for Conflict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { step, agents, cell, kind } = self;
        let first = agents.first().copied().unwrap_or(0);
        let second = agents.get(1).copied().unwrap_or(first);
        let cell = cell.map(|cell| cell.to_string()).unwrap_or_default();
        match kind {
            ConflictKind::NumStarts { found, expected } => {
                write!(
                    f,
                    "the plan has {}, expected {expected}, the number of starts",
                    counted(*found, "agent")
                )
            }
            ConflictKind::NumGoals { found, expected } => {
                write!(
                    f,
                    "the plan has {}, expected {expected}, the number of goals",
                    counted(*found, "agent")
                )
            }
            ConflictKind::Start { expected } => {
                write!(f, "agent {first} begins at {cell}, expected its start {expected}")
            }
            ConflictKind::Outside => write!(f, "step {step}: agent {first} leaves the map at {cell}"),
            ConflictKind::Obstacle => write!(f, "step {step}: agent {first} is on an obstacle at {cell}"),
            ConflictKind::Jump { from } => {
                write!(f, "step {step}: agent {first} jumps from {from} to {cell}")
            }
            ConflictKind::Vertex => write!(f, "step {step}: agents {first} and {second} are both at {cell}"),
            ConflictKind::Edge => write!(f, "step {step}: agents {first} and {second} swap at {cell}"),
            ConflictKind::Goal { expected } => {
                write!(f, "agent {first} ends at {cell}, expected its goal {expected}")
            }
            ConflictKind::Late { arrival, max_steps } => {
                write!(f, "agent {first} arrives in step {arrival}, expected at most step {max_steps}")
            }
        }
    }
}

/// Checks that a plan is free of conflicts and leads from the starts to the goals; without goals, agents may end
/// anywhere.
///
/// # Errors
/// A wrong number of agents; otherwise the first conflict, by step and then by agent.
pub fn validate(map: &Map, starts: &[Cell], goals: Option<&[Cell]>, plan: &Plan) -> Result<(), Conflict> {
    let cells = plan.cells();
    let found = plan.num_agents();
    check_number(found, starts, |expected| ConflictKind::NumStarts { found, expected })?;
    check_number(found, goals.unwrap_or(&cells[0]), |expected| ConflictKind::NumGoals { found, expected })?;
    check_ends(|expected| ConflictKind::Start { expected }, 0, &cells[0], starts)?;
    for (step, now) in cells.iter().enumerate() {
        let before = &cells[step.saturating_sub(1)];
        check_step(map, step, before, now)?;
    }
    goals.map_or(Ok(()), |goals| {
        check_ends(
            |expected| ConflictKind::Goal { expected },
            plan.num_steps(),
            &cells[plan.num_steps()],
            goals,
        )
    })
}

/// Checks that all agents of a plan arrive within a step limit.
///
/// # Errors
/// The first agent that arrives later.
pub fn validate_arrivals(plan: &Plan, max_steps: usize) -> Result<(), Conflict> {
    let arrivals = plan.arrivals();
    match arrivals.iter().position(|&arrival| arrival > max_steps) {
        Some(agent) => {
            let kind = ConflictKind::Late { arrival: arrivals[agent], max_steps };
            Err(Conflict {
                step: max_steps,
                agents: vec![agent],
                cell: Some(plan.cells()[max_steps][agent]),
                kind,
            })
        }
        None => Ok(()),
    }
}

fn check_number(
    found: usize,
    wanted: &[Cell],
    kind: impl FnOnce(usize) -> ConflictKind,
) -> Result<(), Conflict> {
    if found == wanted.len() {
        return Ok(());
    }
    Err(Conflict { step: 0, agents: Vec::new(), cell: None, kind: kind(wanted.len()) })
}

fn check_ends(
    kind: impl FnOnce(Cell) -> ConflictKind,
    step: usize,
    cells: &[Cell],
    wanted: &[Cell],
) -> Result<(), Conflict> {
    match (0..cells.len()).find(|&agent| cells[agent] != wanted[agent]) {
        Some(agent) => {
            Err(Conflict { step, agents: vec![agent], cell: Some(cells[agent]), kind: kind(wanted[agent]) })
        }
        None => Ok(()),
    }
}

fn check_step(map: &Map, step: usize, before: &[Cell], now: &[Cell]) -> Result<(), Conflict> {
    let alone = |agent: usize, kind| Conflict { step, agents: vec![agent], cell: Some(now[agent]), kind };
    let mut standing: HashMap<Cell, usize> = HashMap::with_capacity(now.len());
    let mut moves: HashMap<(Cell, Cell), usize> = HashMap::with_capacity(now.len());
    for (agent, (&from, &to)) in before.iter().zip(now).enumerate() {
        if !map.contains(to) {
            return Err(alone(agent, ConflictKind::Outside));
        }
        if map.is_obstacle(to) {
            return Err(alone(agent, ConflictKind::Obstacle));
        }
        if from.distance(to) > 1 {
            return Err(alone(agent, ConflictKind::Jump { from }));
        }
        if let Some(other) = standing.insert(to, agent) {
            return Err(Conflict {
                step,
                agents: vec![other, agent],
                cell: Some(to),
                kind: ConflictKind::Vertex,
            });
        }
        if let Some(&other) = moves.get(&(to, from)).filter(|_| from != to) {
            return Err(Conflict {
                step,
                agents: vec![other, agent],
                cell: Some(to),
                kind: ConflictKind::Edge,
            });
        }
        moves.insert((from, to), agent);
    }
    Ok(())
}
