//! Conflict-based search for plans that cost at most so many times the least.
//!
//! Source: Barer et al., "Suboptimal Variants of the Conflict-Based Search Algorithm for the Multi-Agent Pathfinding
//! Problem", Symposium on Combinatorial Search 2014
//!
//! | paper | here |
//! | --- | --- |
//! | w | `EcbsParams::weight` |
//! | LB | `lower_bound` |
//! | OPEN, FOCAL | `open`, `focal`; what is in the first alone is in `dear` |
//! | fmin(i) | `Node::least` |
//!
//! The low level looks for the least cost first and then, within the weight, for few conflicts, in the intervals of
//! the second of the works that [`crate::sipp`] names.

use std::collections::BTreeSet;

use crate::conflict::{Meeting, Paths, Setting, all_conflicts, one_leg_each};
use crate::graph::Graph;
use crate::problem::{Budget, Clock, Outcome, Planner, Problem};
use crate::sipp::Sipp;
use crate::tree::{Aim, Doubt, Low, Node, Room, split};

/// How [`Ecbs`] plans.
#[derive(Clone, Debug, PartialEq)]
pub struct EcbsParams {
    /// How many times the least a plan may cost; 1 and less mean optimal plans.
    pub weight: f64,
    /// Chooses among what is equally good.
    pub seed: u64,
    /// Most bytes that the tree may take; once it does, the budget is spent.
    pub most_bytes: usize,
}

impl Default for EcbsParams {
    fn default() -> Self {
        Self { weight: 1.2, seed: 0, most_bytes: Room::DEFAULT_BYTES }
    }
}

/// Planning within a bound. A node of its budget is a node of the constraint tree.
///
/// It proves that there is no plan where [`crate::Cbs`] does.
#[derive(Clone, Debug, Default)]
pub struct Ecbs {
    params: EcbsParams,
}

impl Ecbs {
    /// A planner with these settings.
    pub fn new(params: EcbsParams) -> Self {
        Self { params }
    }
}

impl Planner for Ecbs {
    fn name(&self) -> &'static str {
        "ecbs"
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
        let mut doubt = Doubt::default();
        let give_up = |clock: &mut Clock| doubt.count(problem, clock);
        match search(&mut sipp, &problem.graph, &setting, &self.params, &mut clock, give_up) {
            Found::Paths { paths, lower_bound } => paths.outcome(problem, lower_bound),
            Found::Nothing { lower_bound } => {
                clock.unsolved(None, lower_bound.max(problem.lower_bound(&costs)))
            }
            Found::Proof(reason) => Outcome::Impossible { reason },
        }
    }
}

/// What a search ends with.
pub(crate) enum Found {
    /// Paths without conflict.
    Paths { paths: Paths, lower_bound: u64 },
    /// Nothing before the time was up, but no plan costs less than this.
    Nothing { lower_bound: u64 },
    /// The reason why there are none.
    Proof(String),
}

/// Paths without conflict within the bound; `give_up` is asked for a reason at every node.
pub(crate) fn search(
    sipp: &mut Sipp,
    graph: &Graph,
    setting: &Setting<'_>,
    params: &EcbsParams,
    clock: &mut Clock,
    mut give_up: impl FnMut(&mut Clock) -> Option<String>,
) -> Found {
    // A weight that is no number is no weight.
    let weight = params.weight.max(1.0);
    let mut low = Low::new(sipp, graph, setting, Aim::Within(weight));
    if clock.count_node() {
        return Found::Nothing { lower_bound: 0 };
    }
    let Some(root) = low.root(clock) else { return Found::Nothing { lower_bound: 0 } };
    let mut queues = Queues::new(weight, graph.num_vertices(), Room::new(params.most_bytes));
    queues.put(root);
    while let Some((entry, lower_bound)) = queues.take() {
        let Some(meeting) = entry.meeting else {
            return Found::Paths { paths: entry.node.paths, lower_bound };
        };
        if clock.count_node() || clock.is_spent() || queues.room.is_full() {
            return Found::Nothing { lower_bound };
        }
        if let Some(reason) = give_up(clock) {
            return Found::Proof(reason);
        }
        for constraint in split(&meeting) {
            if let Some(child) = low.child(&entry.node, constraint) {
                queues.put(child);
            }
        }
    }
    Found::Proof("no plan is as short as it has to be".to_owned())
}

/// A node and what is known of it.
struct Entry {
    node: Node,
    num_conflicts: usize,
    /// The first meeting.
    meeting: Option<Meeting>,
}

/// The nodes that are still to be looked at, in two orders.
struct Queues {
    weight: f64,
    num_vertices: usize,
    room: Room,
    entries: Vec<Option<Entry>>,
    /// All, by lower bound.
    open: BTreeSet<(u64, usize)>,
    /// Those whose cost is within the weight, by conflicts, cost and lastly age, the youngest first.
    focal: BTreeSet<(usize, u64, std::cmp::Reverse<usize>)>,
    /// The rest, by cost.
    dear: BTreeSet<(u64, usize)>,
}

impl Queues {
    fn new(weight: f64, num_vertices: usize, room: Room) -> Self {
        Self {
            weight,
            num_vertices,
            room,
            entries: Vec::new(),
            open: BTreeSet::new(),
            focal: BTreeSet::new(),
            dear: BTreeSet::new(),
        }
    }

    fn put(&mut self, node: Node) {
        let meetings = all_conflicts(&node.paths, self.num_vertices);
        let meeting = meetings.first().copied();
        let number = self.entries.len();
        self.room.add_node(&node);
        self.room.add(size_of::<Option<Entry>>());
        self.open.insert((node.lower_bound(), number));
        self.dear.insert((node.paths.total_cost(), number));
        self.entries.push(Some(Entry { node, num_conflicts: meetings.len(), meeting }));
    }

    /// The node with the fewest conflicts of those within the weight, and the least that any plan costs.
    fn take(&mut self) -> Option<(Entry, u64)> {
        let &(lower_bound, _) = self.open.first()?;
        let is_within = |cost: u64| is_within(cost, lower_bound, self.weight);
        while let Some(&(cost, number)) = self.dear.first().filter(|&&(cost, _)| is_within(cost)) {
            self.dear.pop_first();
            let num_conflicts = self.entries[number].as_ref()?.num_conflicts;
            self.focal.insert((num_conflicts, cost, std::cmp::Reverse(number)));
        }
        let (_, _, std::cmp::Reverse(number)) = self.focal.pop_first()?;
        let entry = self.entries[number].take()?;
        self.open.remove(&(entry.node.lower_bound(), number));
        self.room.remove_node(&entry.node);
        Some((entry, lower_bound))
    }
}

/// Whether a cost is at most so many times the least. What rounding takes off is allowed for: the costs of single
/// agents are rounded one by one, and a sum that then seemed too dear would leave no node at all.
fn is_within(cost: u64, least: u64, weight: f64) -> bool {
    cost as f64 <= least as f64 * weight * (1.0 + 1e-12)
}

#[cfg(test)]
mod tests {
    use super::is_within;

    #[test]
    fn what_is_just_so_many_times_the_least_is_within() {
        // Nine agents whose paths cost 7 in place of 5; 45 times 1.4 is a little under 63 in floating point.
        assert!(is_within(63, 45, 1.4));
        assert!(!is_within(64, 45, 1.4));
        assert!(is_within(6, 5, 1.2) && !is_within(7, 5, 1.2));
    }
}
