//! The high level of CBS: best-first search through the constraint tree.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::budget::Clock;
use crate::cbs::low_level::{Aim, LowLevel};
use crate::cbs::mdd::Mdd;
use crate::cbs::memory::MemoryUse;
use crate::cbs::node::{Node, split};
use crate::cbs::unsolvable::{EXHAUSTED, UnsolvabilityCheck};
use crate::conflicts::all_conflicts;
use crate::graph::{Graph, Vertex};
use crate::paths::{PathConflict, Paths};
use crate::problem::Problem;
use crate::sipp::{Leg, Sipp};
use crate::team_task::TeamTask;

/// Parameters of [`crate::Cbs`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CbsParams {
    /// Seed of tie-breaking.
    pub seed: u64,
    /// Byte budget of the constraint tree. If it is exceeded, the planner gives up.
    pub max_bytes: usize,
}

impl Default for CbsParams {
    fn default() -> Self {
        Self { seed: 0, max_bytes: MemoryUse::DEFAULT_BYTES }
    }
}

/// The input of a search for optimal paths of some agents.
pub(super) struct CbsTask<'a> {
    pub problem: &'a Problem,
    pub legs: &'a [Vec<Leg>],
    /// Soft constraints: paths of other agents.
    pub avoided: &'a [&'a [Vertex]],
    /// Hard constraints: paths of other agents.
    pub forbidden: &'a [&'a [Vertex]],
    /// The cost limit.
    pub max_cost: u64,
    pub max_nodes: u64,
}

/// The result of a search.
pub(super) enum Found {
    Best(Paths),
    /// No plan within the limits; no plan costs less than the lower bound.
    Unknown {
        lower_bound: u64,
        is_full: bool,
    },
    /// A proof that no plan exists, in words.
    Impossible(String),
}

/// Searches the constraint tree best-first by lower bound.
pub(super) fn search(
    task: &CbsTask<'_>,
    sipp: &mut Sipp,
    params: &CbsParams,
    check: &mut UnsolvabilityCheck,
    clock: &mut Clock,
) -> Found {
    let problem = task.problem;
    let team = TeamTask::one_shot(problem, task.legs, params.seed);
    let mut low = LowLevel::new(sipp, &problem.graph, &team, Aim::Best);
    low.avoid(task.avoided);
    low.forbid(task.forbidden);
    let Some(root) = low.root(clock) else { return Found::Unknown { lower_bound: 0, is_full: false } };
    let mut search = Search {
        graph: &problem.graph,
        team: &team,
        low,
        open: BTreeMap::new(),
        num_entries: 0,
        memory: MemoryUse::new(params.max_bytes),
    };
    search.insert(root, vec![None; problem.num_agents()]);
    let mut lower_bound = 0;
    for num_nodes in 0.. {
        let Some(((bound, ..), entry)) = search.open.pop_first() else { break };
        // The bounds of nodes are not monotonic, but a proved bound stays valid.
        lower_bound = bound.max(lower_bound);
        let is_full = search.memory.is_full();
        if lower_bound > task.max_cost {
            return Found::Unknown { lower_bound, is_full };
        }
        let Some(conflict) = entry.choice else { return Found::Best(entry.node.paths) };
        if num_nodes >= task.max_nodes || is_full || clock.count_node() || clock.is_spent() {
            return Found::Unknown { lower_bound, is_full };
        }
        search.memory.remove_node(&entry.node);
        if let Some(reason) = check.count(problem, clock) {
            return Found::Impossible(reason);
        }
        search.expand(entry, &conflict);
    }
    Found::Impossible(EXHAUSTED.to_owned())
}

/// A node of the constraint tree in the open list.
struct Entry {
    node: Node,
    /// The MDD of each agent, if it has been computed.
    mdds: Vec<Option<Arc<Mdd>>>,
    num_conflicts: usize,
    /// The conflict to resolve next.
    choice: Option<PathConflict>,
}

struct Search<'a> {
    graph: &'a Graph,
    team: &'a TeamTask<'a>,
    low: LowLevel<'a>,
    /// Nodes, ordered by lower bound, number of conflicts and age, newest first.
    open: BTreeMap<(u64, usize, Reverse<u64>), Entry>,
    num_entries: u64,
    memory: MemoryUse,
}

impl Search<'_> {
    /// Inserts a node with its lower bound, and selects its next conflict: cardinal, then semi-cardinal, then others.
    fn insert(&mut self, node: Node, mut mdds: Vec<Option<Arc<Mdd>>>) {
        let conflicts = all_conflicts(&node.paths, self.graph.num_vertices());
        let mut choice = None;
        let (mut is_counted, mut num_disjoint) = (vec![false; self.team.starts.len()], 0);
        for &conflict in &conflicts {
            let (one, other) = conflict.agents;
            let num_forced = split(&conflict)
                .into_iter()
                .filter(|constraint| {
                    let mdd = self.mdd(&node, constraint.agent, &mut mdds);
                    mdd.is_forced(constraint.step, constraint.from, constraint.at)
                })
                .count();
            // A cardinal conflict adds at least one step to the cost; disjoint cardinal conflicts add up.
            if num_forced == 2 && !is_counted[one] && !is_counted[other] {
                (is_counted[one], is_counted[other]) = (true, true);
                num_disjoint += 1;
            }
            let key = (Reverse(num_forced), conflict.step);
            if choice.is_none_or(|(known, _)| key < known) {
                choice = Some((key, conflict));
            }
        }
        let bound = node.paths.total_cost() + num_disjoint;
        let choice = choice.map(|(_, conflict)| conflict);
        self.num_entries += 1;
        self.memory.add_node(&node);
        let num_conflicts = conflicts.len();
        let key = (bound, num_conflicts, Reverse(self.num_entries));
        self.open.insert(key, Entry { node, mdds, num_conflicts, choice });
    }

    /// Returns the MDD of an agent in a node.
    fn mdd<'m>(&mut self, node: &Node, agent: usize, mdds: &'m mut [Option<Arc<Mdd>>]) -> &'m Mdd {
        mdds[agent].get_or_insert_with(|| {
            let kept: Vec<_> = node.constraints_of(agent).collect();
            let mdd = Mdd::new(self.graph, self.team, agent, node.paths.cost(agent), &kept);
            self.memory.add(mdd.num_bytes());
            Arc::new(mdd)
        })
    }

    /// Inserts the two children of a conflict, or bypasses the conflict with a child that costs the same and has fewer
    /// conflicts.
    fn expand(&mut self, entry: Entry, conflict: &PathConflict) {
        let num_vertices = self.graph.num_vertices();
        let mut children = Vec::with_capacity(2);
        for constraint in split(conflict) {
            let Some(child) = self.low.child(&entry.node, constraint) else { continue };
            let costs_same = child.paths.total_cost() == entry.node.paths.total_cost();
            if costs_same && all_conflicts(&child.paths, num_vertices).len() < entry.num_conflicts {
                let node = Node { paths: child.paths, ..entry.node };
                return self.insert(node, entry.mdds);
            }
            children.push((constraint.agent, child));
        }
        for (agent, child) in children {
            let mut mdds = entry.mdds.clone();
            mdds[agent] = None;
            self.insert(child, mdds);
        }
    }
}
