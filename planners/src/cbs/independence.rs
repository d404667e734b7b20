//! Independence detection: agents are planned together only if their optimal paths conflict.
//!
//! Each group of agents is planned alone. If the plans of two groups conflict, one group is replanned at the same cost
//! around the other. If that fails, the two groups are merged. The sum of the lower bounds of all groups is a lower
//! bound on the sum of costs, even if some groups have no plan yet.
//!
//! Source: Standley, "Finding Optimal Solutions to Cooperative Pathfinding Problems", AAAI 2010.
//!
//! | paper | here |
//! | --- | --- |
//! | group | [`Group`] |
//! | search for another path of the same cost, with illegal moves | [`Groups::replan_around`] |
//! | conflict avoidance table | [`CbsTask::avoided`] |

use std::collections::HashSet;
use std::sync::Arc;

use crate::budget::Clock;
use crate::cbs::search::{CbsParams, CbsTask, Found, search};
use crate::cbs::unsolvable::UnsolvabilityCheck;
use crate::conflicts::all_conflicts;
use crate::distances::CostToGo;
use crate::joint::astar::{self, JointTask};
use crate::outcome::Outcome;
use crate::paths::Paths;
use crate::problem::Problem;
use crate::sipp::{Leg, Sipp};
use crate::team_task::one_leg_each;

/// The first node limit of the search for a group; each restart doubles it.
const NODES: u64 = 512;

/// The limit on joint states of the joint A* of a group.
const MAX_STATES: usize = 1 << 17;

/// The largest group that joint A* plans.
const MAX_JOINT_AGENTS: usize = 3;

/// Agents that are planned together.
#[derive(Debug)]
struct Group {
    /// The serial number of the group.
    number: usize,
    agents: Vec<usize>,
    /// The optimal paths in the order of the agents, once they are found.
    paths: Option<Paths>,
    /// A lower bound on the sum of costs of these agents.
    lower_bound: u64,
    max_nodes: u64,
    /// Whether the group has not been planned yet.
    is_new: bool,
    /// Whether the byte budget stopped the search.
    is_full: bool,
    /// The check that all searches for this group share.
    check: UnsolvabilityCheck,
}

/// The agents of a problem in groups.
pub(super) struct Groups<'a> {
    problem: &'a Problem,
    params: &'a CbsParams,
    legs: Vec<Vec<Leg>>,
    sipp: Sipp,
    all: Vec<Group>,
    num_made: usize,
    /// Pairs of groups for which replanning around each other has been tried.
    tried: HashSet<(usize, usize)>,
    /// Whether the solvability of the whole problem has been checked.
    has_checked: bool,
}

impl<'a> Groups<'a> {
    /// Creates one group for each agent, without plans.
    pub fn new(problem: &'a Problem, costs: &[CostToGo], params: &'a CbsParams) -> Self {
        let mut groups = Self {
            problem,
            params,
            legs: one_leg_each(costs),
            sipp: Sipp::new(problem.graph.clone()),
            all: Vec::new(),
            has_checked: false,
            num_made: 0,
            tried: HashSet::new(),
        };
        for (agent, costs) in costs.iter().enumerate() {
            groups.add(vec![agent], u64::from(costs[problem.starts[agent] as usize]));
        }
        groups
    }

    /// Returns an optimal plan of all agents or the proof that none exists, or else the lower bound.
    pub fn plan(mut self, clock: &mut Clock) -> Outcome {
        loop {
            if clock.is_spent() {
                return clock.unsolved(None, self.lower_bound());
            }
            let next = self.all.iter().position(|group| group.is_new);
            if next.is_none()
                && let Some((one, other)) = self.next_conflict()
            {
                self.resolve(one, other, clock);
            } else if let Some(index) = next.or_else(|| self.next_unplanned()) {
                if let Some(reason) = self.plan_group(index, clock) {
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
            max_nodes: NODES,
            is_new: true,
            is_full: false,
            check: UnsolvabilityCheck::default(),
        });
    }

    /// Returns the sum of the lower bounds of all groups.
    fn lower_bound(&self) -> u64 {
        self.all.iter().map(|group| group.lower_bound).sum()
    }

    /// Returns the unplanned group with the least node limit.
    fn next_unplanned(&self) -> Option<usize> {
        let waits = |index: &usize| self.all[*index].paths.is_none() && !self.all[*index].is_full;
        let waiting = (0..self.all.len()).filter(waits);
        waiting.min_by_key(|&index| (self.all[index].max_nodes, self.all[index].agents.len()))
    }

    /// Returns the two smallest groups whose plans conflict.
    fn next_conflict(&self) -> Option<(usize, usize)> {
        let mut group_of = vec![0; self.problem.num_agents()];
        for (index, group) in self.all.iter().enumerate() {
            group.agents.iter().for_each(|&agent| group_of[agent] = index);
        }
        let conflicts = all_conflicts(&self.all_paths(), self.problem.graph.num_vertices());
        let pairs =
            conflicts.iter().map(|conflict| (group_of[conflict.agents.0], group_of[conflict.agents.1]));
        let size = |index: usize| self.all[index].agents.len();
        pairs.min_by_key(|&(one, other)| size(one) + size(other))
    }

    /// Returns the paths of all agents; unplanned agents have empty paths.
    fn all_paths(&self) -> Paths {
        let mut all = Paths::new(self.problem.num_agents(), true);
        for group in &self.all {
            let Some(paths) = &group.paths else { continue };
            for (index, &agent) in group.agents.iter().enumerate() {
                all.copy_from(paths, index, agent);
            }
        }
        all
    }

    /// Replans one of two groups around the other, or merges them.
    fn resolve(&mut self, one: usize, other: usize, clock: &mut Clock) {
        let pair = (self.all[one].number, self.all[other].number);
        if self.tried.insert(pair)
            && (self.replan_around(one, other, clock) || self.replan_around(other, one, clock))
        {
            return;
        }
        let last = self.all.swap_remove(one.max(other));
        let first = self.all.swap_remove(one.min(other));
        let mut agents = first.agents;
        agents.extend(last.agents);
        agents.sort_unstable();
        self.add(agents, first.lower_bound + last.lower_bound);
    }

    /// Replans a group at the same cost without conflicts with another group; returns whether that succeeded.
    fn replan_around(&mut self, index: usize, other: usize, clock: &mut Clock) -> bool {
        let group = &self.all[index];
        let (max_cost, max_nodes) = (group.lower_bound, group.max_nodes);
        // The group has a plan.
        let mut check = UnsolvabilityCheck::done();
        let found = self.search(index, Some(other), (max_cost, max_nodes), &mut check, clock);
        let Found::Best(paths) = found else { return false };
        self.all[index].paths = Some(paths);
        true
    }

    /// Searches for an optimal plan of a group; if it proves that none exists, returns the reason.
    fn plan_group(&mut self, index: usize, clock: &mut Clock) -> Option<String> {
        let mut check = std::mem::take(&mut self.all[index].check);
        let found = self.search(index, None, (u64::MAX, self.all[index].max_nodes), &mut check, clock);
        let group = &mut self.all[index];
        group.check = check;
        let is_first = std::mem::replace(&mut group.is_new, false);
        match found {
            Found::Best(paths) => {
                group.lower_bound = paths.total_cost();
                group.paths = Some(paths);
            }
            Found::Unknown { lower_bound, is_full } => {
                group.lower_bound = group.lower_bound.max(lower_bound);
                group.is_full = is_full;
                group.max_nodes = group.max_nodes.saturating_mul(2);
                if !std::mem::replace(&mut self.has_checked, true)
                    && let Some(reason) = UnsolvabilityCheck::run(self.problem, clock)
                {
                    return Some(reason);
                }
                if is_first && let Some(paths) = self.plan_jointly(index, clock) {
                    self.all[index].lower_bound = paths.total_cost();
                    self.all[index].paths = Some(paths);
                }
            }
            Found::Impossible(reason) => return Some(reason),
        }
        None
    }

    /// Plans a small group by joint A*. In long corridors, joint states are fewer than nodes of a constraint tree.
    fn plan_jointly(&self, index: usize, clock: &mut Clock) -> Option<Paths> {
        let agents = &self.all[index].agents;
        let to_go: Vec<CostToGo> = agents.iter().map(|&agent| self.legs[agent][0].to_go.clone()).collect();
        let Problem { graph, starts, goals, max_steps } = &self.problem.only(agents);
        if agents.len() > MAX_JOINT_AGENTS {
            return None;
        }
        let task = JointTask { graph, starts, goals, costs: &to_go, leaves: false, max_states: MAX_STATES };
        let astar::Found::Paths(each) = astar::search(&task, clock) else { return None };
        let mut paths = Paths::new(agents.len(), true);
        for (agent, path) in each.into_iter().enumerate() {
            let num_steps = path.len() - 1;
            if max_steps.is_some_and(|limit| num_steps > limit) {
                return None;
            }
            paths.set(agent, Arc::new(path), num_steps as u32);
        }
        Some(paths)
    }

    /// Searches for an optimal plan of a group. The plan has no conflicts with the group `forbidden`, and as few as
    /// possible with other groups.
    fn search(
        &mut self,
        index: usize,
        forbidden: Option<usize>,
        (max_cost, max_nodes): (u64, u64),
        check: &mut UnsolvabilityCheck,
        clock: &mut Clock,
    ) -> Found {
        let agents = &self.all[index].agents;
        let planned = |index: usize| {
            let paths = self.all[index].paths.as_ref();
            let agents = 0..paths.map_or(0, Paths::num_agents);
            agents.filter_map(move |agent| Some(paths?.path(agent)))
        };
        let others = (0..self.all.len()).filter(|&other| other != index);
        let task = CbsTask {
            problem: &self.problem.only(agents),
            legs: &agents.iter().map(|&agent| self.legs[agent].clone()).collect::<Vec<_>>(),
            avoided: &others.flat_map(planned).collect::<Vec<_>>(),
            forbidden: &forbidden.into_iter().flat_map(planned).collect::<Vec<_>>(),
            max_cost,
            max_nodes,
        };
        search(&task, &mut self.sipp, self.params, check, clock)
    }
}
