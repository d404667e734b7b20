//! What conflict-based searches have in common: nodes that forbid agents places and moves, and their paths.

use std::sync::Arc;

use crate::conflict::{Meeting, Paths, Setting};
use crate::graph::{Graph, Vertex};
use crate::joint::{Reach, reach};
use crate::problem::{Clock, Problem};
use crate::reservations::Reservations;
use crate::sipp::{Order, Sipp, Task, Way};

/// What one agent must not do at one step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Constraint {
    pub(crate) agent: usize,
    pub(crate) step: usize,
    /// For a move, where from.
    pub(crate) from: Option<Vertex>,
    pub(crate) at: Vertex,
}

/// The constraints of a node: its own, and those of the nodes it comes from.
#[derive(Debug)]
pub(crate) struct Chain {
    constraint: Constraint,
    rest: Option<Arc<Chain>>,
}

/// A node of the tree.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) constraints: Option<Arc<Chain>>,
    pub(crate) paths: Paths,
    /// For each agent, the least that any path costs which keeps the constraints.
    pub(crate) least: Vec<u32>,
}

impl Node {
    pub(crate) fn lower_bound(&self) -> u64 {
        self.least.iter().map(|&cost| u64::from(cost)).sum()
    }

    /// The constraints of one agent.
    pub(crate) fn constraints_of(&self, agent: usize) -> impl Iterator<Item = Constraint> + '_ {
        let mut next = self.constraints.as_deref();
        let all = std::iter::from_fn(move || {
            let chain = next?;
            next = chain.rest.as_deref();
            Some(chain.constraint)
        });
        all.filter(move |constraint| constraint.agent == agent)
    }
}

/// The two constraints one of which every plan keeps in which these agents do not meet.
pub(crate) fn split(meeting: &Meeting) -> [Constraint; 2] {
    let Meeting { agents: (one, other), step, from, at } = *meeting;
    let there = from.unwrap_or(at);
    [
        Constraint { agent: one, step, from, at },
        Constraint { agent: other, step, from: from.map(|_| at), at: there },
    ]
}

/// How much the nodes of a tree may take, counted rather too high: a path counts for as long as the search goes on.
#[derive(Debug)]
pub(crate) struct Room {
    most_bytes: usize,
    num_bytes: usize,
}

impl Room {
    /// Bytes that a tree takes unless another number is chosen.
    pub(crate) const DEFAULT_BYTES: usize = 1 << 30;

    pub(crate) fn new(most_bytes: usize) -> Self {
        Self { most_bytes, num_bytes: 0 }
    }

    pub(crate) fn is_full(&self) -> bool {
        self.num_bytes > self.most_bytes
    }

    /// Counts what is kept besides nodes.
    pub(crate) fn add(&mut self, num_bytes: usize) {
        self.num_bytes += num_bytes;
    }

    /// Counts a node, and the paths that it does not share with the one it comes from.
    pub(crate) fn add_node(&mut self, node: &Node) {
        let length = |agent: usize| node.paths.path(agent).len();
        let new = match &node.constraints {
            Some(chain) => length(chain.constraint.agent),
            None => (0..node.paths.num_agents()).map(length).sum(),
        };
        self.add(Self::lasting(node) + new * size_of::<Vertex>());
    }

    /// A node is gone, but not what others have in common with it.
    pub(crate) fn remove_node(&mut self, node: &Node) {
        self.num_bytes -= Self::lasting(node);
    }

    /// Bytes of a node itself, with what searches keep beside it.
    fn lasting(node: &Node) -> usize {
        const BESIDE: usize = 256;
        BESIDE + node.paths.num_agents() * 4 * size_of::<usize>()
    }
}

/// Those of other searches are numbered from here: more than there are agents, or constraints of one.
const OUTSIDE: usize = 1 << 24;

/// How paths are found for a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Aim {
    /// The least cost, and then few conflicts.
    Best,
    /// Few conflicts, at a cost that is at most so many times the least.
    Within(f64),
}

/// The search for the paths of single agents.
pub(crate) struct Low<'a> {
    setting: &'a Setting<'a>,
    sipp: &'a mut Sipp,
    forbidden: Reservations,
    others: Reservations,
    aim: Aim,
}

impl<'a> Low<'a> {
    pub(crate) fn new(sipp: &'a mut Sipp, graph: &Graph, setting: &'a Setting<'a>, aim: Aim) -> Self {
        let free = || Reservations::new(graph.num_vertices());
        Self { setting, sipp, forbidden: free(), others: free(), aim }
    }

    /// Paths of others that should rather not be met.
    pub(crate) fn avoid(&mut self, paths: &[&[Vertex]]) {
        for (number, path) in paths.iter().enumerate() {
            self.others.add(OUTSIDE + number, path, true);
        }
    }

    /// Paths of others that must not be met.
    pub(crate) fn keep_clear(&mut self, paths: &[&[Vertex]]) {
        for (number, path) in paths.iter().enumerate() {
            self.forbidden.add(OUTSIDE + number, path, true);
        }
    }

    /// The node without constraints, unless the time is up or an agent has no path.
    pub(crate) fn root(&mut self, clock: &mut Clock) -> Option<Node> {
        let num_agents = self.setting.starts.len();
        let paths = Paths::new(num_agents, self.setting.stays());
        let mut node = Node { constraints: None, paths, least: vec![0; num_agents] };
        for agent in 0..num_agents {
            if clock.is_spent() {
                return None;
            }
            self.plan(agent, &mut node)?;
        }
        Some(node)
    }

    /// The node with one constraint more, unless its agent then has no path.
    pub(crate) fn child(&mut self, node: &Node, constraint: Constraint) -> Option<Node> {
        let chain = Arc::new(Chain { constraint, rest: node.constraints.clone() });
        let mut child = Node { constraints: Some(chain), ..node.clone() };
        self.plan(constraint.agent, &mut child)?;
        Some(child)
    }

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
        let (way, least) = found?;
        node.paths.set(agent, Arc::new(way.path), way.cost);
        node.least[agent] = least;
        Some(())
    }

    /// A path, and the least that any costs.
    fn find(&mut self, agent: usize, constraints: &[Constraint]) -> Option<(Way, u32)> {
        let mut banned = Vec::new();
        // Each is an agent of its own: two of them are not one that moves.
        for (number, &Constraint { step, from, at, .. }) in constraints.iter().enumerate() {
            match from {
                Some(from) => banned.push((from, at, step as u32)),
                None => self.forbidden.block(at, step as u32, step as u32, number),
            }
        }
        let task = Task {
            start: self.setting.starts[agent],
            legs: &self.setting.legs[agent],
            reserved: &self.forbidden,
            avoided: Some(&self.others),
            banned: &banned,
            horizon: self.setting.horizon,
            order: Order::Cost,
            salt: self.setting.salt,
        };
        let found = self.sipp.find(&task).and_then(|way| match self.aim {
            Aim::Best => Some((way.cost, way)),
            Aim::Within(_) if way.conflicts == 0 => Some((way.cost, way)),
            Aim::Within(weight) => {
                let order = Order::Conflicts { at_most: (f64::from(way.cost) * weight) as u32 };
                Some((way.cost, self.sipp.find(&Task { order, ..task })?))
            }
        });
        for (number, constraint) in constraints.iter().enumerate() {
            self.forbidden.unblock(constraint.at, constraint.step as u32, constraint.step as u32, number);
        }
        found.map(|(least, way)| (way, least))
    }
}

/// Stops searches for what does not exist, where that can be seen.
#[derive(Debug, Default)]
pub(crate) struct Doubt {
    num_nodes: u64,
}

impl Doubt {
    /// Nodes after which the doubt arises.
    const AFTER: u64 = 100;
    /// Most joint places that are looked at.
    const MOST_PLACES: usize = 100_000;

    /// Counts a node; the reason why there is no plan, once it is found.
    pub(crate) fn count(&mut self, problem: &Problem, clock: &mut Clock) -> Option<String> {
        self.num_nodes += 1;
        if self.num_nodes == Self::AFTER { Self::look(problem, clock) } else { None }
    }

    /// The reason why there is no plan, if it is soon found.
    pub(crate) fn look(problem: &Problem, clock: &mut Clock) -> Option<String> {
        let has_none = reach(problem, Self::MOST_PLACES, clock) == Reach::Unsolvable;
        has_none.then(|| "the agents cannot pass each other, whatever they do".to_owned())
    }
}
