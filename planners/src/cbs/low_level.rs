//! The low level of CBS: SIPP under the constraints of a node.

use std::sync::Arc;

use crate::budget::Clock;
use crate::cbs::node::{Constraint, ConstraintList, Node};
use crate::graph::{Graph, Vertex};
use crate::paths::Paths;
use crate::reservations::Reservations;
use crate::sipp::{Order, Sipp, Task, TimedPath};
use crate::team_task::TeamTask;

/// The first index of paths from outside the search. It exceeds the number of agents and of constraints.
const OUTSIDE: usize = 1 << 24;

/// The objective of the low level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Aim {
    /// The cost, then the number of conflicts.
    Best,
    /// The number of conflicts, among paths that cost at most this factor times the least cost.
    Within(f64),
}

/// The low-level search, which plans single agents.
pub(crate) struct LowLevel<'a> {
    team: &'a TeamTask<'a>,
    sipp: &'a mut Sipp,
    forbidden: Reservations,
    others: Reservations,
    aim: Aim,
}

impl<'a> LowLevel<'a> {
    /// Prepares searches for the agents of a team.
    pub(crate) fn new(sipp: &'a mut Sipp, graph: &Graph, team: &'a TeamTask<'a>, aim: Aim) -> Self {
        let free = || Reservations::new(graph.num_vertices());
        Self { team, sipp, forbidden: free(), others: free(), aim }
    }

    /// Adds soft constraints: paths from outside the search.
    pub(crate) fn avoid(&mut self, paths: &[&[Vertex]]) {
        for (number, path) in paths.iter().enumerate() {
            self.others.add(OUTSIDE + number, path, true);
        }
    }

    /// Adds hard constraints: paths from outside the search.
    pub(crate) fn forbid(&mut self, paths: &[&[Vertex]]) {
        for (number, path) in paths.iter().enumerate() {
            self.forbidden.add(OUTSIDE + number, path, true);
        }
    }

    /// Returns the root, unless the budget is spent or an agent has no path.
    pub(crate) fn root(&mut self, clock: &mut Clock) -> Option<Node> {
        let num_agents = self.team.starts.len();
        let paths = Paths::new(num_agents, self.team.stays());
        let mut node = Node { constraints: None, paths, least: vec![0; num_agents] };
        for agent in 0..num_agents {
            if clock.is_spent() {
                return None;
            }
            self.plan(agent, &mut node)?;
        }
        Some(node)
    }

    /// Returns the child with one more constraint, unless its agent has no path.
    pub(crate) fn child(&mut self, node: &Node, constraint: Constraint) -> Option<Node> {
        let list = ConstraintList { constraint, rest: node.constraints.clone() };
        let mut child = Node { constraints: Some(Arc::new(list)), ..node.clone() };
        self.plan(constraint.agent, &mut child)?;
        Some(child)
    }

    /// Replans one agent of a node.
    fn plan(&mut self, agent: usize, node: &mut Node) -> Option<()> {
        let others: Vec<usize> = (0..node.paths.num_agents()).filter(|&other| other != agent).collect();
        for &other in &others {
            self.others.add(other, node.paths.path(other), node.paths.stays);
        }
        let constraints: Vec<Constraint> = node.constraints_of(agent).collect();
        let found = self.find(agent, &constraints);
        for &other in &others {
            self.others.remove(other, node.paths.path(other), node.paths.stays);
        }
        let (found, least) = found?;
        node.paths.set(agent, Arc::new(found.path), found.cost);
        node.least[agent] = least;
        Some(())
    }

    /// Finds a path, and the least cost of any path.
    fn find(&mut self, agent: usize, constraints: &[Constraint]) -> Option<(TimedPath, u32)> {
        let mut banned = Vec::new();
        // Each constraint counts as its own agent, so that two of them do not form a move.
        for (number, &Constraint { step, from, at, .. }) in constraints.iter().enumerate() {
            match from {
                Some(from) => banned.push((from, at, step as u32)),
                None => self.forbidden.block(at, step as u32, step as u32, number),
            }
        }
        let task = self.team.task(agent, &self.forbidden);
        let task = Task { avoided: Some(&self.others), banned: &banned, ..task };
        let found = self.sipp.find(&task).and_then(|path| match self.aim {
            Aim::Best => Some((path.cost, path)),
            Aim::Within(_) if path.conflicts == 0 => Some((path.cost, path)),
            Aim::Within(weight) => {
                let order = Order::Conflicts { max_cost: (f64::from(path.cost) * weight) as u32 };
                Some((path.cost, self.sipp.find(&Task { order, ..task })?))
            }
        });
        for (number, constraint) in constraints.iter().enumerate() {
            self.forbidden.unblock(constraint.at, constraint.step as u32, constraint.step as u32, number);
        }
        found.map(|(least, path)| (path, least))
    }
}
