//! The search of LaCAM*: depth first over configurations, each with a tree of constraints that is only counted through.
//!
//! Papers: Okumura, "LaCAM: Search-Based Algorithm for Quick Multi-Agent Pathfinding", AAAI 2023; "Improving LaCAM for
//! Scalable Eventually Optimal Multi-Agent Pathfinding", IJCAI 2023; "Engineering LaCAM*: Towards Real-Time,
//! Large-Scale, and Near-Optimal Multi-Agent Pathfinding", AAMAS 2024.
//!
//! | here | there |
//! | --- | --- |
//! | `Node`, `configurations` | N, its Q: the high-level node and where everybody is |
//! | `Constraints` | the low-level tree: who must go where, one more agent at each depth |
//! | `paid`, `ahead` | g, h: the loss of the way there, and the least that is still to come |
//! | `open`, `known` | Open, Explored |
//!
//! The loss of a step is the number of agents that are not at their goals both before and after it, so that the loss
//! of a plan is at most its sum of costs; or else it is 1, so that the loss of a plan is its number of steps.

use std::collections::{HashMap, VecDeque};

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::constraints::Constraints;
use crate::distances::CostToGo;
use crate::graph::{Graph, Vertex};
use crate::problem::Problem;
use crate::scatter::Hints;
use crate::stepper::{Agent, PibtRules, Scene, Stepper, patience_after, patience_by, sort_by_patience};

/// No node, or no edge.
const NONE: u32 = u32::MAX;

/// What a search minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Loss {
    /// Agents not at rest, summed over all steps.
    Sum,
    /// Steps.
    Steps,
}

/// How a search goes about it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SearchRules {
    pub loss: Loss,
    pub pibt: PibtRules,
    /// Most bytes that nodes may take.
    pub most_bytes: usize,
    pub seed: u64,
}

/// What one look at a node came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Progress {
    Going,
    /// There is a better way to the goals than before.
    Better,
    /// Nothing is left to look at.
    Exhausted,
    /// The nodes take all the room they may.
    Full,
}

#[derive(Debug)]
struct Node {
    parent: u32,
    paid: u64,
    ahead: u64,
    /// The next ones to be looked at, until all were.
    constraints: Option<Constraints>,
    /// The first edge to a node one step away.
    edges: u32,
    /// The next node of the same hash.
    twin: u32,
}

#[derive(Clone, Copy, Debug)]
struct Edge {
    to: u32,
    next: u32,
}

/// A search, which may be stopped after any node and taken up again.
#[derive(Debug)]
pub(crate) struct Search<'a> {
    problem: &'a Problem,
    costs: &'a [CostToGo],
    rules: SearchRules,
    hints: Hints,
    stepper: Stepper,
    random: Pcg64Mcg,
    nodes: Vec<Node>,
    edges: Vec<Edge>,
    /// For all nodes one after the other, an entry for each agent.
    configurations: Vec<Vertex>,
    orders: Vec<Agent>,
    patience: Vec<u32>,
    known: HashMap<u64, u32>,
    open: Vec<u32>,
    goal: u32,
    closest: u32,
    /// Nodes that lead to no less are left.
    bound: u64,
    forced: Vec<(Agent, Vertex)>,
    next: Vec<Vertex>,
}

impl<'a> Search<'a> {
    /// A search of a problem that passed its survey.
    pub fn new(problem: &'a Problem, costs: &'a [CostToGo], rules: SearchRules) -> Self {
        let mut search = Self {
            problem,
            costs,
            rules,
            hints: Hints::default(),
            stepper: Stepper::new(&problem.graph, rules.pibt, rules.seed),
            random: Pcg64Mcg::seed_from_u64(rules.seed ^ 0x5eed),
            nodes: Vec::new(),
            edges: Vec::new(),
            configurations: Vec::new(),
            orders: Vec::new(),
            patience: Vec::new(),
            known: HashMap::new(),
            open: Vec::new(),
            goal: NONE,
            closest: 0,
            bound: u64::MAX,
            forced: Vec::new(),
            next: Vec::new(),
        };
        search.add_root();
        search
    }

    /// The same search, in which agents follow hints as long as they can.
    pub fn following(mut self, hints: Hints) -> Self {
        self.hints = hints;
        self
    }

    /// Leaves everything from now on that leads to a loss of so much or more.
    pub fn set_bound(&mut self, bound: u64) {
        self.bound = self.bound.min(bound);
    }

    /// The loss from which on everything is left: no plan has less than that if the search is exhausted.
    pub fn bound(&self) -> u64 {
        self.bound
    }

    /// What is minimised.
    pub fn minimises(&self) -> Loss {
        self.rules.loss
    }

    /// The least loss of a way found so far.
    fn loss(&self) -> Option<u64> {
        (self.goal != NONE).then(|| self.nodes[self.goal as usize].paid)
    }

    /// The configurations on the best way to the goals found so far.
    pub fn solution(&self) -> Option<Vec<Vec<Vertex>>> {
        (self.goal != NONE).then(|| self.way_to(self.goal))
    }

    /// The configurations on the way to where least was to come.
    pub fn closest(&self) -> Vec<Vec<Vertex>> {
        self.way_to(self.closest)
    }

    /// Looks at the node on top of the stack: makes one configuration of it.
    pub fn expand(&mut self) -> Progress {
        let Some(&top) = self.open.last() else {
            return Progress::Exhausted;
        };
        let node = &self.nodes[top as usize];
        let constraints = match node.constraints {
            Some(constraints) if node.paid + node.ahead < self.bound && top != self.goal => constraints,
            _ => {
                self.open.pop();
                return Progress::Going;
            }
        };
        let mut forced = std::mem::take(&mut self.forced);
        let (graph, now, order) = (&self.problem.graph, self.configuration(top), self.order(top));
        // Spread, so that equal digits lead different nodes to different places.
        let turn = u64::from(top).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
        constraints.read(graph, now, order, turn, &mut forced);
        self.nodes[top as usize].constraints = constraints.after(graph, now, order);
        self.forced = forced;
        if self.bytes() > self.rules.most_bytes {
            return Progress::Full;
        }
        if !self.generate(top) {
            return Progress::Going;
        }
        let next = std::mem::take(&mut self.next);
        let progress = self.reach(top, &next);
        self.next = next;
        progress
    }

    fn num_agents(&self) -> usize {
        self.problem.num_agents()
    }

    fn configuration(&self, node: u32) -> &[Vertex] {
        let start = node as usize * self.num_agents();
        &self.configurations[start..start + self.num_agents()]
    }

    fn order(&self, node: u32) -> &[Agent] {
        let start = node as usize * self.num_agents();
        &self.orders[start..start + self.num_agents()]
    }

    /// Room that nodes take, roughly.
    fn bytes(&self) -> usize {
        let node = size_of::<Node>() + 3 * size_of::<u32>() * self.num_agents() + 3 * size_of::<u64>();
        self.nodes.len() * node + self.edges.len() * size_of::<Edge>()
    }

    fn way_to(&self, node: u32) -> Vec<Vec<Vertex>> {
        let parent = |&node: &u32| Some(self.nodes[node as usize].parent).filter(|&parent| parent != NONE);
        let mut way: Vec<_> =
            std::iter::successors(Some(node), parent).map(|node| self.configuration(node).to_vec()).collect();
        way.reverse();
        way
    }

    /// Puts a configuration after a node into `next`; whether there is one.
    fn generate(&mut self, node: u32) -> bool {
        let (graph, goals): (&Graph, _) = (&self.problem.graph, &self.problem.goals[..]);
        let range = node as usize * goals.len()..(node as usize + 1) * goals.len();
        let (now, order) = (&self.configurations[range.clone()], &self.orders[range]);
        let scene = Scene { graph, now, goals, costs: self.costs, order, hints: &self.hints };
        let next = self.stepper.step(&scene, &self.forced);
        if let Some(next) = next {
            self.next.clear();
            self.next.extend_from_slice(next);
        }
        next.is_some()
    }

    /// Enters a configuration that is one step after a node.
    fn reach(&mut self, from: u32, next: &[Vertex]) -> Progress {
        let hash = hash(next);
        let lost = lost(self.rules.loss, self.configuration(from), next, &self.problem.goals);
        let before = self.loss();
        if let Some(to) = self.find(hash, next) {
            self.connect(from, to);
            self.relax(from);
            // Looking once more at what lies deep finds little; now and then, all begins anew at the start.
            let again = if self.random.next_u32().is_multiple_of(1000) { 0 } else { to };
            self.open.push(again);
        } else {
            let paid = self.nodes[from as usize].paid + lost;
            let to = self.add(hash, next, from, paid);
            self.connect(from, to);
            if paid + self.nodes[to as usize].ahead < self.bound {
                self.open.push(to);
            }
        }
        let is_better = self.loss().is_some_and(|loss| before.is_none_or(|before| loss < before));
        if !is_better {
            return Progress::Going;
        }
        self.bound = self.bound.min(self.loss().unwrap_or(u64::MAX));
        Progress::Better
    }

    fn find(&self, hash: u64, configuration: &[Vertex]) -> Option<u32> {
        let mut node = *self.known.get(&hash)?;
        while node != NONE {
            if self.configuration(node) == configuration {
                return Some(node);
            }
            node = self.nodes[node as usize].twin;
        }
        None
    }

    fn add_root(&mut self) {
        let starts = self.problem.starts.clone();
        let cost = |agent: Agent| self.costs[agent as usize][starts[agent as usize] as usize];
        self.patience = patience_by(self.num_agents(), cost);
        let root = self.add_node(hash(&starts), &starts, NONE, 0);
        self.open.push(root);
    }

    fn add(&mut self, hash: u64, configuration: &[Vertex], parent: u32, paid: u64) -> u32 {
        let start = parent as usize * self.num_agents();
        for (agent, &place) in configuration.iter().enumerate() {
            let patience = self.patience[start + agent];
            let is_there = place == self.problem.goals[agent];
            self.patience.push(patience_after(patience, is_there));
        }
        self.add_node(hash, configuration, parent, paid)
    }

    /// Adds a node whose patience is already there.
    fn add_node(&mut self, hash: u64, configuration: &[Vertex], parent: u32, paid: u64) -> u32 {
        let node = self.nodes.len() as u32;
        let ahead = ahead(self.rules.loss, self.costs, configuration);
        self.configurations.extend_from_slice(configuration);
        let start = self.orders.len();
        self.orders.extend(0..configuration.len() as Agent);
        sort_by_patience(&mut self.orders[start..], &self.patience[start..]);
        let twin = self.known.insert(hash, node).unwrap_or(NONE);
        let constraints = Some(Constraints::default());
        self.nodes.push(Node { parent, paid, ahead, constraints, edges: NONE, twin });
        if ahead < self.nodes[self.closest as usize].ahead {
            self.closest = node;
        }
        if self.goal == NONE && configuration == self.problem.goals {
            self.goal = node;
        }
        node
    }

    fn connect(&mut self, from: u32, to: u32) {
        let mut edge = self.nodes[from as usize].edges;
        while edge != NONE {
            if self.edges[edge as usize].to == to {
                return;
            }
            edge = self.edges[edge as usize].next;
        }
        let next = std::mem::replace(&mut self.nodes[from as usize].edges, self.edges.len() as u32);
        self.edges.push(Edge { to, next });
    }

    /// Passes on that there may be a better way through a node.
    fn relax(&mut self, from: u32) {
        let mut queue = VecDeque::from([from]);
        while let Some(from) = queue.pop_front() {
            let mut edge = self.nodes[from as usize].edges;
            while edge != NONE {
                let Edge { to, next } = self.edges[edge as usize];
                edge = next;
                let step = lost(
                    self.rules.loss,
                    self.configuration(from),
                    self.configuration(to),
                    &self.problem.goals,
                );
                let paid = self.nodes[from as usize].paid + step;
                let node = &mut self.nodes[to as usize];
                if paid < node.paid {
                    (node.paid, node.parent) = (paid, from);
                    if to != self.goal && paid + node.ahead < self.bound {
                        self.open.push(to);
                    }
                    queue.push_back(to);
                }
            }
        }
    }
}

/// The loss of a step.
fn lost(loss: Loss, from: &[Vertex], to: &[Vertex], goals: &[Vertex]) -> u64 {
    match loss {
        Loss::Steps => u64::from(from != to),
        Loss::Sum => {
            let is_lost = |((from, to), goal): ((_, _), _)| u64::from(from != goal || to != goal);
            from.iter().zip(to).zip(goals).map(is_lost).sum()
        }
    }
}

/// The least loss that is still to come.
fn ahead(loss: Loss, costs: &[CostToGo], configuration: &[Vertex]) -> u64 {
    let costs = costs.iter().zip(configuration).map(|(costs, &vertex)| u64::from(costs[vertex as usize]));
    match loss {
        Loss::Sum => costs.sum(),
        Loss::Steps => costs.max().unwrap_or(0),
    }
}

fn hash(configuration: &[Vertex]) -> u64 {
    configuration.iter().fold(0, |hash: u64, &vertex| {
        (hash.rotate_left(5) ^ u64::from(vertex)).wrapping_mul(0x517c_c1b7_2722_0a95)
    })
}
