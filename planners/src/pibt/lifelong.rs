//! PIBT as a lifelong planner.

use std::sync::Arc;

use pogema_core::Error;

use crate::budget::Budget;
use crate::distances::{CostToGo, Distances};
use crate::graph::{Graph, Vertex};
use crate::lifelong::{Lifelong, check_vertices, shares_vertex};
use crate::pibt::guidance::Guidance;
use crate::pibt::input::StepInput;
use crate::pibt::planner::PibtParams;
use crate::pibt::priorities::Priorities;
use crate::pibt::step::PibtStep;
use crate::problem::Agent;

/// Lifelong PIBT, with or without traffic guidance. It ignores its budget: one step is always fast.
#[derive(Debug)]
pub struct PibtLifelong {
    graph: Arc<Graph>,
    params: PibtParams,
    step: PibtStep,
    priorities: Priorities,
    goals: Vec<Vertex>,
    costs: CostTables,
}

/// The costs to go that agents follow.
#[derive(Debug)]
enum CostTables {
    /// Shortest paths.
    Shortest { distances: Distances, costs: Vec<CostToGo> },
    /// Guide paths: costs to go that include congestion.
    Guided { guidance: Guidance, costs: Vec<Vec<u32>> },
}

impl PibtLifelong {
    /// Creates a planner for a map. The first step sets the number of agents.
    pub fn new(graph: Arc<Graph>, params: PibtParams) -> Self {
        Self::for_agents(graph, 0, params)
    }

    fn for_agents(graph: Arc<Graph>, num_agents: usize, params: PibtParams) -> Self {
        let costs = match params.guidance {
            Some(guidance) => CostTables::Guided {
                guidance: Guidance::new(graph.clone(), num_agents, guidance),
                costs: vec![Vec::new(); num_agents],
            },
            None => CostTables::Shortest {
                distances: Distances::new(graph.clone(), Distances::DEFAULT_BYTES),
                costs: Vec::new(),
            },
        };
        let step = PibtStep::new(&graph, params.rules, params.seed);
        let priorities = Priorities::new(num_agents, |_| 0);
        Self { graph, params, step, priorities, goals: vec![Vertex::MAX; num_agents], costs }
    }

    /// Returns the next configuration. Goals may be equal or unreachable. A different number of agents begins a new
    /// episode.
    ///
    /// # Errors
    /// [`Error::Length`] unless each agent has a goal; [`Error::Agent`] for an unknown vertex, or for a vertex that
    /// holds two agents.
    pub fn step(&mut self, now: &[Vertex], goals: &[Vertex]) -> Result<&[Vertex], Error> {
        check_vertices(self.graph.num_vertices(), now, goals)?;
        if let Some((agent, other)) = self.step.find_shared_vertex(now) {
            return Err(shares_vertex(agent, now[agent], other));
        }
        if now.len() != self.goals.len() {
            *self = Self::for_agents(self.graph.clone(), now.len(), self.params.clone());
        }
        self.update_costs(now, goals);
        let graph = &self.graph;
        let order = self.priorities.order();
        let next = match &self.costs {
            CostTables::Shortest { costs, .. } => {
                self.step.run(&StepInput { graph, now, goals, costs, order }, &[])
            }
            CostTables::Guided { costs, .. } => {
                self.step.run(&StepInput { graph, now, goals, costs, order }, &[])
            }
        };
        // INVARIANT: the agents are on different vertices, so PIBT finds a move for each.
        let next = next.ok_or_else(|| Error::instance("two agents share a cell"))?;
        self.priorities.update(|agent| next[agent] == goals[agent]);
        Ok(next)
    }

    /// Computes the costs to go of new goals.
    fn update_costs(&mut self, now: &[Vertex], goals: &[Vertex]) {
        if let CostTables::Shortest { distances, costs } = &mut self.costs
            && costs.is_empty()
        {
            *costs = distances.to_all(goals);
        }
        for (agent, &goal) in goals.iter().enumerate() {
            if self.goals[agent] == goal {
                continue;
            }
            match &mut self.costs {
                CostTables::Shortest { distances, costs } => costs[agent] = distances.to(goal),
                CostTables::Guided { guidance, costs } => {
                    guidance.plan(agent as Agent, now[agent], goal, &mut costs[agent]);
                }
            }
        }
        self.goals.copy_from_slice(goals);
    }
}

impl Lifelong for PibtLifelong {
    fn reset(&mut self) {
        *self = Self::new(self.graph.clone(), self.params.clone());
    }

    fn next(&mut self, now: &[Vertex], goals: &[Vertex], _: &Budget) -> Result<Vec<Vertex>, Error> {
        self.step(now, goals).map(<[Vertex]>::to_vec)
    }
}
