//! Joint A*: plans of least sum of costs for a few agents on a small map.
//!
//! Source: Standley, "Finding Optimal Solutions to Cooperative Pathfinding Problems", AAAI 2010: A* through joint
//! states that assigns the moves of a step agent by agent. The heuristic is the sum of the costs to go.
//!
//! | paper | here |
//! | --- | --- |
//! | state | `JointAstar::state`, the vertices of all agents, and [`Node::resting`] |
//! | g, h | [`Node::cost`], the sum of [`JointTask::costs`] |
//! | intermediate node | the agents before `agent` in [`JointAstar::assign`] |

use std::hash::{Hash, Hasher};

use hashbrown::HashTable;
use rustc_hash::FxHasher;

use crate::budget::Clock;
use crate::distances::CostToGo;
use crate::graph::{Graph, Vertex};

/// The problem that joint A* solves.
pub(crate) struct JointTask<'a> {
    pub graph: &'a Graph,
    pub starts: &'a [Vertex],
    pub goals: &'a [Vertex],
    /// The costs to go of each agent, finite at its start.
    pub costs: &'a [CostToGo],
    /// Whether an agent leaves the map when it ends a step on its goal; otherwise it may decide to rest there.
    pub leaves: bool,
    /// The limit on generated joint states, and on partial assignments for one of them.
    pub max_states: usize,
}

/// The result of a search.
pub(crate) enum Found {
    /// The paths of the agents up to the step after which they rest, with the least sum of costs.
    Paths(Vec<Vec<Vertex>>),
    /// No plan exists.
    Nothing,
    /// The limit on agents, the limits of `max_states` or the budget was exceeded.
    Unknown,
}

/// A joint state that was reached at a cost.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// The agents that rest or have left, one bit for each.
    resting: u32,
    /// The number of steps in which an agent did not rest, summed over all agents.
    cost: u32,
    parent: Option<u32>,
}

impl Node {
    fn rests(&self, agent: usize) -> bool {
        self.resting >> agent & 1 == 1
    }
}

/// The search.
struct JointAstar<'a> {
    task: &'a JointTask<'a>,
    nodes: Vec<Node>,
    /// Shape: `[nodes, agents]`
    vertices: Vec<Vertex>,
    /// The best node of each joint state, with its hash.
    known: HashTable<(u64, u32)>,
    /// Nodes by f-value, relative to the f-value of the start.
    open: Vec<Vec<u32>>,
    least: u64,
    /// Number of calls of [`JointAstar::assign`] since it last moved all agents.
    num_idle: usize,
    /// Whether joint states are missing, because a limit was exceeded.
    is_cut_off: bool,
}

/// The limit on agents: the set of resting agents has one bit for each.
const MAX_AGENTS: usize = u32::BITS as usize;

/// Finds a plan of least sum of costs.
pub(crate) fn search(task: &JointTask<'_>, clock: &mut Clock) -> Found {
    let num_agents = task.starts.len();
    if num_agents > MAX_AGENTS {
        return Found::Unknown;
    }
    let alone = task.starts.iter().zip(task.costs).map(|(&start, costs)| u64::from(costs[start as usize]));
    let mut search = JointAstar {
        task,
        nodes: Vec::new(),
        vertices: Vec::new(),
        known: HashTable::new(),
        open: Vec::new(),
        least: alone.sum(),
        num_idle: 0,
        is_cut_off: false,
    };
    // An agent that starts on its goal does not leave before the first step.
    let root = Node { resting: 0, cost: 0, parent: None };
    if task.leaves {
        search.generate(task.starts, root);
    } else {
        search.arrive(task.starts, root);
    }
    search.run(clock)
}

impl JointAstar<'_> {
    fn run(&mut self, clock: &mut Clock) -> Found {
        let num_agents = self.task.starts.len();
        let mut bucket = 0;
        while bucket < self.open.len() && !self.is_cut_off {
            let Some(index) = self.open[bucket].pop() else {
                bucket += 1;
                continue;
            };
            let node = self.nodes[index as usize];
            let from = self.state(index).to_vec();
            if self.find(hash(&from, node.resting), &from, node.resting) != Some(index) {
                continue;
            }
            if node.resting.count_ones() as usize == num_agents {
                return Found::Paths(self.paths(index));
            }
            if clock.is_spent() {
                return Found::Unknown;
            }
            let num_moving = num_agents as u32 - node.resting.count_ones();
            let next = Node { resting: node.resting, cost: node.cost + num_moving, parent: Some(index) };
            self.assign(&from, &mut from.clone(), 0, next);
        }
        if self.is_cut_off { Found::Unknown } else { Found::Nothing }
    }

    fn state(&self, node: u32) -> &[Vertex] {
        let num_agents = self.task.starts.len();
        &self.vertices[node as usize * num_agents..][..num_agents]
    }

    /// Assigns the moves of a step to an agent and to those after it.
    ///
    /// A crowd has many joint moves, and possibly even more partial assignments that cannot be completed. Both are
    /// limited.
    fn assign(&mut self, from: &[Vertex], to: &mut [Vertex], agent: usize, next: Node) {
        self.is_cut_off |= self.num_idle > self.task.max_states;
        if self.is_cut_off {
            return;
        }
        if agent == to.len() {
            self.num_idle = 0;
            return self.arrive(to, next);
        }
        self.num_idle += 1;
        let (here, graph) = (from[agent], self.task.graph);
        let around = if next.rests(agent) { &[][..] } else { graph.neighbours(here) };
        for &vertex in around.iter().chain([&here]) {
            let conflicts = |other: usize| {
                let is_gone = self.task.leaves && (next.rests(other) || next.rests(agent));
                !is_gone && (to[other] == vertex || (to[other] == here && from[other] == vertex))
            };
            if !(0..agent).any(conflicts) {
                to[agent] = vertex;
                self.assign(from, to, agent + 1, next);
            }
        }
        to[agent] = here;
    }

    /// Generates the nodes of a joint state. If agents leave, generates a single node. Otherwise, generates one node
    /// for each subset of the agents on their goals; in that node, the subset rests from now on.
    fn arrive(&mut self, to: &[Vertex], node: Node) {
        let arrived = (0..to.len())
            .filter(|&agent| !node.rests(agent) && to[agent] == self.task.goals[agent])
            .fold(0, |agents, agent| agents | 1 << agent);
        let mut resting = arrived;
        loop {
            self.generate(to, Node { resting: node.resting | resting, ..node });
            if resting == 0 || self.task.leaves || self.is_cut_off {
                return;
            }
            resting = (resting - 1) & arrived;
        }
    }

    /// Adds a node, unless its joint state was reached at the same or a lower cost.
    fn generate(&mut self, to: &[Vertex], node: Node) {
        let hash = hash(to, node.resting);
        let known = self.find(hash, to, node.resting);
        if known.is_some_and(|known| self.nodes[known as usize].cost <= node.cost) {
            return;
        }
        if self.nodes.len() >= self.task.max_states {
            self.is_cut_off = true;
            return;
        }
        let moving = (0..to.len()).filter(|&agent| !node.rests(agent));
        let to_go: u64 = moving.map(|agent| u64::from(self.task.costs[agent][to[agent] as usize])).sum();
        let bucket = (u64::from(node.cost) + to_go - self.least) as usize;
        if self.open.len() <= bucket {
            self.open.resize_with(bucket + 1, Vec::new);
        }
        let index = self.nodes.len() as u32;
        self.open[bucket].push(index);
        self.nodes.push(node);
        self.vertices.extend_from_slice(to);
        match known {
            Some(old) => {
                if let Some(entry) = self.known.find_mut(hash, |&(_, node)| node == old) {
                    entry.1 = index;
                }
            }
            None => {
                self.known.insert_unique(hash, (hash, index), |&(hash, _)| hash);
            }
        }
    }

    /// Returns the best node of a joint state.
    fn find(&self, hash: u64, vertices: &[Vertex], resting: u32) -> Option<u32> {
        let is_same = |&(_, node): &(u64, u32)| {
            self.nodes[node as usize].resting == resting && self.state(node) == vertices
        };
        self.known.find(hash, is_same).map(|&(_, node)| node)
    }

    /// Returns the paths that lead to a node in which all agents rest.
    fn paths(&self, last: u32) -> Vec<Vec<Vertex>> {
        let parent = |&node: &u32| self.nodes[node as usize].parent;
        let mut nodes: Vec<u32> = std::iter::successors(Some(last), parent).collect();
        nodes.reverse();
        let path = |agent: usize| {
            let moves = nodes.iter().position(|&node| self.nodes[node as usize].rests(agent));
            let num_steps = moves.unwrap_or(nodes.len() - 1);
            nodes[..=num_steps].iter().map(|&node| self.state(node)[agent]).collect()
        };
        (0..self.task.starts.len()).map(path).collect()
    }
}

fn hash(vertices: &[Vertex], resting: u32) -> u64 {
    let mut hasher = FxHasher::default();
    vertices.hash(&mut hasher);
    resting.hash(&mut hasher);
    hasher.finish()
}
