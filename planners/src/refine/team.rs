//! A valid plan as paths of agents, each of which can be taken out and put back.

use crate::distances::CostToGo;
use crate::graph::{Graph, Vertex};
use crate::problem::Problem;
use crate::refine::reservations::{Path, Reservations};
use crate::stepper::Agent;

/// What a step after the cap costs, so that coming in time goes before all else.
const LATE: u64 = 1 << 20;

/// Paths that meet nowhere, their reservations and their delays.
#[derive(Debug)]
pub(crate) struct Team<'a> {
    problem: &'a Problem,
    costs: &'a [CostToGo],
    paths: Vec<Path>,
    taken: Reservations,
    delays: Vec<u64>,
    total_delay: u64,
}

impl<'a> Team<'a> {
    /// The paths of a valid plan, for times below `span`.
    pub fn new(problem: &'a Problem, costs: &'a [CostToGo], paths: &[Path], span: usize) -> Self {
        let taken = Reservations::new(problem.graph.num_vertices(), span);
        let mut team = Self {
            problem,
            costs,
            paths: vec![Path::new(); paths.len()],
            taken,
            delays: vec![0; paths.len()],
            total_delay: 0,
        };
        for (agent, path) in paths.iter().enumerate() {
            team.put(agent as Agent, path);
        }
        team
    }

    /// The map.
    pub fn graph(&self) -> &'a Graph {
        &self.problem.graph
    }

    /// Number of agents.
    pub fn num_agents(&self) -> usize {
        self.paths.len()
    }

    /// Where an agent starts and ends.
    pub fn ends(&self, agent: Agent) -> (Vertex, Vertex) {
        (self.problem.starts[agent as usize], self.problem.goals[agent as usize])
    }

    /// The costs to go of an agent.
    pub fn costs(&self, agent: Agent) -> &'a [u32] {
        &self.costs[agent as usize]
    }

    /// Steps that an agent needs at least.
    pub fn least(&self, agent: Agent) -> u32 {
        self.costs(agent)[self.problem.starts[agent as usize] as usize]
    }

    /// The path of an agent.
    pub fn path(&self, agent: Agent) -> &Path {
        &self.paths[agent as usize]
    }

    /// All paths.
    pub fn paths(&self) -> &[Path] {
        &self.paths
    }

    /// The reservations of all paths.
    pub fn taken(&self) -> &Reservations {
        &self.taken
    }

    /// Number of times.
    pub fn span(&self) -> u32 {
        self.taken.span()
    }

    /// Who is at a vertex at a time.
    pub fn agent_at(&self, vertex: Vertex, time: u32) -> Option<Agent> {
        self.taken.agent_at(vertex, time)
    }

    /// Who comes the other way.
    pub fn exchanged(&self, from: Vertex, to: Vertex, time: u32) -> Option<Agent> {
        if from != to && self.taken.is_met(from, to, time) { self.agent_at(from, time) } else { None }
    }

    /// The sum of costs, unless somebody comes after the cap.
    pub fn cost(&self) -> Option<u64> {
        let agents = 0..self.num_agents() as Agent;
        let least: u64 = agents.map(|agent| u64::from(self.least(agent))).sum();
        let is_late = self.delays.iter().any(|&delay| delay >= LATE);
        (!is_late).then_some(least + self.total_delay)
    }

    /// How much later an agent arrives than it would alone, and the more if it is after the cap.
    pub fn delay(&self, agent: Agent) -> u64 {
        self.delays[agent as usize]
    }

    /// The delays of all agents.
    pub fn total_delay(&self) -> u64 {
        self.total_delay
    }

    /// The delay of an agent that arrives after so many steps.
    pub fn delay_of(&self, agent: Agent, arrival: u32) -> u64 {
        let late = arrival.saturating_sub(self.problem.most_steps.map_or(u32::MAX, |most| most as u32));
        u64::from(arrival - self.least(agent)) + LATE * u64::from(late)
    }

    /// The latest arrival of an agent that has at most a delay.
    pub fn latest(&self, agent: Agent, delay: u64) -> u32 {
        let on_time = self.problem.most_steps.map_or(u32::MAX, |most| most as u32);
        let least = u64::from(self.least(agent));
        let late = delay.saturating_sub(u64::from(on_time).saturating_sub(least)) / (LATE + 1);
        let arrival = (least + delay).min(u64::from(on_time) + late);
        u32::try_from(arrival).unwrap_or(u32::MAX)
    }

    /// Takes the path of an agent out.
    pub fn lift(&mut self, agent: Agent) {
        let path = std::mem::take(&mut self.paths[agent as usize]);
        self.taken.remove(&path);
        self.paths[agent as usize] = path;
        self.total_delay -= std::mem::take(&mut self.delays[agent as usize]);
    }

    /// Gives an agent that has none in the reservations a path that is free.
    pub fn put(&mut self, agent: Agent, path: &[Vertex]) {
        self.taken.add(agent, path);
        let own = &mut self.paths[agent as usize];
        own.clear();
        own.extend_from_slice(path);
        self.delays[agent as usize] = self.delay_of(agent, path.len() as u32 - 1);
        self.total_delay += self.delays[agent as usize];
    }
}

/// The paths of a plan, without the waiting at their ends.
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

/// The plan of paths.
pub(crate) fn steps_of(paths: &[Path]) -> Vec<Vec<Vertex>> {
    let num_steps = paths.iter().map(Vec::len).max().unwrap_or(1);
    let step = |time: usize| paths.iter().map(|path| path[time.min(path.len() - 1)]).collect();
    (0..num_steps).map(step).collect()
}
