//! The A* of SIPP.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use crate::graph::{Graph, Vertex};
use crate::reservations::{FOREVER, Reservations};
use crate::sipp::node::Node;
use crate::sipp::task::{Horizon, Order, Task, TimedPath};

const NONE: u32 = u32::MAX;

/// In the high bits, the key that orders the nodes for expansion; in the lowest 32 bits, the index of the node.
type Entry = Reverse<u128>;

/// The search, which reuses its memory for the next task.
#[derive(Debug)]
pub struct Sipp {
    graph: Arc<Graph>,
    nodes: Vec<Node>,
    queue: BinaryHeap<Entry>,
    /// For each vertex, the round of the last search that reached it, and the last node of that search there.
    latest: Vec<(u32, u32)>,
    round: u32,
}

impl Sipp {
    /// Creates a search of a graph.
    pub fn new(graph: Arc<Graph>) -> Self {
        let latest = vec![(0, NONE); graph.num_vertices()];
        Self { graph, nodes: Vec::new(), queue: BinaryHeap::new(), latest, round: 0 }
    }

    /// Finds the best path, if any path exists.
    pub fn find(&mut self, task: &Task<'_>) -> Option<TimedPath> {
        self.nodes.clear();
        self.queue.clear();
        self.round = self.round.wrapping_add(1);
        self.open_start(task);
        while let Some(Reverse(key)) = self.queue.pop() {
            let index = key as u32;
            let node = self.nodes[index as usize];
            if task.is_end(&node) {
                return Some(self.path(task, index));
            }
            if self.is_dominated_by_later(&node, index) {
                continue;
            }
            self.wait_to_end(task, &node, index);
            self.wait_to_next(task, &node, index);
            for next in 0..self.graph.neighbours(node.vertex).len() {
                self.move_to(task, &node, index, self.graph.neighbours(node.vertex)[next]);
            }
        }
        None
    }

    /// Opens the start node, if the start is safe.
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

    /// Waits until the end of the window.
    fn wait_to_end(&mut self, task: &Task<'_>, node: &Node, index: u32) {
        let Horizon::Window(last) = task.horizon else { return };
        if node.until >= last {
            let cost = node.cost + last - node.time;
            self.open(task, Node { time: last, cost, parent: index, ..*node });
        }
    }

    /// Waits into the next part of an interval that soft constraints split.
    fn wait_to_next(&mut self, task: &Task<'_>, node: &Node, index: u32) {
        if task.avoided.is_none() || node.until == FOREVER {
            return;
        }
        let time = node.until + 1;
        let Some((since, until)) = task.reserved.free_after(node.vertex, time) else { return };
        if since > node.until || task.is_beyond(time) {
            return;
        }
        let cost = task.cost_after(node, time);
        let next = Node { time, until, cost, parent: index, ..*node };
        self.open(task, task.split(next));
    }

    /// Moves to a neighbour, once for each of its intervals that can be reached.
    fn move_to(&mut self, task: &Task<'_>, node: &Node, index: u32, vertex: Vertex) {
        let latest = node.until.saturating_add(1);
        let mut from = node.time + 1;
        while from <= latest && !task.is_beyond(from) {
            let Some((since, until)) = task.reserved.free_after(vertex, from) else { return };
            let mut time = since.max(from);
            while time <= latest.min(until) && task.is_barred(node.vertex, vertex, time) {
                time += 1;
            }
            if time > latest || task.is_beyond(time) {
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

    /// Opens a node. On a goal, its phase advances if the horizon is a window; otherwise, if the agent can stay there
    /// for good, also opens the node in which it stays.
    #[inline]
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
                    let num_later = |avoided: &Reservations| avoided.num_after(node.vertex, node.time);
                    let conflicts = node.conflicts + task.avoided.map_or(0, num_later);
                    self.insert(task, Node { phase: 1, conflicts, ..node });
                }
            }
        }
        self.insert(task, node);
    }

    /// Inserts a node into the queue unless it is dominated or costs too much.
    fn insert(&mut self, task: &Task<'_>, mut node: Node) {
        let Some(bound) = task.bound(&node) else { return };
        let latest = &mut self.latest[node.vertex as usize];
        if latest.0 != self.round {
            *latest = (self.round, NONE);
        }
        node.sibling = latest.1;
        if !task.is_end(&node) && self.is_dominated_by_earlier(&node) {
            return;
        }
        let index = self.nodes.len() as u32;
        self.latest[node.vertex as usize].1 = index;
        self.nodes.push(node);
        let salted = (node.vertex ^ task.salt).wrapping_mul(0x9e37_79b1) >> 24;
        let tie = (!node.time << 8) | salted;
        let (first, second) = match task.order {
            Order::Cost => (bound, node.conflicts),
            Order::Conflicts { .. } => (node.conflicts, bound),
        };
        let high = u64::from(first) << 32 | u64::from(second);
        let low = u64::from(tie) << 32 | u64::from(index);
        self.queue.push(Reverse(u128::from(high) << 64 | u128::from(low)));
    }

    /// Returns whether an earlier node dominates a new one.
    fn is_dominated_by_earlier(&self, node: &Node) -> bool {
        self.siblings(node).any(|other| other.dominates(node))
    }

    /// Returns whether a later node dominates a queued one.
    fn is_dominated_by_later(&self, node: &Node, index: u32) -> bool {
        let latest = self.latest[node.vertex as usize].1;
        let mut at = latest;
        while at != NONE && at > index {
            let other = &self.nodes[at as usize];
            if other.dominates(node) {
                return true;
            }
            at = other.sibling;
        }
        false
    }

    /// Returns the earlier nodes of the same vertex.
    fn siblings(&self, node: &Node) -> impl Iterator<Item = &Node> {
        let mut at = node.sibling;
        std::iter::from_fn(move || {
            let other = self.nodes.get(at as usize)?;
            at = other.sibling;
            Some(other)
        })
    }

    /// Returns the path that ends with a node.
    fn path(&self, task: &Task<'_>, end: u32) -> TimedPath {
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
        TimedPath { path, cost: task.bound(&last).unwrap_or(last.cost), conflicts: last.conflicts }
    }
}
