//! Lifelong planners as policies.

use std::sync::Arc;

use pogema_core::{Action, Cell, Error, Instance, Map, State};

use crate::budget::Budget;
use crate::graph::Graph;
use crate::lifelong::Lifelong;
use crate::policies::goal_forecast::GoalForecast;
use crate::registry::{LifelongName, PlannerSettings};

/// A lifelong planner that controls the agents of an environment.
///
/// Inactive agents stay and are hidden from the planner.
pub struct LifelongPolicy {
    name: LifelongName,
    settings: PlannerSettings,
    budget: Budget,
    planner: Option<(Map, Arc<Graph>, Box<dyn Lifelong>)>,
    forecast: Option<GoalForecast>,
}

impl LifelongPolicy {
    /// Number of goals of each agent that a planner with future goals knows, including the current one.
    const NUM_GOALS: usize = 24;

    /// Creates a policy of a planner, with a budget for each step.
    pub fn new(name: LifelongName, settings: PlannerSettings, budget: Budget) -> Self {
        Self { name, settings, budget, planner: None, forecast: None }
    }

    /// Clears the state of the episode, including future goals.
    pub fn reset(&mut self) {
        self.forecast = None;
        if let Some((_, _, planner)) = &mut self.planner {
            planner.reset();
        }
    }

    /// Provides the future goals of the new episode to the planner, as in the RHCR paper. [`LifelongPolicy::act`] must
    /// then be called in every step.
    ///
    /// # Errors
    /// [`Error::Argument`] for a planner that does not use future goals.
    pub fn provide_future_goals(&mut self, instance: &Instance) -> Result<(), Error> {
        let (_, planner) = self.planner_on(instance.map());
        if !planner.uses_future_goals() {
            return Err(Error::argument(
                "planner",
                self.name,
                "a planner that uses future goals, such as `rhcr`",
            ));
        }
        self.forecast = Some(GoalForecast::new(instance, Self::NUM_GOALS));
        Ok(())
    }

    /// Returns the actions of all agents; inactive agents stay.
    ///
    /// # Errors
    /// [`Error::Agent`] for an agent or a goal that is not on a free cell; [`Error::Length`] or [`Error::OutOfStep`] if
    /// future goals are provided and the state is not the next one of their episode; [`Error::Cancelled`] if the budget
    /// is cancelled while the planner runs. In that case, the planner forgets its plan. If future goals are provided,
    /// reset the policy after an error.
    pub fn act(&mut self, map: &Map, now: State<'_>) -> Result<Vec<Action>, Error> {
        let agents: Vec<usize> = (0..now.cells.len()).filter(|&agent| now.active[agent]).collect();
        let future = self.forecast.as_mut().map(|forecast| {
            forecast.follow(now)?;
            Ok(agents.iter().map(|&agent| forecast.goals(agent).to_vec()).collect::<Vec<Vec<Cell>>>())
        });
        let future = future.transpose()?;
        let budget = self.budget.clone();
        let (graph, planner) = self.planner_on(map);
        let vertices = |what: &str, cells: &[Cell]| {
            let of = |&agent: &usize| graph.vertex_of(agent, what, cells[agent]);
            agents.iter().map(of).collect::<Result<Vec<_>, _>>()
        };
        let cells = vertices("the agent's cell", now.cells)?;
        let next = if let Some(goals) = future {
            let of = |(&agent, goals): (&usize, &Vec<Cell>)| {
                goals.iter().map(|&goal| graph.vertex_of(agent, "goal", goal)).collect::<Result<Vec<_>, _>>()
            };
            let goals = agents.iter().zip(&goals).map(of).collect::<Result<Vec<_>, _>>()?;
            planner.next_with_future_goals(&cells, &goals, &budget)?
        } else {
            planner.next(&cells, &vertices("goal", now.goals)?, &budget)?
        };
        if budget.is_cancelled() {
            planner.reset();
            return Err(Error::Cancelled);
        }
        let mut actions = vec![Action::Stay; now.cells.len()];
        for (&agent, (&from, &to)) in agents.iter().zip(cells.iter().zip(&next)) {
            actions[agent] = graph.action(from, to);
        }
        Ok(actions)
    }

    /// Returns the planner of a map, from the cache if the map is the same.
    fn planner_on(&mut self, map: &Map) -> (Arc<Graph>, &mut dyn Lifelong) {
        let (_, graph, planner) = match self.planner.take() {
            Some(made) if made.0 == *map => self.planner.insert(made),
            _ => {
                let graph = Arc::new(Graph::new(map));
                let planner = self.name.make(graph.clone(), self.settings);
                self.planner.insert((map.clone(), graph, planner))
            }
        };
        (graph.clone(), planner.as_mut())
    }
}
