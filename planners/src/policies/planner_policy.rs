//! One-shot planners as policies.

use std::sync::Arc;

use pogema_core::{Action, Cell, Error, Map, State};

use crate::budget::Budget;
use crate::graph::Graph;
use crate::outcome::Outcome;
use crate::plan::Plan;
use crate::planner::Planner;
use crate::problem::Problem;

/// A one-shot planner that controls the agents of an environment.
///
/// It plans at the start of the episode, and again whenever an agent or a goal deviates from the plan. If a plan does
/// not bring all agents to their goals, it also plans again at the end of that plan. New plans leave out inactive
/// agents. An agent that leaves as planned does not trigger replanning.
///
/// If the planner proves that no plan brings all agents to their goals within the steps that are left, it plans without
/// the step limit, so that one distant goal does not keep all agents from theirs.
pub struct PlannerPolicy {
    planner: Box<dyn Planner>,
    budget: Budget,
    max_steps: Option<u64>,
    is_single_attempt: bool,
    graph: Option<(Map, Arc<Graph>)>,
    current: Option<CurrentPlan>,
    first_outcome: Option<Outcome>,
    num_calls: usize,
}

/// The plan that the agents follow.
struct CurrentPlan {
    /// The agents of the plan, in its order.
    agents: Vec<usize>,
    goals: Vec<Cell>,
    plan: Plan,
    /// The step of the episode at which the plan starts.
    start: u64,
    /// Whether the plan solves only part of the problem, so that replanning at its end may help.
    is_partial: bool,
}

impl PlannerPolicy {
    /// Creates a policy with a budget for each plan, in episodes with a step limit.
    pub fn new(planner: Box<dyn Planner>, budget: Budget, max_steps: Option<u64>) -> Self {
        let (is_single_attempt, graph, current, first_outcome) = (false, None, None, None);
        Self { planner, budget, max_steps, is_single_attempt, graph, current, first_outcome, num_calls: 0 }
    }

    /// Makes all agents stay to the end of the episode if the planner finds no plan. By default, the planner is called
    /// again in each step, with the whole budget, unless it proves that no plan exists.
    ///
    /// A single attempt also keeps the step limit: the policy never plans without it.
    #[must_use]
    pub fn with_single_attempt(mut self) -> Self {
        self.is_single_attempt = true;
        self
    }

    /// Clears the state of the episode.
    pub fn reset(&mut self) {
        self.current = None;
        self.first_outcome = None;
        self.num_calls = 0;
    }

    /// Returns the outcome of the first call of the planner in this episode.
    pub fn first_outcome(&self) -> Option<&Outcome> {
        self.first_outcome.as_ref()
    }

    /// Returns the number of calls of the planner in this episode.
    pub fn num_calls(&self) -> usize {
        self.num_calls
    }

    /// Returns the actions of all agents. Inactive agents stay; without a plan, all agents stay.
    ///
    /// # Errors
    /// [`Error::Agent`] for an agent or a goal that is not on a free cell; [`Error::Cancelled`] if the budget is
    /// cancelled while the planner runs.
    pub fn act(&mut self, map: &Map, now: State<'_>) -> Result<Vec<Action>, Error> {
        if !self.current.as_ref().is_some_and(|plan| plan.is_followed(now)) {
            self.current = Some(self.plan(map, now)?);
        }
        let mut actions = vec![Action::Stay; now.cells.len()];
        if let Some(current) = &self.current {
            let planned = current.plan.actions((now.step - current.start) as usize)?;
            for (&agent, action) in current.agents.iter().zip(planned) {
                actions[agent] = action;
            }
        }
        Ok(actions)
    }

    /// Plans for the active agents from their current cells.
    fn plan(&mut self, map: &Map, now: State<'_>) -> Result<CurrentPlan, Error> {
        let agents: Vec<usize> = (0..now.cells.len()).filter(|&agent| now.active[agent]).collect();
        let of = |cells: &[Cell]| agents.iter().map(|&agent| cells[agent]).collect::<Vec<Cell>>();
        let (cells, goals) = (of(now.cells), of(now.goals));
        let graph = self.graph(map);
        let vertices = |what: &str, cells: &[Cell]| {
            let of = |(&agent, &cell): (&usize, &Cell)| graph.vertex_of(agent, what, cell);
            agents.iter().zip(cells).map(of).collect::<Result<Vec<_>, _>>()
        };
        let mut problem = Problem {
            starts: vertices("the agent's cell", &cells)?,
            goals: vertices("goal", &goals)?,
            graph,
            max_steps: self.max_steps.map(|limit| limit.saturating_sub(now.step) as usize),
        };
        let mut outcome = self.call(&problem)?;
        let is_impossible = matches!(&outcome, Outcome::Impossible { .. });
        if is_impossible && problem.max_steps.is_some() && !self.is_single_attempt {
            problem.max_steps = None;
            outcome = self.call(&problem)?;
        }
        let is_unfinished = matches!(&outcome, Outcome::TimedOut { .. } | Outcome::GaveUp { .. });
        let is_partial = is_unfinished && !(self.is_single_attempt && outcome.best().is_none());
        let plan = outcome.best().cloned().map_or_else(|| Plan::new(vec![cells]), Ok)?;
        Ok(CurrentPlan { agents, goals, plan, start: now.step, is_partial })
    }

    /// Calls the planner.
    fn call(&mut self, problem: &Problem) -> Result<Outcome, Error> {
        let outcome = self.planner.plan(problem, &self.budget);
        if self.budget.is_cancelled() {
            return Err(Error::Cancelled);
        }
        self.first_outcome.get_or_insert_with(|| outcome.clone());
        self.num_calls += 1;
        Ok(outcome)
    }

    /// Returns the graph of a map, from the cache if the map is the same.
    fn graph(&mut self, map: &Map) -> Arc<Graph> {
        match &self.graph {
            Some((known, graph)) if known == map => graph.clone(),
            _ => {
                let graph = Arc::new(Graph::new(map));
                self.graph = Some((map.clone(), graph.clone()));
                graph
            }
        }
    }
}

impl CurrentPlan {
    /// Returns whether agents and goals are as planned, and a partial plan has not ended.
    fn is_followed(&self, now: State<'_>) -> bool {
        let Some(step) = now.step.checked_sub(self.start).map(|step| step as usize) else { return false };
        if self.is_partial && step >= self.plan.num_steps().max(1) {
            return false;
        }
        let planned = &self.plan.cells()[step.min(self.plan.num_steps())];
        let mut places = self.agents.iter().zip(planned).zip(&self.goals);
        let is_as_planned = places.all(|((&agent, &cell), &goal)| {
            !now.active[agent] || (now.cells[agent] == cell && now.goals[agent] == goal)
        });
        // An active agent that is not in the plan means another episode.
        is_as_planned && now.active.iter().filter(|&&active| active).count() <= self.agents.len()
    }
}
