//! One-shot MAPF problems.

use std::sync::Arc;

use pogema_core::{Cell, Error, Instance, Map, counted};

use crate::bfs::{Bfs, UNREACHABLE};
use crate::budget::{Budget, Clock};
use crate::distances::CostToGo;
use crate::graph::{Graph, Vertex};
use crate::outcome::Outcome;
use crate::plan::Plan;

/// The index of an agent.
pub(crate) type Agent = u32;

/// A one-shot MAPF problem: each agent goes from its start to its goal and stays there.
#[derive(Clone, Debug)]
pub struct Problem {
    /// The map.
    pub graph: Arc<Graph>,
    /// The start of each agent.
    pub starts: Vec<Vertex>,
    /// The goal of each agent.
    pub goals: Vec<Vertex>,
    /// The step limit of a plan.
    pub max_steps: Option<usize>,
}

impl Problem {
    /// Creates a problem without a step limit.
    ///
    /// # Errors
    /// [`Error::Length`] if the numbers of starts and goals differ; [`Error::Agent`] for a cell that is off the map or
    /// an obstacle. Equal starts or equal goals are not an error; such a problem is impossible.
    pub fn new(map: &Map, starts: &[Cell], goals: &[Cell]) -> Result<Self, Error> {
        Error::check_length("goals", starts.len(), goals.len())?;
        let graph = Graph::new(map);
        let starts = graph.vertices_of("start", starts)?;
        let goals = graph.vertices_of("goal", goals)?;
        Ok(Self { graph: Arc::new(graph), starts, goals, max_steps: None })
    }

    /// Creates the problem of an instance and its first goals.
    ///
    /// # Errors
    /// As for [`Problem::new`].
    pub fn of(instance: &Instance) -> Result<Self, Error> {
        Self::new(instance.map(), instance.starts(), &instance.first_goals())
    }

    /// Returns the same problem with a step limit.
    #[must_use]
    pub fn within(mut self, max_steps: usize) -> Self {
        self.max_steps = Some(max_steps);
        self
    }

    /// Returns the last step in which an agent may arrive. Units: steps.
    pub(crate) fn last_step(&self) -> u32 {
        self.max_steps.map_or(u32::MAX, |limit| u32::try_from(limit).unwrap_or(u32::MAX))
    }

    /// Creates the problem of a subset of the agents.
    pub(crate) fn only(&self, agents: &[usize]) -> Self {
        let pick = |all: &[Vertex]| agents.iter().map(|&agent| all[agent]).collect();
        let (starts, goals) = (pick(&self.starts), pick(&self.goals));
        Self { graph: self.graph.clone(), starts, goals, max_steps: self.max_steps }
    }

    /// Returns the number of agents.
    pub fn num_agents(&self) -> usize {
        self.starts.len()
    }

    /// Converts configurations, at the start and after each step, to a plan.
    ///
    /// # Errors
    /// As for [`Plan::new`].
    pub fn plan_of(&self, steps: &[Vec<Vertex>]) -> Result<Plan, Error> {
        let cells = |step: &Vec<Vertex>| step.iter().map(|&vertex| self.graph.cell(vertex)).collect();
        Plan::new(steps.iter().map(cells).collect())
    }

    /// Computes the costs to go of each agent and calls `plan` with them. If the computation finds that no plan exists,
    /// or the budget runs out, returns that outcome instead.
    pub(crate) fn solve(&self, budget: &Budget, plan: impl FnOnce(&[CostToGo], Clock) -> Outcome) -> Outcome {
        let mut clock = budget.start();
        self.costs_to_go(&mut clock).map_or_else(|outcome| outcome, |costs| plan(&costs, clock))
    }

    /// Computes the costs to go of each agent.
    ///
    /// # Errors
    /// [`Outcome::Impossible`] if two agents share a start or a goal, or if an agent, even alone, cannot reach its goal
    /// or cannot reach it within the step limit; [`Outcome::TimedOut`] if the budget runs out.
    fn costs_to_go(&self, clock: &mut Clock) -> Result<Vec<CostToGo>, Outcome> {
        for (what, vertices) in [("start", &self.starts), ("goal", &self.goals)] {
            if let Some((first, second, vertex)) = shared_vertex(vertices) {
                let cell = self.graph.cell(vertex);
                let reason = format!("agents {first} and {second} have the same {what} {cell}");
                return Err(Outcome::Impossible { reason });
            }
        }
        let mut bfs = Bfs::new(&self.graph);
        let mut costs = Vec::with_capacity(self.num_agents());
        for (agent, &goal) in self.goals.iter().enumerate() {
            if clock.is_spent() {
                return Err(clock.unsolved(self.plan_of(std::slice::from_ref(&self.starts)).ok(), 0));
            }
            let own: CostToGo = bfs.costs_to_go(goal).collect();
            if let Some(reason) = self.blocked(agent, &own) {
                return Err(Outcome::Impossible { reason });
            }
            costs.push(own);
        }
        Ok(costs)
    }

    /// Returns the reason if an agent, even alone, cannot reach its goal or cannot reach it within the step limit.
    fn blocked(&self, agent: usize, costs: &CostToGo) -> Option<String> {
        let cost = costs[self.starts[agent] as usize];
        let (from, to) = (self.graph.cell(self.starts[agent]), self.graph.cell(self.goals[agent]));
        if cost == UNREACHABLE {
            return Some(format!("no path leads agent {agent} from {from} to {to}"));
        }
        let limit = self.max_steps.filter(|&limit| cost as usize > limit)?;
        Some({
            let needed = counted(cost as usize, "step");
            format!("agent {agent} needs {needed} from {from} to {to}, but the step limit is {limit}")
        })
    }

    /// Returns the sum of the shortest distances, a lower bound on the sum of costs.
    pub(crate) fn lower_bound(&self, costs: &[CostToGo]) -> u64 {
        let cost = |(&start, costs): (&Vertex, &CostToGo)| u64::from(costs[start as usize]);
        self.starts.iter().zip(costs).map(cost).sum()
    }
}

/// Returns the first two agents that share a vertex, and the vertex.
pub(crate) fn shared_vertex(vertices: &[Vertex]) -> Option<(usize, usize, Vertex)> {
    let mut seen = std::collections::HashMap::with_capacity(vertices.len());
    vertices
        .iter()
        .enumerate()
        .find_map(|(agent, &vertex)| seen.insert(vertex, agent).map(|first| (first, agent, vertex)))
}
