//! The best way of one agent past others whose ways are known.
//!
//! A cell that others cross is free in intervals; whoever is in it first within one can be there whenever else
//! within the same. So the search looks at intervals, not at steps.
//!
//! Source: Phillips and Likhachev, "SIPP: Safe Interval Path Planning for Dynamic Environments", ICRA 2011; the soft
//! intervals: Li et al., "MAPF-LNS2: Fast Repairing for Multi-Agent Path Finding via Large Neighborhood Search",
//! AAAI 2022
//!
//! | paper | here |
//! | --- | --- |
//! | configuration | `vertex` |
//! | safe interval | that which ends with `until` |
//! | g, h, f | `cost`, `to_go`, their sum |
//! | soft obstacle, c-value | `Task::avoided`, `conflicts` |

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use crate::distances::{CostToGo, UNREACHABLE};
use crate::graph::{Graph, Vertex};
use crate::reservations::{FOREVER, Reservations};

/// What one agent is to do.
#[derive(Clone, Copy, Debug)]
pub struct Task<'a> {
    /// Where the agent is.
    pub start: Vertex,
    /// Its goals, in the order in which it is to go there.
    pub legs: &'a [Leg],
    /// What it must keep clear of.
    pub reserved: &'a Reservations,
    /// What it should rather keep clear of.
    pub avoided: Option<&'a Reservations>,
    /// Moves it must not make: from where, to where, and the step that they end at.
    pub banned: &'a [(Vertex, Vertex, u32)],
    /// When it is done.
    pub horizon: Horizon,
    /// What is best.
    pub order: Order,
    /// Chooses among equally good ways.
    pub salt: u32,
}

/// One goal.
#[derive(Clone, Debug)]
pub struct Leg {
    /// The costs to go there.
    pub to_go: CostToGo,
    /// What the goals after it cost, from there on.
    pub then: u32,
}

impl Leg {
    /// The only goal, or the last.
    pub fn last(to_go: CostToGo) -> Self {
        Self { to_go, then: 0 }
    }
}

/// When an agent is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Horizon {
    /// When it is at its one goal and can stay there for ever, after so many steps at most.
    Stay {
        /// Most steps.
        at_most: u32,
    },
    /// After so many steps, wherever it is: what would happen later counts not.
    Window(u32),
}

/// What makes a way better than another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Few steps, and of those ways the fewest conflicts with what should be avoided.
    Cost,
    /// Few conflicts with what should be avoided, and of those ways the fewest steps; of at most so many steps.
    Conflicts {
        /// Most steps that the way may cost.
        at_most: u32,
    },
}

/// A way that was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Way {
    /// The vertex at the start and after each step.
    pub path: Vec<Vertex>,
    /// Steps until it reaches its last goal; beyond a window, as if it were alone.
    pub cost: u32,
    /// Conflicts with what should be avoided.
    pub conflicts: u32,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    vertex: Vertex,
    time: u32,
    until: u32,
    /// Number of goals reached.
    phase: u32,
    cost: u32,
    conflicts: u32,
    parent: u32,
    /// The node made before in the same vertex.
    sibling: u32,
}

const NONE: u32 = u32::MAX;

/// The order in which nodes are looked at, and the node.
type Entry = Reverse<(u32, u32, u32, u32)>;

/// The search, which keeps its memory from one task to the next.
#[derive(Debug)]
pub struct Sipp {
    graph: Arc<Graph>,
    nodes: Vec<Node>,
    queue: BinaryHeap<Entry>,
    /// The node made last in each vertex, and the search that made it.
    latest: Vec<(u32, u32)>,
    round: u32,
}

impl Sipp {
    /// A search on a graph.
    pub fn new(graph: Arc<Graph>) -> Self {
        let latest = vec![(0, NONE); graph.num_vertices()];
        Self { graph, nodes: Vec::new(), queue: BinaryHeap::new(), latest, round: 0 }
    }

    /// The best way, if there is one.
    pub fn find(&mut self, task: &Task<'_>) -> Option<Way> {
        self.nodes.clear();
        self.queue.clear();
        self.round = self.round.wrapping_add(1);
        self.open_start(task);
        while let Some(Reverse((_, _, _, index))) = self.queue.pop() {
            let node = self.nodes[index as usize];
            if task.is_end(&node) {
                return Some(self.way(task, index));
            }
            if self.is_dominated(&node, index) {
                continue;
            }
            self.wait_out(task, &node, index);
            self.wait_further(task, &node, index);
            for next in 0..self.graph.neighbours(node.vertex).len() {
                self.move_to(task, &node, index, self.graph.neighbours(node.vertex)[next]);
            }
        }
        None
    }

    fn open_start(&mut self, task: &Task<'_>) {
        let Some((0, until)) = task.reserved.free_after(task.start, 0) else { return };
        let node = Node {
            vertex: task.start,
            time: 0,
            until,
            phase: 0,
            cost: 0,
            conflicts: 0,
            parent: NONE,
            sibling: NONE,
        };
        self.open(task, task.split(node));
    }

    /// At the end of a window an agent may stand where it waits.
    fn wait_out(&mut self, task: &Task<'_>, node: &Node, index: u32) {
        let Horizon::Window(last) = task.horizon else { return };
        if node.until >= last {
            let cost = node.cost + last - node.time;
            self.open(task, Node { time: last, cost, parent: index, ..*node });
        }
    }

    /// Where others should be avoided, intervals are cut; an agent may wait from one into the next.
    fn wait_further(&mut self, task: &Task<'_>, node: &Node, index: u32) {
        if task.avoided.is_none() || node.until == FOREVER {
            return;
        }
        let time = node.until + 1;
        let Some((since, until)) = task.reserved.free_after(node.vertex, time) else { return };
        if since > node.until || task.is_over(time) {
            return;
        }
        let cost = task.cost_after(node, time);
        let next = Node { time, until, cost, parent: index, ..*node };
        self.open(task, task.split(next));
    }

    fn move_to(&mut self, task: &Task<'_>, node: &Node, index: u32, vertex: Vertex) {
        let latest = node.until.saturating_add(1);
        let mut from = node.time + 1;
        while from <= latest && !task.is_over(from) {
            let Some((since, until)) = task.reserved.free_after(vertex, from) else { return };
            let mut time = since.max(from);
            while time <= latest.min(until) && task.is_barred(node.vertex, vertex, time) {
                time += 1;
            }
            if time > latest || task.is_over(time) {
                return;
            }
            if time <= until {
                let cost = task.cost_after(node, time);
                let swaps = task.avoided.map_or(0, |avoided| avoided.num_swaps(node.vertex, vertex, time));
                let conflicts = node.conflicts + swaps;
                let next = Node { vertex, time, until, cost, conflicts, parent: index, ..*node };
                let next = task.split(next);
                self.open(task, next);
                from = next.until.saturating_add(1);
            } else {
                from = until.saturating_add(1);
            }
            if from == FOREVER {
                return;
            }
        }
    }

    /// Takes a node in, with the goals that it reaches.
    fn open(&mut self, task: &Task<'_>, mut node: Node) {
        let reaches = |node: &Node| {
            task.legs.get(node.phase as usize).is_some_and(|leg| leg.to_go[node.vertex as usize] == 0)
        };
        match task.horizon {
            Horizon::Window(_) => {
                while reaches(&node) {
                    node.phase += 1;
                }
            }
            Horizon::Stay { .. } => {
                if reaches(&node)
                    && task
                        .reserved
                        .free_after(node.vertex, node.time)
                        .is_some_and(|(since, until)| since <= node.time && until == FOREVER)
                {
                    let to_come = |avoided: &Reservations| avoided.num_after(node.vertex, node.time);
                    let conflicts = node.conflicts + task.avoided.map_or(0, to_come);
                    self.put(task, Node { phase: 1, conflicts, ..node });
                }
            }
        }
        self.put(task, node);
    }

    /// Puts a node into the queue unless a better one is known.
    fn put(&mut self, task: &Task<'_>, mut node: Node) {
        let Some(bound) = task.bound(&node) else { return };
        let latest = &mut self.latest[node.vertex as usize];
        if latest.0 != self.round {
            *latest = (self.round, NONE);
        }
        node.sibling = latest.1;
        if !task.is_end(&node) && self.is_beaten(&node) {
            return;
        }
        let index = self.nodes.len() as u32;
        self.latest[node.vertex as usize].1 = index;
        self.nodes.push(node);
        let salted = (node.vertex ^ task.salt).wrapping_mul(0x9e37_79b1) >> 24;
        let tie = (!node.time << 8) | salted;
        self.queue.push(Reverse(match task.order {
            Order::Cost => (bound, node.conflicts, tie, index),
            Order::Conflicts { .. } => (node.conflicts, bound, tie, index),
        }));
    }

    /// Whether a node made before is as good in everything.
    fn is_beaten(&self, node: &Node) -> bool {
        self.siblings(node).any(|other| other.covers(node))
    }

    /// Whether a node made since is better.
    fn is_dominated(&self, node: &Node, index: u32) -> bool {
        let latest = self.latest[node.vertex as usize].1;
        let mut at = latest;
        while at != NONE && at > index {
            let other = &self.nodes[at as usize];
            if other.covers(node) {
                return true;
            }
            at = other.sibling;
        }
        false
    }

    fn siblings(&self, node: &Node) -> impl Iterator<Item = &Node> {
        let mut at = node.sibling;
        std::iter::from_fn(move || {
            let other = self.nodes.get(at as usize)?;
            at = other.sibling;
            Some(other)
        })
    }

    fn way(&self, task: &Task<'_>, end: u32) -> Way {
        let last = self.nodes[end as usize];
        let mut path = vec![last.vertex; last.time as usize + 1];
        let (mut at, mut until) = (end, last.time as usize + 1);
        while at != NONE {
            let node = &self.nodes[at as usize];
            path[node.time as usize..until].fill(node.vertex);
            until = node.time as usize;
            at = node.parent;
        }
        if let Horizon::Window(steps) = task.horizon {
            path.resize(steps as usize + 1, last.vertex);
        }
        Way { path, cost: task.bound(&last).unwrap_or(last.cost), conflicts: last.conflicts }
    }
}

impl Node {
    /// Whether this node is in the same interval no later, and no worse.
    fn covers(&self, other: &Self) -> bool {
        self.vertex == other.vertex
            && self.until == other.until
            && self.phase == other.phase
            && self.time <= other.time
            && self.cost <= other.cost
            && self.conflicts <= other.conflicts
    }
}

impl Task<'_> {
    /// What the whole way costs at least, unless it cannot be.
    fn bound(&self, node: &Node) -> Option<u32> {
        let bound = match self.legs.get(node.phase as usize) {
            Some(leg) if leg.to_go[node.vertex as usize] == UNREACHABLE => return None,
            Some(leg) => node.cost + leg.to_go[node.vertex as usize] + leg.then,
            None => node.cost,
        };
        let longest = match self.horizon {
            Horizon::Stay { at_most } => at_most,
            Horizon::Window(_) => u32::MAX,
        };
        let dearest = match self.order {
            Order::Cost => u32::MAX,
            Order::Conflicts { at_most } => at_most,
        };
        (bound <= longest.min(dearest)).then_some(bound)
    }

    fn is_end(&self, node: &Node) -> bool {
        let is_through = node.phase as usize == self.legs.len();
        match self.horizon {
            Horizon::Stay { .. } => is_through,
            Horizon::Window(last) => node.time >= last || (is_through && node.until >= last),
        }
    }

    /// Whether a step is not to be looked at.
    fn is_over(&self, time: u32) -> bool {
        matches!(self.horizon, Horizon::Window(last) if time > last)
    }

    /// An agent that is through with its goals has no cost.
    fn cost_after(&self, node: &Node, time: u32) -> u32 {
        let is_through = node.phase as usize == self.legs.len();
        if is_through { node.cost } else { node.cost + time - node.time }
    }

    fn is_barred(&self, from: Vertex, to: Vertex, time: u32) -> bool {
        self.banned.contains(&(from, to, time)) || self.reserved.num_swaps(from, to, time) > 0
    }

    /// The node's part of its interval in which as many are to be avoided, and them counted.
    fn split(&self, node: Node) -> Node {
        let Some(avoided) = self.avoided else { return node };
        let (crowd, until) = avoided.crowd(node.vertex, node.time);
        let until = match self.horizon {
            Horizon::Window(last) if until >= last => node.until,
            _ => until.min(node.until),
        };
        Node { until, conflicts: node.conflicts + crowd, ..node }
    }
}
