//! Enhanced CBS (ECBS): plans whose sum of costs is within a factor of the optimum.
//!
//! Source: Barer et al., "Suboptimal Variants of the Conflict-Based Search Algorithm for the Multi-Agent Pathfinding
//! Problem", Symposium on Combinatorial Search 2014
//!
//! | paper | here |
//! | --- | --- |
//! | w | [`EcbsParams::weight`] |
//! | LB | `lower_bound` |
//! | OPEN, FOCAL | [`FocalQueue`] |
//! | fmin(i) | [`crate::cbs::node::Node::least`] |
//!
//! The low level searches for the least cost first, and then for few conflicts within the suboptimality bound, with
//! the soft constraints of [`crate::sipp`].

use crate::budget::{Budget, Clock};
use crate::cbs::focal::FocalQueue;
use crate::cbs::low_level::{Aim, LowLevel};
use crate::cbs::memory::MemoryUse;
use crate::cbs::node::split;
use crate::cbs::unsolvable::{EXHAUSTED, UnsolvabilityCheck};
use crate::graph::Graph;
use crate::outcome::Outcome;
use crate::paths::Paths;
use crate::planner::Planner;
use crate::problem::Problem;
use crate::sipp::Sipp;
use crate::team_task::{TeamTask, one_leg_each};

/// Parameters of [`Ecbs`].
#[derive(Clone, Debug, PartialEq)]
pub struct EcbsParams {
    /// The suboptimality bound: a plan costs at most this many times the optimum. Values up to 1 mean optimal plans.
    pub weight: f64,
    /// Seed of tie-breaking.
    pub seed: u64,
    /// Byte budget of the constraint tree. If it is exceeded, the planner gives up.
    pub max_bytes: usize,
}

impl Default for EcbsParams {
    fn default() -> Self {
        Self { weight: 1.2, seed: 0, max_bytes: MemoryUse::DEFAULT_BYTES }
    }
}

/// The planner ECBS, which is bounded-suboptimal. Its node budget counts nodes of the constraint tree.
///
/// If an impossible problem is small or has a step limit, the planner proves that it is impossible. [`crate::Cbs`]
/// proves more, because it also checks small groups of agents.
#[derive(Clone, Debug, Default)]
pub struct Ecbs {
    params: EcbsParams,
}

impl Ecbs {
    /// Creates a planner with these parameters.
    pub fn new(params: EcbsParams) -> Self {
        Self { params }
    }
}

impl Planner for Ecbs {
    fn plan(&mut self, problem: &Problem, budget: &Budget) -> Outcome {
        problem.solve(budget, |costs, mut clock| {
            let legs = one_leg_each(costs);
            let team = TeamTask::one_shot(problem, &legs, self.params.seed);
            let mut sipp = Sipp::new(problem.graph.clone());
            let mut check = UnsolvabilityCheck::default();
            let prove_impossible = |clock: &mut Clock| check.count(problem, clock);
            match search(&mut sipp, &problem.graph, &team, &self.params, &mut clock, prove_impossible) {
                Found::Paths { paths, lower_bound } => paths.outcome(problem, lower_bound),
                Found::Unknown { lower_bound } => {
                    clock.unsolved(None, lower_bound.max(problem.lower_bound(costs)))
                }
                Found::Impossible(reason) => Outcome::Impossible { reason },
            }
        })
    }
}

/// The result of a search.
pub(crate) enum Found {
    /// Paths without conflicts.
    Paths { paths: Paths, lower_bound: u64 },
    /// No paths within the budget; no plan costs less than the lower bound.
    Unknown { lower_bound: u64 },
    /// A proof that no paths exist, in words.
    Impossible(String),
}

/// Searches for conflict-free paths within the suboptimality bound. Before each expansion, `prove_impossible` may
/// return a proof that no such paths exist.
pub(crate) fn search(
    sipp: &mut Sipp,
    graph: &Graph,
    team: &TeamTask<'_>,
    params: &EcbsParams,
    clock: &mut Clock,
    mut prove_impossible: impl FnMut(&mut Clock) -> Option<String>,
) -> Found {
    // `max` also replaces NaN with 1.
    let weight = params.weight.max(1.0);
    let mut low = LowLevel::new(sipp, graph, team, Aim::Within(weight));
    if clock.count_node() {
        return Found::Unknown { lower_bound: 0 };
    }
    let Some(root) = low.root(clock) else { return Found::Unknown { lower_bound: 0 } };
    let mut queue = FocalQueue::new(weight, graph.num_vertices(), MemoryUse::new(params.max_bytes));
    queue.insert(root);
    while let Some((entry, lower_bound)) = queue.pop() {
        let Some(conflict) = entry.conflict else {
            return Found::Paths { paths: entry.node.paths, lower_bound };
        };
        if clock.count_node() || clock.is_spent() || queue.memory.is_full() {
            return Found::Unknown { lower_bound };
        }
        if let Some(reason) = prove_impossible(clock) {
            return Found::Impossible(reason);
        }
        for constraint in split(&conflict) {
            if let Some(child) = low.child(&entry.node, constraint) {
                queue.insert(child);
            }
        }
    }
    Found::Impossible(EXHAUSTED.to_owned())
}
