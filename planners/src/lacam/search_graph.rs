//! The search graph of LaCAM*: configurations, their parents and their edges.

use std::hash::{Hash, Hasher};

use hashbrown::HashTable;
use rustc_hash::{FxHashSet, FxHasher};

use crate::graph::Vertex;
use crate::lacam::constraint_tree::ConstraintNode;
use crate::pibt::priorities::{next_priority, sort_by_priority};
use crate::problem::Agent;

/// No node, or no edge.
pub(super) const NONE: u32 = u32::MAX;

/// A node of the search graph. Its configuration, order and priorities are in the arrays of [`SearchGraph`].
#[derive(Debug)]
pub(super) struct Node {
    pub parent: u32,
    /// The g-value: the cost from the start.
    pub cost: u64,
    /// The h-value: a lower bound on the cost to the goals.
    pub to_go: u64,
    /// The constraints of the next successor, until all have been enumerated.
    pub constraints: Option<ConstraintNode>,
    /// The first edge to a successor.
    edges: u32,
}

#[derive(Clone, Copy, Debug)]
struct Edge {
    to: u32,
    next: u32,
}

/// The nodes and edges of the search graph.
#[derive(Debug)]
pub(super) struct SearchGraph {
    num_agents: usize,
    nodes: Vec<Node>,
    edges: Vec<Edge>,
    /// All edges, to find duplicates.
    known_edges: FxHashSet<(u32, u32)>,
    /// Shape: `[nodes, agents]`
    configurations: Vec<Vertex>,
    /// Shape: `[nodes, agents]`
    orders: Vec<Agent>,
    /// Shape: `[nodes, agents]`
    priorities: Vec<u32>,
    /// All nodes, each with the hash of its configuration.
    known: HashTable<(u64, u32)>,
}

impl SearchGraph {
    /// Creates the graph of the start configuration and its priorities.
    pub fn new(starts: &[Vertex], priorities: Vec<u32>, to_go: u64) -> Self {
        let mut graph = Self {
            num_agents: starts.len(),
            nodes: Vec::new(),
            edges: Vec::new(),
            known_edges: FxHashSet::default(),
            configurations: Vec::new(),
            orders: Vec::new(),
            priorities,
            known: HashTable::new(),
        };
        graph.insert(starts, NONE, 0, to_go);
        graph
    }

    /// Returns a node.
    #[inline]
    pub fn get(&self, node: u32) -> &Node {
        &self.nodes[node as usize]
    }

    /// Returns a mutable reference to a node.
    #[inline]
    pub fn get_mut(&mut self, node: u32) -> &mut Node {
        &mut self.nodes[node as usize]
    }

    /// Returns the configuration of a node.
    #[inline]
    pub fn configuration(&self, node: u32) -> &[Vertex] {
        &self.configurations[node as usize * self.num_agents..][..self.num_agents]
    }

    /// Returns all agents, highest priority first.
    #[inline]
    pub fn order(&self, node: u32) -> &[Agent] {
        &self.orders[node as usize * self.num_agents..][..self.num_agents]
    }

    /// Returns the approximate memory of the graph. Units: bytes.
    pub fn num_bytes(&self) -> usize {
        let node = size_of::<Node>() + 3 * size_of::<u32>() * self.num_agents + 4 * size_of::<u64>();
        self.nodes.len() * node + self.edges.len() * 2 * size_of::<Edge>()
    }

    /// Returns the configurations from the start to a node.
    pub fn path_to(&self, node: u32) -> Vec<Vec<Vertex>> {
        let parent = |&node: &u32| Some(self.get(node).parent).filter(|&parent| parent != NONE);
        let mut path: Vec<_> =
            std::iter::successors(Some(node), parent).map(|node| self.configuration(node).to_vec()).collect();
        path.reverse();
        path
    }

    /// Returns the node of a configuration.
    pub fn find(&self, configuration: &[Vertex]) -> Option<u32> {
        let is_same = |&(_, node): &(u64, u32)| self.configuration(node) == configuration;
        self.known.find(hash(configuration), is_same).map(|&(_, node)| node)
    }

    /// Adds the node of a new configuration.
    pub fn add(
        &mut self,
        configuration: &[Vertex],
        parent: u32,
        goals: &[Vertex],
        (cost, to_go): (u64, u64),
    ) -> u32 {
        let start = parent as usize * self.num_agents;
        for (agent, (vertex, goal)) in configuration.iter().zip(goals).enumerate() {
            let priority = self.priorities[start + agent];
            self.priorities.push(next_priority(priority, vertex == goal));
        }
        self.insert(configuration, parent, cost, to_go)
    }

    /// Adds a node whose priorities are already known.
    fn insert(&mut self, configuration: &[Vertex], parent: u32, cost: u64, to_go: u64) -> u32 {
        let node = self.nodes.len() as u32;
        self.configurations.extend_from_slice(configuration);
        let start = self.orders.len();
        self.orders.extend(0..configuration.len() as Agent);
        sort_by_priority(&mut self.orders[start..], &self.priorities[start..]);
        let hash = hash(configuration);
        self.known.insert_unique(hash, (hash, node), |&(hash, _)| hash);
        let constraints = Some(ConstraintNode::default());
        self.nodes.push(Node { parent, cost, to_go, constraints, edges: NONE });
        node
    }

    /// Adds an edge unless it exists.
    pub fn connect(&mut self, from: u32, to: u32) {
        if !self.known_edges.insert((from, to)) {
            return;
        }
        let next = std::mem::replace(&mut self.nodes[from as usize].edges, self.edges.len() as u32);
        self.edges.push(Edge { to, next });
    }

    /// Returns the known successors of a node.
    pub fn successors(&self, from: u32) -> impl Iterator<Item = u32> + '_ {
        let edge = |edge: u32| self.edges.get(edge as usize);
        std::iter::successors(edge(self.get(from).edges), move |&&Edge { next, .. }| edge(next))
            .map(|&Edge { to, .. }| to)
    }
}

fn hash(configuration: &[Vertex]) -> u64 {
    let mut hasher = FxHasher::default();
    configuration.hash(&mut hasher);
    hasher.finish()
}
