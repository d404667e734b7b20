//! Priority-based search: agents get in each other's way until it is said who of them goes first.
//!
//! Source: Ma et al., "Searching with Consistent Prioritization for Multi-Agent Path Finding", AAAI 2019
//!
//! | paper | here |
//! | --- | --- |
//! | priority tree node | `Node` |
//! | i ≺ j | a pair in `Node::pairs`, the first of which goes first |
//! | plan, N.plan | `Node::paths` |

use std::sync::Arc;

use crate::conflict::{Paths, Setting, first_conflict, one_leg_each};
use crate::graph::Graph;
use crate::problem::{Budget, Clock, Outcome, Planner, Problem};
use crate::reservations::Reservations;
use crate::sipp::{Order, Sipp, Task};

/// How [`Pbs`] plans.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PbsParams {
    /// Chooses among what is equally good.
    pub seed: u64,
}

/// Priority-based search for whole problems. It finds a plan for nearly all of them, not for all, and never proves
/// that there is none.
///
/// A node of its budget is one search for one agent.
#[derive(Clone, Debug, Default)]
pub struct Pbs {
    params: PbsParams,
}

impl Pbs {
    /// A planner with these settings.
    pub fn new(params: PbsParams) -> Self {
        Self { params }
    }
}

impl Planner for Pbs {
    fn name(&self) -> &'static str {
        "pbs"
    }

    fn plan(&mut self, problem: &Problem, budget: &Budget) -> Outcome {
        let mut clock = budget.start();
        let costs = match problem.survey(&mut clock) {
            Ok(costs) => costs,
            Err(outcome) => return outcome,
        };
        let legs = one_leg_each(&costs);
        let setting = Setting::one_shot(problem, &legs, self.params.seed);
        let mut sipp = Sipp::new(problem.graph.clone());
        let lower_bound = problem.lower_bound(&costs);
        match search(&mut sipp, &problem.graph, &setting, &mut clock) {
            Some(paths) => paths.outcome(problem, lower_bound),
            None => clock.unsolved(None, lower_bound),
        }
    }
}

/// Paths without conflict, if the search comes upon some while there is time.
pub(crate) fn search(
    sipp: &mut Sipp,
    graph: &Graph,
    setting: &Setting<'_>,
    clock: &mut Clock,
) -> Option<Paths> {
    let mut search = Search { setting, sipp, clock, reserved: Reservations::new(graph.num_vertices()) };
    let mut stack = vec![search.root()?];
    while let Some(node) = stack.pop() {
        let Some(conflict) = first_conflict(&node.paths, graph.num_vertices()) else {
            return Some(node.paths);
        };
        let (one, other) = conflict.agents;
        let mut children: Vec<Node> =
            [(one, other), (other, one)].into_iter().filter_map(|pair| search.child(&node, pair)).collect();
        if search.clock.is_spent() {
            return None;
        }
        // The better child is looked at first.
        children.sort_by_key(|child| std::cmp::Reverse(child.paths.total_cost()));
        stack.extend(children);
    }
    None
}

/// Who goes before whom, and the paths that keep to it.
#[derive(Clone, Debug)]
struct Node {
    pairs: Vec<(usize, usize)>,
    paths: Paths,
}

struct Search<'a> {
    setting: &'a Setting<'a>,
    sipp: &'a mut Sipp,
    clock: &'a mut Clock,
    reserved: Reservations,
}

impl Search<'_> {
    /// Every agent as if it were alone.
    fn root(&mut self) -> Option<Node> {
        let mut paths = Paths::new(self.setting.starts.len(), self.setting.stays());
        for agent in 0..self.setting.starts.len() {
            self.plan(agent, &[], &mut paths)?;
        }
        Some(Node { pairs: Vec::new(), paths })
    }

    /// The node with one pair more, unless an agent then has no path.
    fn child(&mut self, node: &Node, pair: (usize, usize)) -> Option<Node> {
        let (first, second) = pair;
        let mut pairs = node.pairs.clone();
        pairs.push(pair);
        let order = Ranks::new(self.setting.starts.len(), &pairs);
        if order.above(second).contains(&second) || order.above(first).contains(&second) {
            return None;
        }
        let mut paths = node.paths.clone();
        for agent in order.from(second) {
            let above = order.above(agent);
            if agent == second || above.iter().any(|&higher| paths.collide(agent, higher)) {
                self.plan(agent, &above, &mut paths)?;
            }
        }
        Some(Node { pairs, paths })
    }

    /// Plans for an agent past those that go before it.
    fn plan(&mut self, agent: usize, above: &[usize], paths: &mut Paths) -> Option<()> {
        if self.clock.count_node() {
            return None;
        }
        for &higher in above {
            self.reserved.add(higher, paths.path(higher), paths.stays);
        }
        let task = Task {
            start: self.setting.starts[agent],
            legs: &self.setting.legs[agent],
            reserved: &self.reserved,
            avoided: None,
            banned: &[],
            horizon: self.setting.horizon,
            order: Order::Cost,
            salt: self.setting.salt,
        };
        let way = self.sipp.find(&task);
        for &higher in above {
            self.reserved.remove(higher, paths.path(higher), paths.stays);
        }
        let way = way?;
        paths.set(agent, Arc::new(way.path), way.cost);
        Some(())
    }
}

/// Who goes directly before and after each agent.
struct Ranks {
    before: Vec<Vec<usize>>,
    after: Vec<Vec<usize>>,
}

impl Ranks {
    fn new(num_agents: usize, pairs: &[(usize, usize)]) -> Self {
        let mut ranks = Self { before: vec![Vec::new(); num_agents], after: vec![Vec::new(); num_agents] };
        for &(first, second) in pairs {
            ranks.before[second].push(first);
            ranks.after[first].push(second);
        }
        ranks
    }

    /// All that go before an agent.
    fn above(&self, agent: usize) -> Vec<usize> {
        let mut seen = vec![false; self.before.len()];
        let mut found = Vec::new();
        let mut stack = self.before[agent].clone();
        while let Some(higher) = stack.pop() {
            if !std::mem::replace(&mut seen[higher], true) {
                found.push(higher);
                stack.extend(&self.before[higher]);
            }
        }
        found
    }

    /// An agent and all that go after it, those that go first first.
    fn from(&self, agent: usize) -> Vec<usize> {
        let mut seen = vec![false; self.after.len()];
        let mut done = Vec::new();
        let mut stack = vec![(agent, 0)];
        seen[agent] = true;
        while let Some((at, next)) = stack.last_mut() {
            let Some(&lower) = self.after[*at].get(*next) else {
                done.push(*at);
                stack.pop();
                continue;
            };
            *next += 1;
            if !std::mem::replace(&mut seen[lower], true) {
                stack.push((lower, 0));
            }
        }
        done.reverse();
        done
    }
}
