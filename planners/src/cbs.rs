//! Conflict-based search: plans of least sum of costs, for few agents, to know the truth.
//!
//! Source: Sharon et al., "Conflict-based search for optimal multi-agent pathfinding", Artificial Intelligence 219,
//! 2015; conflicts in an order and plans around them: Boyarski et al., "ICBS: Improved Conflict-Based Search
//! Algorithm for Multi-Agent Pathfinding", IJCAI 2015; the bound from conflicts that cannot be avoided: Felner et
//! al., "Adding Heuristics to Conflict-Based Search for Multi-Agent Path Finding", ICAPS 2018. Agents are planned in
//! the groups of `groups`.
//!
//! | paper | here |
//! | --- | --- |
//! | N.constraints, N.solution | `Node::constraints`, `Node::paths` |
//! | cardinal, semi-cardinal | how many of the two agents `must_meet` |
//! | bypass | `around` |
//! | h | `num_disjoint` |

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;
use std::sync::Arc;

use crate::conflict::{Meeting, Paths, Setting, all_conflicts};
use crate::graph::{Graph, Vertex};
use crate::groups::Groups;
use crate::mdd::Mdd;
use crate::problem::{Budget, Clock, Outcome, Planner, Problem};
use crate::sipp::{Leg, Sipp};
use crate::tree::{Aim, Doubt, Low, Node, Room, split};

/// How [`Cbs`] plans.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CbsParams {
    /// Chooses among what is equally good.
    pub seed: u64,
    /// Most bytes that the tree may take; once it does, the budget is spent.
    pub most_bytes: usize,
}

impl Default for CbsParams {
    fn default() -> Self {
        Self { seed: 0, most_bytes: Room::DEFAULT_BYTES }
    }
}

/// Optimal planning. A node of its budget is a node of the constraint tree.
///
/// It proves that there is no plan where the problem is small or its steps are bounded; else it searches on for as
/// long as the budget allows.
#[derive(Clone, Debug, Default)]
pub struct Cbs {
    params: CbsParams,
}

impl Cbs {
    /// A planner with these settings.
    pub fn new(params: CbsParams) -> Self {
        Self { params }
    }
}

impl Planner for Cbs {
    fn name(&self) -> &'static str {
        "cbs"
    }

    fn plan(&mut self, problem: &Problem, budget: &Budget) -> Outcome {
        let mut clock = budget.start();
        let costs = match problem.survey(&mut clock) {
            Ok(costs) => costs,
            Err(outcome) => return outcome,
        };
        if clock.count_node() {
            return clock.unsolved(None, problem.lower_bound(&costs));
        }
        Groups::new(problem, &costs, &self.params).plan(&mut clock)
    }
}

/// What is asked of one search: best paths of some agents, as if there were no others but those to keep clear of.
pub(crate) struct Task<'a> {
    pub(crate) problem: &'a Problem,
    pub(crate) legs: &'a [Vec<Leg>],
    /// Paths of others that should rather not be met.
    pub(crate) avoided: &'a [&'a [Vertex]],
    /// Paths of others that must not be met.
    pub(crate) kept_clear: &'a [&'a [Vertex]],
    /// Plans that cost more are of no use.
    pub(crate) most_cost: u64,
    pub(crate) most_nodes: u64,
}

/// What came of a search.
pub(crate) enum Found {
    Best(Paths),
    /// Nothing so far, but no plan costs less than this.
    Unknown {
        lower_bound: u64,
        is_full: bool,
    },
    /// There is no plan, for this reason.
    Nothing(String),
}

/// Goes through the constraint tree, the least bound first.
pub(crate) fn search(task: &Task<'_>, sipp: &mut Sipp, params: &CbsParams, clock: &mut Clock) -> Found {
    let problem = task.problem;
    let setting = Setting::one_shot(problem, task.legs, params.seed);
    let mut low = Low::new(sipp, &problem.graph, &setting, Aim::Best);
    low.avoid(task.avoided);
    low.keep_clear(task.kept_clear);
    let Some(root) = low.root(clock) else { return Found::Unknown { lower_bound: 0, is_full: false } };
    let mut search = Search {
        graph: &problem.graph,
        setting: &setting,
        low,
        open: BinaryHeap::new(),
        num_entries: 0,
        room: Room::new(params.most_bytes),
    };
    search.put(root, vec![None; problem.num_agents()]);
    let (mut doubt, mut lower_bound) = (Doubt::default(), 0);
    for num_nodes in 0.. {
        let Some(entry) = search.open.pop() else { break };
        // Bounds of nodes may fall from one to the next, but what was once proved stays true.
        lower_bound = entry.bound.max(lower_bound);
        let is_full = search.room.is_full();
        if lower_bound > task.most_cost {
            return Found::Unknown { lower_bound, is_full };
        }
        let Some(meeting) = entry.choice else { return Found::Best(entry.node.paths) };
        if num_nodes >= task.most_nodes || is_full || clock.count_node() || clock.is_spent() {
            return Found::Unknown { lower_bound, is_full };
        }
        search.room.remove_node(&entry.node);
        if let Some(reason) = doubt.count(problem, clock) {
            return Found::Nothing(reason);
        }
        search.expand(entry, &meeting);
    }
    Found::Nothing("no plan is as short as it has to be".to_owned())
}

/// A node and what is known of it.
struct Entry {
    node: Node,
    /// The best paths of each agent, where they were looked at.
    mdds: Vec<Option<Arc<Mdd>>>,
    bound: u64,
    num_conflicts: usize,
    /// The meeting to be kept from next.
    choice: Option<Meeting>,
    /// Counted as entries are made.
    number: u64,
}

impl Entry {
    /// The least is taken first; of equal ones the last made.
    fn key(&self) -> (u64, usize, Reverse<u64>) {
        (self.bound, self.num_conflicts, Reverse(self.number))
    }
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for Entry {}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> Ordering {
        other.key().cmp(&self.key())
    }
}

struct Search<'a> {
    graph: &'a Graph,
    setting: &'a Setting<'a>,
    low: Low<'a>,
    open: BinaryHeap<Entry>,
    num_entries: u64,
    room: Room,
}

impl Search<'_> {
    /// Puts a node in with its bound and the meeting that tells most about what plans cost.
    fn put(&mut self, node: Node, mut mdds: Vec<Option<Arc<Mdd>>>) {
        let meetings = all_conflicts(&node.paths, self.graph.num_vertices());
        let mut choice = None;
        let (mut is_met, mut num_disjoint) = (vec![false; self.setting.starts.len()], 0);
        for &meeting in &meetings {
            let (one, other) = meeting.agents;
            let num_forced = split(&meeting)
                .into_iter()
                .filter(|constraint| {
                    let mdd = self.mdd(&node, constraint.agent, &mut mdds);
                    mdd.must_meet(constraint.step, constraint.from, constraint.at)
                })
                .count();
            // Of two agents that cannot but meet, one costs a step more; agents are counted once.
            if num_forced == 2 && !is_met[one] && !is_met[other] {
                (is_met[one], is_met[other]) = (true, true);
                num_disjoint += 1;
            }
            let key = (Reverse(num_forced), meeting.step);
            if choice.is_none_or(|(known, _)| key < known) {
                choice = Some((key, meeting));
            }
        }
        let bound = node.paths.total_cost() + num_disjoint;
        let choice = choice.map(|(_, meeting)| meeting);
        self.num_entries += 1;
        self.room.add_node(&node);
        let number = self.num_entries;
        self.open.push(Entry { node, mdds, bound, num_conflicts: meetings.len(), choice, number });
    }

    fn mdd<'m>(&mut self, node: &Node, agent: usize, mdds: &'m mut [Option<Arc<Mdd>>]) -> &'m Mdd {
        mdds[agent].get_or_insert_with(|| {
            let kept: Vec<_> = node.constraints_of(agent).collect();
            let mdd = Mdd::new(self.graph, self.setting, agent, node.paths.cost(agent), &kept);
            self.room.add(mdd.num_bytes());
            Arc::new(mdd)
        })
    }

    /// Puts in the two nodes that a meeting leads to, or the node itself with paths around it, if they cost as much.
    fn expand(&mut self, entry: Entry, meeting: &Meeting) {
        let num_vertices = self.graph.num_vertices();
        let mut children = Vec::with_capacity(2);
        for constraint in split(meeting) {
            let Some(child) = self.low.child(&entry.node, constraint) else { continue };
            let costs_same = child.paths.total_cost() == entry.node.paths.total_cost();
            if costs_same && all_conflicts(&child.paths, num_vertices).len() < entry.num_conflicts {
                let node = Node { paths: child.paths, ..entry.node };
                return self.put(node, entry.mdds);
            }
            children.push((constraint.agent, child));
        }
        for (agent, child) in children {
            let mut mdds = entry.mdds.clone();
            mdds[agent] = None;
            self.put(child, mdds);
        }
    }
}
