//! Independence detection: agents that get by without regard to each other need not be planned together.
//!
//! Each group of agents is planned as if it were alone. Where the plans of two groups meet, one of them is looked for
//! anew that costs as much and keeps clear of the other; if there is none, the two become one group. No plan of all
//! costs less than the best plans of all groups together, so that this is known even if not all groups get a plan.
//!
//! Paper: Standley, "Finding Optimal Solutions to Cooperative Pathfinding Problems", AAAI 2010.
//!
//! | here | there |
//! | --- | --- |
//! | `Group` | group |
//! | `Groups::clears` | the search for another path of the same cost, with illegal moves |
//! | `Task::avoided` | conflict avoidance table |

use std::collections::HashSet;

use crate::cbs::{CbsParams, Found, Task, search};
use crate::conflict::{Paths, all_conflicts, one_leg_each};
use crate::distances::CostToGo;
use crate::joint::best;
use crate::problem::{Clock, Outcome, Problem};
use crate::sipp::{Leg, Sipp};
use crate::tree::Doubt;

/// Nodes that the search for a group's plan may take at first; each time it is taken up again, twice as many.
const NODES: u64 = 512;

/// Joint places that a group may walk through.
const PLACES: usize = 1 << 17;

/// Agents that are planned together.
#[derive(Debug)]
struct Group {
    /// Counted as groups are made.
    number: usize,
    agents: Vec<usize>,
    /// The best paths, once they are found, in the order of the agents.
    paths: Option<Paths>,
    /// No plan of these agents costs less.
    lower_bound: u64,
    most_nodes: u64,
    /// Whether it was not looked at yet.
    is_new: bool,
    /// Whether more nodes would take more room than there is.
    is_full: bool,
}

/// All agents of a problem in groups.
pub(crate) struct Groups<'a> {
    problem: &'a Problem,
    params: &'a CbsParams,
    legs: Vec<Vec<Leg>>,
    sipp: Sipp,
    all: Vec<Group>,
    num_made: usize,
    /// Pairs of groups that have been looked at for plans that keep clear of each other.
    looked_at: HashSet<(usize, usize)>,
    /// Whether it was asked if there is a plan of all at all.
    has_doubted: bool,
}

impl<'a> Groups<'a> {
    /// Each agent a group of its own, with nothing planned yet.
    pub(crate) fn new(problem: &'a Problem, costs: &[CostToGo], params: &'a CbsParams) -> Self {
        let mut groups = Self {
            problem,
            params,
            legs: one_leg_each(costs),
            sipp: Sipp::new(problem.graph.clone()),
            all: Vec::new(),
            has_doubted: false,
            num_made: 0,
            looked_at: HashSet::new(),
        };
        for (agent, costs) in costs.iter().enumerate() {
            groups.add(vec![agent], u64::from(costs[problem.starts[agent] as usize]));
        }
        groups
    }

    /// The best plan of all, or else what is known.
    pub(crate) fn plan(mut self, clock: &mut Clock) -> Outcome {
        loop {
            if clock.is_spent() {
                return clock.unsolved(None, self.lower_bound());
            }
            let next = self.all.iter().position(|group| group.is_new);
            if next.is_none()
                && let Some((one, other)) = self.next_meeting()
            {
                self.settle(one, other, clock);
            } else if let Some(index) = next.or_else(|| self.next_unplanned()) {
                if let Some(reason) = self.think(index, clock) {
                    return Outcome::Impossible { reason };
                }
            } else if self.all.iter().all(|group| group.paths.is_some()) {
                return self.all_paths().outcome(self.problem, self.lower_bound());
            } else {
                return clock.unsolved(None, self.lower_bound());
            }
        }
    }

    fn add(&mut self, agents: Vec<usize>, lower_bound: u64) {
        self.num_made += 1;
        self.all.push(Group {
            number: self.num_made,
            agents,
            paths: None,
            lower_bound,
            most_nodes: NODES,
            is_new: true,
            is_full: false,
        });
    }

    /// What all groups cost at least.
    fn lower_bound(&self) -> u64 {
        self.all.iter().map(|group| group.lower_bound).sum()
    }

    /// The group without a plan that was given up soonest.
    fn next_unplanned(&self) -> Option<usize> {
        let waits = |index: &usize| self.all[*index].paths.is_none() && !self.all[*index].is_full;
        let waiting = (0..self.all.len()).filter(waits);
        waiting.min_by_key(|&index| (self.all[index].most_nodes, self.all[index].agents.len()))
    }

    /// The two smallest groups whose plans meet.
    fn next_meeting(&self) -> Option<(usize, usize)> {
        let mut group_of = vec![0; self.problem.num_agents()];
        for (index, group) in self.all.iter().enumerate() {
            group.agents.iter().for_each(|&agent| group_of[agent] = index);
        }
        let meetings = all_conflicts(&self.all_paths(), self.problem.graph.num_vertices());
        let pairs = meetings.iter().map(|meeting| (group_of[meeting.agents.0], group_of[meeting.agents.1]));
        let size = |index: usize| self.all[index].agents.len();
        pairs.min_by_key(|&(one, other)| size(one) + size(other))
    }

    /// The paths of all agents; those without any have none.
    fn all_paths(&self) -> Paths {
        let mut all = Paths::new(self.problem.num_agents(), true);
        for group in &self.all {
            let Some(paths) = &group.paths else { continue };
            for (index, &agent) in group.agents.iter().enumerate() {
                all.take_from(paths, index, agent);
            }
        }
        all
    }

    /// Keeps the plans of two groups from meeting, or makes one group of them.
    fn settle(&mut self, one: usize, other: usize, clock: &mut Clock) {
        let pair = (self.all[one].number, self.all[other].number);
        if self.looked_at.insert(pair) && (self.clears(one, other, clock) || self.clears(other, one, clock)) {
            return;
        }
        let last = self.all.swap_remove(one.max(other));
        let first = self.all.swap_remove(one.min(other));
        let mut agents = first.agents;
        agents.extend(last.agents);
        agents.sort_unstable();
        self.add(agents, first.lower_bound + last.lower_bound);
    }

    /// Looks for a plan of a group that costs as much as its own and keeps clear of another group.
    fn clears(&mut self, index: usize, other: usize, clock: &mut Clock) -> bool {
        let group = &self.all[index];
        let (most_cost, most_nodes) = (group.lower_bound, group.most_nodes);
        let found = self.search(index, Some(other), (most_cost, most_nodes), clock);
        let Found::Best(paths) = found else { return false };
        self.all[index].paths = Some(paths);
        true
    }

    /// Looks for the best plan of a group; a reason if it has none.
    fn think(&mut self, index: usize, clock: &mut Clock) -> Option<String> {
        let found = self.search(index, None, (u64::MAX, self.all[index].most_nodes), clock);
        let group = &mut self.all[index];
        let is_first = std::mem::replace(&mut group.is_new, false);
        match found {
            Found::Best(paths) => {
                group.lower_bound = paths.total_cost();
                group.paths = Some(paths);
            }
            Found::Unknown { lower_bound, is_full } => {
                group.lower_bound = group.lower_bound.max(lower_bound);
                group.is_full = is_full;
                group.most_nodes = group.most_nodes.saturating_mul(2);
                if !std::mem::replace(&mut self.has_doubted, true)
                    && let Some(reason) = Doubt::look(self.problem, clock)
                {
                    return Some(reason);
                }
                if is_first && let Some(paths) = self.walk_together(index, clock) {
                    self.all[index].lower_bound = paths.total_cost();
                    self.all[index].paths = Some(paths);
                }
            }
            Found::Nothing(reason) => return Some(reason),
        }
        None
    }

    /// The best plan of a small group, if a walk through its joint places finds it: where agents have to give way in
    /// long corridors, those are fewer than the nodes of a constraint tree.
    fn walk_together(&self, index: usize, clock: &mut Clock) -> Option<Paths> {
        let agents = &self.all[index].agents;
        let to_go: Vec<CostToGo> = agents.iter().map(|&agent| self.legs[agent][0].to_go.clone()).collect();
        best(&self.problem.only(agents), &to_go, PLACES, clock)
    }

    fn search(
        &mut self,
        index: usize,
        kept_clear: Option<usize>,
        (most_cost, most_nodes): (u64, u64),
        clock: &mut Clock,
    ) -> Found {
        let agents = &self.all[index].agents;
        let planned = |index: usize| {
            let paths = self.all[index].paths.as_ref();
            let agents = 0..paths.map_or(0, Paths::num_agents);
            agents.filter_map(move |agent| Some(paths?.path(agent)))
        };
        let others = (0..self.all.len()).filter(|&other| other != index);
        let task = Task {
            problem: &self.problem.only(agents),
            legs: &agents.iter().map(|&agent| self.legs[agent].clone()).collect::<Vec<_>>(),
            avoided: &others.flat_map(planned).collect::<Vec<_>>(),
            kept_clear: &kept_clear.into_iter().flat_map(planned).collect::<Vec<_>>(),
            most_cost,
            most_nodes,
        };
        search(&task, &mut self.sipp, self.params, clock)
    }
}
