//! What a planner is asked, how long it may think, and what it answers.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use pogema_core::{Cell, Error, Instance, Map};

use crate::distances::{CostToGo, UNREACHABLE};
use crate::flood::Flood;
use crate::graph::{Graph, Vertex};
use crate::plan::Plan;

/// Agents on a map, each to be brought from its start to its goal, where it stays: one-shot MAPF.
#[derive(Clone, Debug)]
pub struct Problem {
    /// The map.
    pub graph: Arc<Graph>,
    /// Where each agent starts.
    pub starts: Vec<Vertex>,
    /// Where each agent is to stay at the end.
    pub goals: Vec<Vertex>,
    /// Most steps that a plan may have.
    pub most_steps: Option<usize>,
}

impl Problem {
    /// A problem without a bound on its steps.
    ///
    /// # Errors
    /// [`Error::Length`] unless each start has a goal; [`Error::Agent`] for a cell that is off the map or an
    /// obstacle. Equal starts or goals are no error: they make it impossible.
    pub fn new(map: &Map, starts: &[Cell], goals: &[Cell]) -> Result<Self, Error> {
        Error::check_length("goals", starts.len(), goals.len())?;
        let graph = Graph::new(map);
        let starts = graph.vertices_of("start", starts)?;
        let goals = graph.vertices_of("goal", goals)?;
        Ok(Self { graph: Arc::new(graph), starts, goals, most_steps: None })
    }

    /// The problem that an instance begins with, its first goals.
    ///
    /// # Errors
    /// As for [`Problem::new`].
    pub fn of(instance: &Instance) -> Result<Self, Error> {
        Self::new(instance.map(), instance.starts(), &instance.first_goals())
    }

    /// The same problem with a bound on the steps of a plan.
    #[must_use]
    pub fn within(mut self, most_steps: usize) -> Self {
        self.most_steps = Some(most_steps);
        self
    }

    /// The same for some of the agents, as if there were no others.
    pub(crate) fn only(&self, agents: &[usize]) -> Self {
        let pick = |all: &[Vertex]| agents.iter().map(|&agent| all[agent]).collect();
        let (starts, goals) = (pick(&self.starts), pick(&self.goals));
        Self { graph: self.graph.clone(), starts, goals, most_steps: self.most_steps }
    }

    /// Number of agents.
    pub fn num_agents(&self) -> usize {
        self.starts.len()
    }

    /// The plan of vertices at the start and after each step.
    ///
    /// # Errors
    /// As for [`Plan::new`].
    pub fn plan(&self, steps: &[Vec<Vertex>]) -> Result<Plan, Error> {
        let cells = |step: &Vec<Vertex>| step.iter().map(|&vertex| self.graph.cell(vertex)).collect();
        Plan::new(steps.iter().map(cells).collect())
    }

    /// The costs to go of each agent, unless one look at each of them tells already that there is no plan, or takes
    /// all the time there is.
    pub(crate) fn survey(&self, clock: &mut Clock) -> Result<Vec<CostToGo>, Outcome> {
        for (what, vertices) in [("start at", &self.starts), ("want to stay at", &self.goals)] {
            if let Some((first, second, vertex)) = equal(vertices) {
                let cell = self.graph.cell(vertex);
                let reason = format!("agents {first} and {second} both {what} {cell}");
                return Err(Outcome::Impossible { reason });
            }
        }
        let mut flood = Flood::new(&self.graph);
        let mut costs = Vec::with_capacity(self.num_agents());
        for (agent, &goal) in self.goals.iter().enumerate() {
            if clock.is_spent() {
                return Err(clock.unsolved(self.plan(std::slice::from_ref(&self.starts)).ok(), 0));
            }
            let own: CostToGo = flood.costs_to_go(goal).collect();
            if let Some(reason) = self.obstruction(agent, &own) {
                return Err(Outcome::Impossible { reason });
            }
            costs.push(own);
        }
        Ok(costs)
    }

    /// Why an agent cannot be brought to its goal, even alone.
    fn obstruction(&self, agent: usize, costs: &CostToGo) -> Option<String> {
        let cost = costs[self.starts[agent] as usize];
        let (from, to) = (self.graph.cell(self.starts[agent]), self.graph.cell(self.goals[agent]));
        if cost == UNREACHABLE {
            return Some(format!("no path leads agent {agent} from {from} to {to}"));
        }
        let most = self.most_steps.filter(|&most| cost as usize > most)?;
        Some(format!("agent {agent} needs {cost} steps from {from} to {to}, of {most}"))
    }

    /// The least that the sum of costs can be: the way of each agent as if it were alone.
    pub(crate) fn lower_bound(&self, costs: &[CostToGo]) -> u64 {
        let cost = |(&start, costs): (&Vertex, &CostToGo)| u64::from(costs[start as usize]);
        self.starts.iter().zip(costs).map(cost).sum()
    }
}

/// The first two agents of one vertex.
fn equal(vertices: &[Vertex]) -> Option<(usize, usize, Vertex)> {
    let mut seen = std::collections::HashMap::with_capacity(vertices.len());
    vertices
        .iter()
        .enumerate()
        .find_map(|(agent, &vertex)| seen.insert(vertex, agent).map(|first| (first, agent, vertex)))
}

/// What a planner found out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// A valid plan that brings all agents to their goals, and the least that any plan's sum of costs can be; if
    /// the two are equal, it is optimal.
    Solved {
        /// The plan.
        plan: Plan,
        /// Units: steps, summed over all agents.
        lower_bound: u64,
    },
    /// The budget was spent before. What was found by then is valid, but brings not all agents to their goals.
    TimedOut {
        /// The plan that came closest, if there is one.
        best: Option<Plan>,
        /// The least that any plan's sum of costs can be, as far as it is known. Units: steps, summed over all agents.
        lower_bound: u64,
    },
    /// The planner knows no better, though it had time left: others may find a plan. What was found is valid, but
    /// brings not all agents to their goals.
    GaveUp {
        /// The plan that came closest, if there is one.
        best: Option<Plan>,
        /// The least that any plan's sum of costs can be, as far as it is known. Units: steps, summed over all agents.
        lower_bound: u64,
    },
    /// There is no plan.
    Impossible {
        /// Why.
        reason: String,
    },
}

impl Outcome {
    /// The plan that solves the problem.
    pub fn solution(&self) -> Option<&Plan> {
        match self {
            Self::Solved { plan, .. } => Some(plan),
            _ => None,
        }
    }

    /// The least that any plan's sum of costs can be, as far as it is known; none where there is no plan.
    pub fn lower_bound(&self) -> Option<u64> {
        match *self {
            Self::Solved { lower_bound, .. }
            | Self::TimedOut { lower_bound, .. }
            | Self::GaveUp { lower_bound, .. } => Some(lower_bound),
            Self::Impossible { .. } => None,
        }
    }

    /// The plan that solves the problem, or else the one that came closest.
    pub fn best(&self) -> Option<&Plan> {
        match self {
            Self::Solved { plan, .. } => Some(plan),
            Self::TimedOut { best, .. } | Self::GaveUp { best, .. } => best.as_ref(),
            Self::Impossible { .. } => None,
        }
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Solved { plan, lower_bound } => {
                let (cost, makespan) = (plan.sum_of_costs(), plan.makespan());
                write!(f, "solved: sum of costs {cost}, at least {lower_bound}; makespan {makespan}")
            }
            Self::TimedOut { lower_bound, .. } => write!(f, "timed out; sum of costs at least {lower_bound}"),
            Self::GaveUp { lower_bound, .. } => write!(f, "gave up; sum of costs at least {lower_bound}"),
            Self::Impossible { reason } => write!(f, "impossible: {reason}"),
        }
    }
}

/// How long a planner may think; without any bound, until it is done.
#[derive(Clone, Debug, Default)]
pub struct Budget {
    /// Wall-clock time.
    pub time: Option<Duration>,
    /// Nodes of the planner's search; what a node is, each planner says. The same number gives the same plan.
    pub nodes: Option<u64>,
    /// Set by anybody to make the planner stop soon.
    pub cancelled: Option<Arc<AtomicBool>>,
}

impl Budget {
    /// So much wall-clock time.
    pub fn of_time(time: Duration) -> Self {
        Self { time: Some(time), ..Self::default() }
    }

    /// So many nodes.
    pub fn of_nodes(nodes: u64) -> Self {
        Self { nodes: Some(nodes), ..Self::default() }
    }

    /// The budget from now on.
    pub fn start(&self) -> Clock {
        Clock { budget: self.clone(), began: Instant::now(), num_nodes: 0, is_spent: false }
    }
}

/// A budget that is being spent.
#[derive(Debug)]
pub struct Clock {
    budget: Budget,
    began: Instant,
    num_nodes: u64,
    is_spent: bool,
}

impl Clock {
    /// Nodes between two looks at the time.
    const STRIDE: u64 = 16;

    /// Counts a node; whether the budget is spent, and this node not to be worked on.
    pub fn count_node(&mut self) -> bool {
        if self.budget.nodes.is_some_and(|nodes| self.num_nodes >= nodes) {
            self.is_spent = true;
        }
        let looks = self.num_nodes.is_multiple_of(Self::STRIDE);
        self.num_nodes += 1;
        self.is_spent || (looks && self.is_spent())
    }

    /// Whether the budget is spent.
    pub fn is_spent(&mut self) -> bool {
        let is_late = self.budget.time.is_some_and(|time| self.began.elapsed() >= time);
        let is_cancelled = self.budget.cancelled.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed));
        self.is_spent |= is_late || is_cancelled;
        self.is_spent
    }

    /// What it came to if no plan was found.
    pub(crate) fn unsolved(&mut self, best: Option<Plan>, lower_bound: u64) -> Outcome {
        if self.is_spent() {
            Outcome::TimedOut { best, lower_bound }
        } else {
            Outcome::GaveUp { best, lower_bound }
        }
    }

    /// Nodes counted so far.
    pub fn num_nodes(&self) -> u64 {
        self.num_nodes
    }

    /// Time since the start.
    pub fn elapsed(&self) -> Duration {
        self.began.elapsed()
    }
}

/// Who makes plans for whole problems.
pub trait Planner: Send {
    /// A short name, as the command line knows it.
    fn name(&self) -> &'static str;

    /// Makes a plan within a budget. It never panics, and stops soon after the budget is spent.
    fn plan(&mut self, problem: &Problem, budget: &Budget) -> Outcome;
}
