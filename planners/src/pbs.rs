//! Priority-based search (PBS): each conflict is resolved by a priority between its two agents.
//!
//! Source: Ma et al., "Searching with Consistent Prioritization for Multi-Agent Path Finding", AAAI 2019
//!
//! | paper | here |
//! | --- | --- |
//! | priority tree node | [`Node`] |
//! | i ≺ j | the pair (i, j) in [`Node::priorities`]; i has the higher priority |
//! | plan, N.plan | [`Node::paths`] |

use std::sync::Arc;

use crate::budget::{Budget, Clock};
use crate::conflicts::first_conflict;
use crate::graph::Graph;
use crate::outcome::Outcome;
use crate::paths::Paths;
use crate::planner::Planner;
use crate::problem::Problem;
use crate::reservations::Reservations;
use crate::sipp::Sipp;
use crate::team_task::{TeamTask, one_leg_each};

/// Parameters of [`Pbs`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PbsParams {
    /// Seed of tie-breaking.
    pub seed: u64,
}

/// The planner PBS. It is incomplete: only the checks before the search can prove a problem impossible.
///
/// Its node budget counts single-agent searches.
#[derive(Clone, Debug, Default)]
pub struct Pbs {
    params: PbsParams,
}

impl Pbs {
    /// Creates a planner with these parameters.
    pub fn new(params: PbsParams) -> Self {
        Self { params }
    }
}

impl Planner for Pbs {
    fn plan(&mut self, problem: &Problem, budget: &Budget) -> Outcome {
        problem.solve(budget, |costs, mut clock| {
            let legs = one_leg_each(costs);
            let team = TeamTask::one_shot(problem, &legs, self.params.seed);
            let mut sipp = Sipp::new(problem.graph.clone());
            let lower_bound = problem.lower_bound(costs);
            match search(&mut sipp, &problem.graph, &team, &mut clock) {
                Some(paths) => paths.outcome(problem, lower_bound),
                None => clock.unsolved(None, lower_bound),
            }
        })
    }
}

/// Searches for conflict-free paths, depth-first through the priority tree.
pub(crate) fn search(
    sipp: &mut Sipp,
    graph: &Graph,
    team: &TeamTask<'_>,
    clock: &mut Clock,
) -> Option<Paths> {
    let mut search = Search { team, sipp, clock, reserved: Reservations::new(graph.num_vertices()) };
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
        // The cheaper child is expanded first.
        children.sort_by_key(|child| std::cmp::Reverse(child.paths.total_cost()));
        stack.extend(children);
    }
    None
}

/// A node of the priority tree.
#[derive(Clone, Debug)]
struct Node {
    /// Pairs of agents, the first of higher priority.
    priorities: Vec<(usize, usize)>,
    paths: Paths,
}

struct Search<'a> {
    team: &'a TeamTask<'a>,
    sipp: &'a mut Sipp,
    clock: &'a mut Clock,
    reserved: Reservations,
}

impl Search<'_> {
    /// Returns the root, in which every agent is planned alone.
    fn root(&mut self) -> Option<Node> {
        let mut paths = Paths::new(self.team.starts.len(), self.team.stays());
        for agent in 0..self.team.starts.len() {
            self.plan(agent, &[], &mut paths)?;
        }
        Some(Node { priorities: Vec::new(), paths })
    }

    /// Returns the child with one more priority, unless the priorities form a cycle or an agent has no path.
    fn child(&mut self, node: &Node, pair: (usize, usize)) -> Option<Node> {
        let second = pair.1;
        let mut priorities = node.priorities.clone();
        priorities.push(pair);
        let order = PriorityOrder::new(self.team.starts.len(), &priorities);
        if order.above(second).contains(&second) {
            return None;
        }
        let mut paths = node.paths.clone();
        for agent in order.from(second) {
            let above = order.above(agent);
            if agent == second || above.iter().any(|&higher| paths.collide(agent, higher)) {
                self.plan(agent, &above, &mut paths)?;
            }
        }
        Some(Node { priorities, paths })
    }

    /// Plans the path of an agent around agents of higher priority.
    fn plan(&mut self, agent: usize, above: &[usize], paths: &mut Paths) -> Option<()> {
        if self.clock.count_node() {
            return None;
        }
        for &higher in above {
            self.reserved.add(higher, paths.path(higher), paths.stays);
        }
        let found = self.sipp.find(&self.team.task(agent, &self.reserved));
        for &higher in above {
            self.reserved.remove(higher, paths.path(higher), paths.stays);
        }
        let found = found?;
        paths.set(agent, Arc::new(found.path), found.cost);
        Some(())
    }
}

/// The partial order of priorities, as a graph.
struct PriorityOrder {
    /// For each agent, the agents directly above it.
    before: Vec<Vec<usize>>,
    /// For each agent, the agents directly below it.
    after: Vec<Vec<usize>>,
}

impl PriorityOrder {
    fn new(num_agents: usize, pairs: &[(usize, usize)]) -> Self {
        let mut order = Self { before: vec![Vec::new(); num_agents], after: vec![Vec::new(); num_agents] };
        for &(first, second) in pairs {
            order.before[second].push(first);
            order.after[first].push(second);
        }
        order
    }

    /// Returns all agents of higher priority.
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

    /// Returns an agent and all agents of lower priority in topological order.
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
