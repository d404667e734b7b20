//! The refiner: one worker of the large neighbourhood search.

use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

use crate::distances::CostToGo;
use crate::graph::Vertex;
use crate::lacam::lns::change_log::Worker;
use crate::lacam::lns::earliest_arrival::{EarliestArrival, Query};
use crate::lacam::lns::neighbourhood::NeighbourhoodSelector;
use crate::lacam::lns::solution::{Solution, configurations_of, paths_of};
use crate::lacam::lns::time_table::{Path, TimeTable};
use crate::problem::{Agent, Problem};
use crate::random::{below, shuffle};

/// A worker that refines a plan, alone or in parallel with others.
#[derive(Debug)]
pub(crate) struct Refiner<'a> {
    solution: Solution<'a>,
    /// The changes of all workers. The solution includes those that this worker has seen.
    changes: Worker<'a>,
    selector: NeighbourhoodSelector,
    planner: EarliestArrival,
    random: Pcg64Mcg,
    /// The neighbourhood: the agents that are replanned together.
    agents: Vec<Agent>,
    old: Vec<Path>,
    new: Vec<Path>,
}

/// Returns the time span that a plan of `num_steps` steps needs, with slack for longer paths.
fn span(problem: &Problem, num_steps: usize) -> usize {
    let slack = num_steps + num_steps / 4 + 8;
    problem.max_steps.map_or(slack, |limit| slack.min(limit)).max(num_steps) + 1
}

/// Returns the memory of one refiner. Units: bytes.
pub(crate) fn num_bytes(problem: &Problem, num_steps: usize) -> usize {
    let (num_vertices, span) = (problem.graph.num_vertices(), span(problem, num_steps));
    TimeTable::num_bytes(num_vertices, span) + EarliestArrival::num_bytes(num_vertices, span)
}

/// Returns whether the number of agents is supported.
pub(crate) fn supports(problem: &Problem) -> bool {
    (1..=TimeTable::MAX_AGENTS).contains(&problem.num_agents())
}

/// Number of priority orders in which all agents are initially replanned.
const NUM_ORDERS: usize = 4;

impl<'a> Refiner<'a> {
    /// Creates a worker that starts with a valid plan; all workers start with the same one.
    pub fn new(
        problem: &'a Problem,
        costs: &'a [CostToGo],
        plan: &[Vec<Vertex>],
        changes: Worker<'a>,
        seed: u64,
    ) -> Self {
        let span = span(problem, plan.len() - 1);
        let num_vertices = problem.graph.num_vertices();
        Self {
            solution: Solution::new(problem, costs, &paths_of(plan), span),
            changes,
            selector: NeighbourhoodSelector::new(problem.num_agents(), num_vertices),
            planner: EarliestArrival::new(num_vertices, span as u32),
            random: Pcg64Mcg::seed_from_u64(seed),
            agents: Vec::new(),
            old: Vec::new(),
            new: Vec::new(),
        }
    }

    /// Returns the total delay. Steps after the step limit are weighted heavily.
    pub fn total_delay(&self) -> u64 {
        self.solution.total_delay()
    }

    /// Returns the sum of costs, unless the plan exceeds the step limit.
    pub fn cost(&self) -> Option<u64> {
        self.solution.cost()
    }

    /// Returns the current plan as configurations.
    pub fn plan(&self) -> Vec<Vec<Vertex>> {
        configurations_of(self.solution.paths())
    }

    /// Replaces the plan if the new one has less total delay and its paths fit the time span.
    pub fn replace(&mut self, plan: &[Vec<Vertex>]) {
        let paths = paths_of(plan);
        let span = self.solution.span() as usize;
        let delay =
            |(agent, path): (usize, &Path)| self.solution.delay_of(agent as Agent, path.len() as u32 - 1);
        let delays: u64 = paths.iter().enumerate().map(delay).sum();
        if paths.iter().any(|path| path.len() > span) {
            return;
        }
        let all: Vec<Agent> = (0..paths.len() as Agent).collect();
        loop {
            self.apply_changes();
            // Other workers may have found better paths since the new plan was begun.
            if delays >= self.solution.total_delay() {
                return;
            }
            if self.changes.publish(&all, &paths) {
                break;
            }
        }
        self.agents = all;
        self.exchange(&paths);
    }

    /// Replans all agents once in each of several priority orders; ends early if `stop` returns true or no agent is
    /// delayed.
    pub fn replan_all(&mut self, mut stop: impl FnMut() -> bool) {
        for order in 0..NUM_ORDERS {
            if self.solution.total_delay() == 0 || stop() {
                return;
            }
            self.agents.clear();
            self.agents.extend(0..self.solution.num_agents() as Agent);
            shuffle(&mut self.agents, &mut self.random);
            let solution = &self.solution;
            match order {
                0 => self.agents.sort_by_key(|&agent| std::cmp::Reverse(solution.distance(agent))),
                1 => self.agents.sort_by_key(|&agent| std::cmp::Reverse(solution.delay(agent))),
                _ => {}
            }
            if self.repair(&mut stop) {
                self.publish();
            }
        }
    }

    /// Replans one neighbourhood; returns whether the plan improved.
    pub fn improve(&mut self) -> bool {
        self.apply_changes();
        if self.solution.total_delay() == 0 {
            return false;
        }
        let work = self.planner.num_expanded();
        let selected = self.selector.select(&self.solution, &mut self.random);
        self.agents.clear();
        self.agents.extend_from_slice(selected);
        shuffle(&mut self.agents, &mut self.random);
        let before = self.solution.total_delay();
        let is_changed = self.repair(|| false) && self.publish();
        let gain = before.saturating_sub(self.solution.total_delay()) as f64;
        let work = (self.planner.num_expanded() - work + 100) as f64;
        self.selector.reward(if is_changed { gain.min(64.0) * 1000.0 / work } else { 0.0 });
        is_changed && gain > 0.0
    }

    /// Replans the neighbourhood by prioritised planning in the order of `agents`. If that fails or the total delay
    /// would grow, the agents keep their paths. Returns whether they have new ones.
    fn repair(&mut self, mut stop: impl FnMut() -> bool) -> bool {
        let mut left: u64 = self.agents.iter().map(|&agent| self.solution.delay(agent)).sum();
        if left == 0 {
            return false;
        }
        copy_paths(&mut self.old, self.agents.iter().map(|&agent| &self.solution.path(agent)[..]));
        self.agents.iter().for_each(|&agent| self.solution.remove(agent));
        self.new.resize_with(self.agents.len().max(self.new.len()), Path::new);
        for index in 0..self.agents.len() {
            let agent = self.agents[index];
            if stop() || !self.find(agent, left, index) {
                self.restore(index);
                return false;
            }
            self.solution.insert(agent, &self.new[index]);
            left -= self.solution.delay(agent);
        }
        true
    }

    /// Finds a path of an agent with at most a given delay; returns whether there is one.
    fn find(&mut self, agent: Agent, delay: u64, index: usize) -> bool {
        let (start, goal) = self.solution.ends(agent);
        let (costs, latest) = (self.solution.costs(agent), self.solution.latest(agent, delay));
        let dice = below(&mut self.random, u32::MAX as usize) as u32;
        let query = Query { start, goal, costs, latest, dice };
        self.planner.find(self.solution.graph(), self.solution.table(), query, &mut self.new[index])
    }

    /// Publishes the new paths; returns whether that succeeded. If other workers have changed the same agents or block
    /// the new paths, the new paths are discarded.
    fn publish(&mut self) -> bool {
        let num_agents = self.agents.len();
        loop {
            if self.changes.publish(&self.agents, &self.new[..num_agents]) {
                return true;
            }
            let old = std::mem::take(&mut self.old);
            self.exchange(&old[..num_agents]);
            self.old = old;
            let agents = std::mem::take(&mut self.agents);
            let is_changed = self.apply_changes_and_check(&agents);
            self.agents = agents;
            if is_changed || !self.insert_if_free() {
                return false;
            }
        }
    }

    /// Assigns the new paths again, if they are still free of conflicts.
    fn insert_if_free(&mut self) -> bool {
        copy_paths(&mut self.old, self.agents.iter().map(|&agent| &self.solution.path(agent)[..]));
        self.agents.iter().for_each(|&agent| self.solution.remove(agent));
        for index in 0..self.agents.len() {
            if self.solution.table().is_free(&self.new[index]) {
                self.solution.insert(self.agents[index], &self.new[index]);
                continue;
            }
            self.restore(index);
            return false;
        }
        true
    }

    /// Restores the old paths of the neighbourhood, whose first `num_new` agents have new paths.
    fn restore(&mut self, num_new: usize) {
        self.agents[..num_new].iter().for_each(|&agent| self.solution.remove(agent));
        for (&agent, path) in self.agents.iter().zip(&self.old) {
            self.solution.insert(agent, path);
        }
    }

    /// Replaces the paths of the neighbourhood with the given ones.
    fn exchange(&mut self, paths: &[Path]) {
        self.agents.iter().for_each(|&agent| self.solution.remove(agent));
        for (&agent, path) in self.agents.iter().zip(paths) {
            self.solution.insert(agent, path);
        }
    }

    /// Applies the changes of other workers.
    fn apply_changes(&mut self) {
        self.apply_changes_and_check(&[]);
    }

    /// Applies the changes of other workers; returns whether they concern any of these agents.
    fn apply_changes_and_check(&mut self, agents: &[Agent]) -> bool {
        let mut is_changed = false;
        for change in self.changes.unseen() {
            is_changed |= change.agents.iter().any(|agent| agents.contains(agent));
            self.agents.clear();
            self.agents.extend_from_slice(&change.agents);
            self.exchange(&change.paths);
        }
        is_changed
    }
}

/// Copies paths into reused buffers.
fn copy_paths<'p>(buffers: &mut Vec<Path>, paths: impl Iterator<Item = &'p [Vertex]>) {
    for (index, path) in paths.enumerate() {
        if index == buffers.len() {
            buffers.push(Path::new());
        }
        buffers[index].clear();
        buffers[index].extend_from_slice(path);
    }
}
