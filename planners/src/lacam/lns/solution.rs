//! The solution that the LNS refines: the paths of all agents, their reservations and their delays.

use crate::distances::CostToGo;
use crate::graph::{Graph, Vertex};
use crate::lacam::lns::time_table::{Path, TimeTable};
use crate::problem::{Agent, Problem};

/// The additional delay of a step after the step limit, which outweighs everything else.
const LATE: u64 = 1 << 20;

/// Paths without conflicts, their reservations and their delays.
#[derive(Debug)]
pub(crate) struct Solution<'a> {
    problem: &'a Problem,
    costs: &'a [CostToGo],
    paths: Vec<Path>,
    table: TimeTable,
    delays: Vec<u64>,
    total_delay: u64,
}

impl<'a> Solution<'a> {
    /// Creates a solution of conflict-free paths, for times below `span`.
    pub fn new(problem: &'a Problem, costs: &'a [CostToGo], paths: &[Path], span: usize) -> Self {
        let table = TimeTable::new(problem.graph.num_vertices(), span);
        let mut solution = Self {
            problem,
            costs,
            paths: vec![Path::new(); paths.len()],
            table,
            delays: vec![0; paths.len()],
            total_delay: 0,
        };
        for (agent, path) in paths.iter().enumerate() {
            solution.insert(agent as Agent, path);
        }
        solution
    }

    /// Returns the map.
    pub fn graph(&self) -> &'a Graph {
        &self.problem.graph
    }

    /// Returns the number of agents.
    pub fn num_agents(&self) -> usize {
        self.paths.len()
    }

    /// Returns the start and the goal of an agent.
    pub fn ends(&self, agent: Agent) -> (Vertex, Vertex) {
        (self.problem.starts[agent as usize], self.problem.goals[agent as usize])
    }

    /// Returns the costs to go of an agent.
    pub fn costs(&self, agent: Agent) -> &'a [u32] {
        &self.costs[agent as usize]
    }

    /// Returns the shortest distance of an agent. Units: steps.
    pub fn distance(&self, agent: Agent) -> u32 {
        self.costs(agent)[self.problem.starts[agent as usize] as usize]
    }

    /// Returns the path of an agent.
    pub fn path(&self, agent: Agent) -> &Path {
        &self.paths[agent as usize]
    }

    /// Returns all paths.
    pub fn paths(&self) -> &[Path] {
        &self.paths
    }

    /// Returns the reservations of all paths.
    pub fn table(&self) -> &TimeTable {
        &self.table
    }

    /// Returns the number of time steps.
    pub fn span(&self) -> u32 {
        self.table.span()
    }

    /// Returns the agent at a vertex at a time.
    pub fn agent_at(&self, vertex: Vertex, time: u32) -> Option<Agent> {
        self.table.agent_at(vertex, time)
    }

    /// Returns the agent that moves from `to` to `from` in the same step as a move from `from` to `to` that ends at
    /// `time`.
    pub fn swapping(&self, from: Vertex, to: Vertex, time: u32) -> Option<Agent> {
        if from != to && self.table.is_swap(from, to, time) { self.agent_at(from, time) } else { None }
    }

    /// Returns the sum of costs, unless an agent arrives after the step limit.
    pub fn cost(&self) -> Option<u64> {
        let agents = 0..self.num_agents() as Agent;
        let distances: u64 = agents.map(|agent| u64::from(self.distance(agent))).sum();
        let is_late = self.delays.iter().any(|&delay| delay >= LATE);
        (!is_late).then_some(distances + self.total_delay)
    }

    /// Returns the delay of an agent: its cost minus its shortest distance. Steps after the step limit add more.
    pub fn delay(&self, agent: Agent) -> u64 {
        self.delays[agent as usize]
    }

    /// Returns the total delay of all agents.
    pub fn total_delay(&self) -> u64 {
        self.total_delay
    }

    /// Returns the delay of an agent for an arrival.
    pub fn delay_of(&self, agent: Agent, arrival: u32) -> u64 {
        let late = arrival.saturating_sub(self.problem.last_step());
        u64::from(arrival - self.distance(agent)) + LATE * u64::from(late)
    }

    /// Returns the latest arrival of an agent with at most a given delay.
    pub fn latest(&self, agent: Agent, delay: u64) -> u32 {
        let on_time = self.problem.last_step();
        let distance = u64::from(self.distance(agent));
        let late = delay.saturating_sub(u64::from(on_time).saturating_sub(distance)) / (LATE + 1);
        let arrival = (distance + delay).min(u64::from(on_time) + late);
        u32::try_from(arrival).unwrap_or(u32::MAX)
    }

    /// Removes the reservations of the path of an agent.
    pub fn remove(&mut self, agent: Agent) {
        let path = std::mem::take(&mut self.paths[agent as usize]);
        self.table.remove(&path);
        self.paths[agent as usize] = path;
        self.total_delay -= std::mem::take(&mut self.delays[agent as usize]);
    }

    /// Assigns a conflict-free path to an agent without reservations.
    pub fn insert(&mut self, agent: Agent, path: &[Vertex]) {
        self.table.add(agent, path);
        let own = &mut self.paths[agent as usize];
        own.clear();
        own.extend_from_slice(path);
        self.delays[agent as usize] = self.delay_of(agent, path.len() as u32 - 1);
        self.total_delay += self.delays[agent as usize];
    }
}

/// Converts configurations to paths without the waits at their ends.
pub(crate) fn paths_of(steps: &[Vec<Vertex>]) -> Vec<Path> {
    let num_agents = steps.first().map_or(0, Vec::len);
    let path = |agent: usize| {
        let mut path: Path = steps.iter().map(|step| step[agent]).collect();
        while path.len() > 1 && path[path.len() - 1] == path[path.len() - 2] {
            path.pop();
        }
        path
    };
    (0..num_agents).map(path).collect()
}

/// Converts paths to configurations.
pub(crate) fn configurations_of(paths: &[Path]) -> Vec<Vec<Vertex>> {
    let num_steps = paths.iter().map(Vec::len).max().unwrap_or(1);
    let step = |time: usize| paths.iter().map(|path| path[time.min(path.len() - 1)]).collect();
    (0..num_steps).map(step).collect()
}
