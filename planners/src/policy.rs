//! Planners as policies: they drive any environment by their plans, and are told of the world the map and its state,
//! thus no goal that is still to come unless that is asked for.

use std::sync::Arc;

use pogema_core::{Action, Cell, Error, Instance, Map, State};

use crate::foresight::Foresight;
use crate::graph::Graph;
use crate::lifelong::Lifelong;
use crate::names::{self, Choice};
use crate::plan::Plan;
use crate::problem::{Budget, Outcome, Planner, Problem};

/// A planner that brings the agents of an environment to their goals.
///
/// It plans when the episode begins, and again from where the agents are whenever they, or their goals, are not where
/// the plan has them.
///
/// Agents that take no part any more are left out of new plans; that one leaves as planned changes no plan.
pub struct PlannerPolicy {
    planner: Box<dyn Planner>,
    budget: Budget,
    most_steps: Option<u64>,
    graph: Option<(Map, Arc<Graph>)>,
    followed: Option<Followed>,
    outcomes: Vec<Outcome>,
}

/// A plan that is being followed.
struct Followed {
    /// Which agents it is for, in its order.
    agents: Vec<usize>,
    goals: Vec<Cell>,
    plan: Plan,
    /// The step of the episode with which it begins.
    began: u64,
    /// Whether planning anew at its end could lead further.
    is_partial: bool,
}

impl PlannerPolicy {
    /// A policy that lets a planner think for so long each time, in episodes of at most so many steps.
    pub fn new(planner: Box<dyn Planner>, budget: Budget, most_steps: Option<u64>) -> Self {
        Self { planner, budget, most_steps, graph: None, followed: None, outcomes: Vec::new() }
    }

    /// Forgets the last episode.
    pub fn reset(&mut self) {
        self.followed = None;
        self.outcomes.clear();
    }

    /// What the planner found out, each time it was asked in this episode.
    pub fn outcomes(&self) -> &[Outcome] {
        &self.outcomes
    }

    /// Chooses what all agents do; those that take no part, and all without a plan, stay.
    ///
    /// # Errors
    /// [`Error::Agent`] for an agent or goal that is not on a free cell of the map.
    pub fn act(&mut self, map: &Map, now: State<'_>) -> Result<Vec<Action>, Error> {
        if !self.followed.as_ref().is_some_and(|followed| followed.goes_on(now)) {
            self.followed = Some(self.plan(map, now)?);
        }
        let mut actions = vec![Action::Stay; now.cells.len()];
        if let Some(followed) = &self.followed {
            let planned = followed.plan.actions((now.step - followed.began) as usize)?;
            for (&agent, action) in followed.agents.iter().zip(planned) {
                actions[agent] = action;
            }
        }
        Ok(actions)
    }

    fn plan(&mut self, map: &Map, now: State<'_>) -> Result<Followed, Error> {
        let agents: Vec<usize> = (0..now.cells.len()).filter(|&agent| now.active[agent]).collect();
        let of = |cells: &[Cell]| agents.iter().map(|&agent| cells[agent]).collect::<Vec<Cell>>();
        let (cells, goals) = (of(now.cells), of(now.goals));
        let graph = self.graph(map);
        let problem = Problem {
            starts: graph.vertices_of("the agent's cell", &cells)?,
            goals: graph.vertices_of("goal", &goals)?,
            graph,
            most_steps: self.most_steps.map(|most| most.saturating_sub(now.step) as usize),
        };
        let outcome = self.planner.plan(&problem, &self.budget);
        let plan = outcome.best().cloned().map_or_else(|| Plan::new(vec![cells]), Ok)?;
        let is_partial = matches!(&outcome, Outcome::TimedOut { .. } | Outcome::GaveUp { .. });
        self.outcomes.push(outcome);
        Ok(Followed { agents, goals, plan, began: now.step, is_partial })
    }

    /// The graph of a map, made once for it.
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

impl Followed {
    /// Whether the world is as planned, and the plan has not come to an end that leads nowhere.
    fn goes_on(&self, now: State<'_>) -> bool {
        let Some(step) = now.step.checked_sub(self.began).map(|step| step as usize) else { return false };
        if self.is_partial && step >= self.plan.num_steps().max(1) {
            return false;
        }
        let planned = &self.plan.cells()[step.min(self.plan.num_steps())];
        let mut places = self.agents.iter().zip(planned).zip(&self.goals);
        let is_as_planned = places.all(|((&agent, &cell), &goal)| {
            !now.active[agent] || (now.cells[agent] == cell && now.goals[agent] == goal)
        });
        // Someone takes part that the plan does not know: another episode.
        is_as_planned && now.active.iter().filter(|&&active| active).count() <= self.agents.len()
    }
}

/// A planner of a name that drives agents through goal after goal.
///
/// Agents that take no part any more stay where they are, in nobody's way: the planner is not told of them.
pub struct LifelongPolicy {
    name: String,
    choice: Choice,
    budget: Budget,
    planner: Option<(Map, Arc<Graph>, Box<dyn Lifelong>)>,
    foresight: Option<Foresight>,
}

impl LifelongPolicy {
    /// A policy of one of [`names::LIFELONG`] that may think for so long in each step.
    ///
    /// # Errors
    /// [`Error::Config`] for another name.
    pub fn new(name: &str, choice: Choice, budget: Budget) -> Result<Self, Error> {
        let nowhere = Map::new(1, 1, vec![true])?;
        names::lifelong(name, Arc::new(Graph::new(&nowhere)), choice)?;
        Ok(Self { name: name.to_owned(), choice, budget, planner: None, foresight: None })
    }

    /// Forgets the last episode, and the goals that were to come in it.
    pub fn reset(&mut self) {
        self.foresight = None;
        if let Some((_, _, planner)) = &mut self.planner {
            planner.reset();
        }
    }

    /// Tells the planner, in the episode that begins, also of the goals that are still to come, as the paper's RHCR
    /// knows them. It then has to be asked in every step.
    ///
    /// # Errors
    /// [`Error::Config`] for a planner that makes no use of them.
    pub fn foresee(&mut self, instance: &Instance) -> Result<(), Error> {
        let (_, planner) = self.planner_on(instance.map())?;
        if !planner.foresees() {
            return Err(Error::config("planner", &self.name, "`rhcr`, to make use of goals still to come"));
        }
        self.foresight = Some(Foresight::new(instance));
        Ok(())
    }

    /// Chooses what all agents do; those that take no part stay.
    ///
    /// # Errors
    /// [`Error::Agent`] for an agent or goal that is not on a free cell of the map; [`Error::State`] if the goals to
    /// come are known and the state is not the next one of their episode.
    pub fn act(&mut self, map: &Map, now: State<'_>) -> Result<Vec<Action>, Error> {
        let agents: Vec<usize> = (0..now.cells.len()).filter(|&agent| now.active[agent]).collect();
        let to_come = self.foresight.as_mut().map(|foresight| {
            foresight.follow(now)?;
            Ok(agents.iter().map(|&agent| foresight.goals(agent).to_vec()).collect::<Vec<Vec<Cell>>>())
        });
        let to_come = to_come.transpose()?;
        let budget = self.budget.clone();
        let (graph, planner) = self.planner_on(map)?;
        let of = |cells: &[Cell]| agents.iter().map(|&agent| cells[agent]).collect::<Vec<Cell>>();
        let cells = graph.vertices_of("the agent's cell", &of(now.cells))?;
        let next = if let Some(goals) = to_come {
            let vertices = |goals: &Vec<Cell>| graph.vertices_of("goal", goals);
            let goals = goals.iter().map(vertices).collect::<Result<Vec<_>, _>>()?;
            planner.next_foreseeing(&cells, &goals, &budget)?
        } else {
            planner.next(&cells, &graph.vertices_of("goal", &of(now.goals))?, &budget)?
        };
        let mut actions = vec![Action::Stay; now.cells.len()];
        for (&agent, (&from, &to)) in agents.iter().zip(cells.iter().zip(&next)) {
            actions[agent] = graph.action(from, to);
        }
        Ok(actions)
    }

    /// The planner of a map, made once for it.
    fn planner_on(&mut self, map: &Map) -> Result<(Arc<Graph>, &mut dyn Lifelong), Error> {
        let (_, graph, planner) = match self.planner.take() {
            Some(made) if made.0 == *map => self.planner.insert(made),
            _ => {
                let graph = Arc::new(Graph::new(map));
                let planner = names::lifelong(&self.name, graph.clone(), self.choice)?;
                self.planner.insert((map.clone(), graph, planner))
            }
        };
        Ok((graph.clone(), planner.as_mut()))
    }
}
