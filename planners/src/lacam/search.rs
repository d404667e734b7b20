//! The search of LaCAM*: depth-first over configurations, each with a lazily enumerated tree of constraints.
//!
//! Papers: Okumura, "LaCAM: Search-Based Algorithm for Quick Multi-Agent Pathfinding", AAAI 2023; "Improving LaCAM for
//! Scalable Eventually Optimal Multi-Agent Pathfinding", IJCAI 2023; "Engineering LaCAM*: Towards Real-Time,
//! Large-Scale, and Near-Optimal Multi-Agent Pathfinding", AAMAS 2024.
//!
//! | paper | here |
//! | --- | --- |
//! | N, its Q | a [`Node`](crate::lacam::search_graph::Node), its configuration |
//! | the low-level tree | [`crate::lacam::constraint_tree`] |
//! | g, h | `cost`, `to_go` |
//! | Open, Explored | `open`, [`SearchGraph::find`] |

use std::collections::VecDeque;

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::distances::CostToGo;
use crate::graph::{Graph, Vertex};
use crate::lacam::objective::Objective;
use crate::lacam::search_graph::{NONE, SearchGraph};
use crate::pibt::PibtRules;
use crate::pibt::input::StepInput;
use crate::pibt::priorities::initial_priorities;
use crate::pibt::step::PibtStep;
use crate::problem::{Agent, Problem};

/// The options of a search.
#[derive(Clone, Copy, Debug)]
pub(super) struct SearchOptions {
    pub objective: Objective,
    pub pibt: PibtRules,
    /// Byte budget of the nodes.
    pub max_bytes: usize,
    pub seed: u64,
}

/// The state of a search after an expansion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Progress {
    Going,
    /// The solution improved.
    Better,
    /// No node is left to expand.
    Exhausted,
    /// The byte budget is exceeded; the search is unchanged.
    Full,
}

/// A search, which can be interrupted after every expansion.
#[derive(Debug)]
pub(super) struct Search<'a> {
    problem: &'a Problem,
    costs: &'a [CostToGo],
    options: SearchOptions,
    step: PibtStep,
    random: Pcg64Mcg,
    explored: SearchGraph,
    open: Vec<u32>,
    goal: u32,
    /// The node with the least cost to go.
    closest: u32,
    /// Nodes whose f-value reaches the bound are pruned.
    bound: u64,
    constraints: Vec<(Agent, Vertex)>,
    next: Vec<Vertex>,
}

impl<'a> Search<'a> {
    /// Creates a search of a problem with known costs to go.
    pub fn new(problem: &'a Problem, costs: &'a [CostToGo], options: SearchOptions) -> Self {
        let starts = &problem.starts[..];
        let cost = |agent: Agent| costs[agent as usize][starts[agent as usize] as usize];
        let priorities = initial_priorities(starts.len(), cost);
        Self {
            problem,
            costs,
            options,
            step: PibtStep::new(&problem.graph, options.pibt, options.seed),
            random: Pcg64Mcg::seed_from_u64(options.seed ^ 0x5eed),
            explored: SearchGraph::new(starts, priorities, options.objective.cost_to_go(costs, starts)),
            open: vec![0],
            goal: if problem.starts == problem.goals { 0 } else { NONE },
            closest: 0,
            bound: u64::MAX,
            constraints: Vec::new(),
            next: Vec::new(),
        }
    }

    /// Lowers the bound: nodes whose f-value reaches it are pruned from now on.
    pub fn set_bound(&mut self, bound: u64) {
        self.bound = self.bound.min(bound);
    }

    /// Returns the bound. If the search is exhausted, no plan costs less.
    pub fn bound(&self) -> u64 {
        self.bound
    }

    /// Returns the objective.
    pub fn objective(&self) -> Objective {
        self.options.objective
    }

    /// Returns the cost of the best solution so far.
    fn solution_cost(&self) -> Option<u64> {
        (self.goal != NONE).then(|| self.explored.get(self.goal).cost)
    }

    /// Returns the configurations of the best solution so far.
    pub fn solution(&self) -> Option<Vec<Vec<Vertex>>> {
        (self.goal != NONE).then(|| self.explored.path_to(self.goal))
    }

    /// Returns the configurations up to the one with the least cost to go.
    pub fn closest(&self) -> Vec<Vec<Vertex>> {
        self.explored.path_to(self.closest)
    }

    /// Generates one successor of the node on top of the stack, or pops the node if it is pruned or exhausted.
    pub fn expand(&mut self) -> Progress {
        let Some(&top) = self.open.last() else {
            return Progress::Exhausted;
        };
        let node = self.explored.get(top);
        let constraints = match node.constraints {
            Some(constraints) if node.cost + node.to_go < self.bound && top != self.goal => constraints,
            _ => {
                self.open.pop();
                return Progress::Going;
            }
        };
        if self.explored.num_bytes() > self.options.max_bytes {
            return Progress::Full;
        }
        let (graph, now, order) =
            (&self.problem.graph, self.explored.configuration(top), self.explored.order(top));
        // A hash of the node, so that equal digits lead different nodes to different vertices.
        let turn = u64::from(top).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
        constraints.write_constraints(graph, now, order, turn, &mut self.constraints);
        let after = constraints.after(graph, now, order);
        self.explored.get_mut(top).constraints = after;
        if !self.generate(top) {
            return Progress::Going;
        }
        let next = std::mem::take(&mut self.next);
        let progress = self.reach(top, &next);
        self.next = next;
        progress
    }

    /// Writes a successor configuration of a node into `next`; returns whether PIBT found one.
    fn generate(&mut self, node: u32) -> bool {
        let (graph, goals): (&Graph, _) = (&self.problem.graph, &self.problem.goals[..]);
        let (now, order) = (self.explored.configuration(node), self.explored.order(node));
        let input = StepInput { graph, now, goals, costs: self.costs, order };
        let next = self.step.run(&input, &self.constraints);
        if let Some(next) = next {
            self.next.clear();
            self.next.extend_from_slice(next);
        }
        next.is_some()
    }

    /// Connects a node to a successor configuration, and opens the successor.
    fn reach(&mut self, from: u32, next: &[Vertex]) -> Progress {
        let before = self.solution_cost();
        if let Some(to) = self.explored.find(next) {
            self.explored.connect(from, to);
            self.relax(from, to);
            // Returning to a deep node finds little, so the search occasionally restarts from the root.
            let again = if self.random.next_u32().is_multiple_of(1000) { 0 } else { to };
            self.open.push(again);
        } else {
            let to = self.add(from, next);
            self.explored.connect(from, to);
            let node = self.explored.get(to);
            if node.cost + node.to_go < self.bound {
                self.open.push(to);
            }
        }
        let is_better = self.solution_cost().is_some_and(|cost| before.is_none_or(|before| cost < before));
        if !is_better {
            return Progress::Going;
        }
        self.bound = self.bound.min(self.solution_cost().unwrap_or(u64::MAX));
        Progress::Better
    }

    fn add(&mut self, from: u32, next: &[Vertex]) -> u32 {
        let (objective, goals) = (self.options.objective, &self.problem.goals[..]);
        let step = objective.step_cost(self.explored.configuration(from), next, goals);
        let (cost, to_go) = (self.explored.get(from).cost + step, objective.cost_to_go(self.costs, next));
        let node = self.explored.add(next, from, goals, (cost, to_go));
        if to_go < self.explored.get(self.closest).to_go {
            self.closest = node;
        }
        if self.goal == NONE && next == goals {
            self.goal = node;
        }
        node
    }

    /// Propagates the cost of a node along a new edge, and from there along all edges to nodes that become cheaper.
    ///
    /// The costs along all other edges are already consistent.
    fn relax(&mut self, from: u32, to: u32) {
        let (objective, goals) = (self.options.objective, &self.problem.goals[..]);
        let mut edges = VecDeque::from([(from, to)]);
        while let Some((from, to)) = edges.pop_front() {
            let (now, next) = (self.explored.configuration(from), self.explored.configuration(to));
            let cost = self.explored.get(from).cost + objective.step_cost(now, next, goals);
            let node = self.explored.get_mut(to);
            if cost >= node.cost {
                continue;
            }
            (node.cost, node.parent) = (cost, from);
            if to != self.goal && cost + node.to_go < self.bound {
                self.open.push(to);
            }
            edges.extend(self.explored.successors(to).map(|next| (to, next)));
        }
    }
}
