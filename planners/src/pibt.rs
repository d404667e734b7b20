//! PIBT as a planner: for one goal each, and for goals without end.
//!
//! Paper: Okumura, Machida, Défago, Tamura, "Priority Inheritance with Backtracking for Iterative Multi-agent Path
//! Finding", AIJ 2022; the step itself is in `stepper`, the guidance of lifelong agents in `guide`.
//!
//! | here | there |
//! | --- | --- |
//! | `patience` | p: the priorities, which grow until an agent is at its goal |
//! | `now`, `next` | the configurations before and after a step |

use std::sync::Arc;

use pogema_core::Error;

use crate::distances::{CostToGo, Distances};
use crate::graph::{Graph, Vertex};
use crate::guide::{Guide, GuideParams};
use crate::lifelong::Lifelong;
use crate::problem::{Budget, Clock, Outcome, Planner, Problem};
use crate::scatter::Hints;
use crate::stepper::{Agent, PibtRules, Scene, Stepper, patience_after, patience_by, sort_by_patience};

/// How PIBT goes about it.
#[derive(Clone, Debug, Default)]
pub struct PibtParams {
    /// Seed of ties.
    pub seed: u64,
    /// How single steps are decided.
    pub rules: PibtRules,
    /// How lifelong agents keep out of each other's way from afar, if they do.
    pub guide: Option<GuideParams>,
}

/// The planner PIBT, quick and without any promise; a node of its budget is a step.
#[derive(Clone, Debug, Default)]
pub struct Pibt {
    params: PibtParams,
}

impl Pibt {
    /// The planner of these parameters.
    pub fn new(params: PibtParams) -> Self {
        Self { params }
    }

    /// Steps after which it gives up if neither problem nor budget say: far more than agents need that do not walk in
    /// circles.
    fn most_steps(problem: &Problem) -> usize {
        problem.most_steps.unwrap_or(10 * problem.graph.num_vertices() + 100)
    }

    /// Steps until all are at their goals, or patience or budget are at their end.
    fn walk(
        &self,
        problem: &Problem,
        costs: &[CostToGo],
        mut queue: Queue,
        clock: &mut Clock,
    ) -> Vec<Vec<Vertex>> {
        let (graph, goals) = (&problem.graph, &problem.goals[..]);
        let mut stepper = Stepper::new(graph, self.params.rules, self.params.seed);
        let hints = Hints::default();
        let mut steps = vec![problem.starts.clone()];
        for _ in 0..Self::most_steps(problem) {
            let now = &steps[steps.len() - 1];
            if now == goals || clock.count_node() {
                break;
            }
            let scene = Scene { graph, now, goals, costs, order: queue.order(), hints: &hints };
            let Some(next) = stepper.step(&scene, &[]).map(<[Vertex]>::to_vec) else {
                break;
            };
            queue.wait(|agent| next[agent] == goals[agent]);
            steps.push(next);
        }
        steps
    }
}

impl Planner for Pibt {
    fn name(&self) -> &'static str {
        "pibt"
    }

    fn plan(&mut self, problem: &Problem, budget: &Budget) -> Outcome {
        let mut clock = budget.start();
        let costs = match problem.survey(&mut clock) {
            Ok(costs) => costs,
            Err(outcome) => return outcome,
        };
        let least = |agent: Agent| costs[agent as usize][problem.starts[agent as usize] as usize];
        let lower_bound = problem.lower_bound(&costs);
        let queue = Queue::new(patience_by(problem.num_agents(), least));
        let steps = self.walk(problem, &costs, queue, &mut clock);
        let is_solved = steps.last() == Some(&problem.goals);
        match problem.plan(&steps).ok() {
            Some(plan) if is_solved => Outcome::Solved { plan, lower_bound },
            best => clock.unsolved(best, lower_bound),
        }
    }
}

/// Who chooses before whom.
#[derive(Debug)]
struct Queue {
    patience: Vec<u32>,
    order: Vec<Agent>,
}

impl Queue {
    fn new(patience: Vec<u32>) -> Self {
        let order = (0..patience.len() as Agent).collect();
        Self { patience, order }
    }

    fn order(&mut self) -> &[Agent] {
        sort_by_patience(&mut self.order, &self.patience);
        &self.order
    }

    fn wait(&mut self, is_there: impl Fn(usize) -> bool) {
        for (agent, patience) in self.patience.iter_mut().enumerate() {
            *patience = patience_after(*patience, is_there(agent));
        }
    }
}

/// PIBT for agents that get a new goal whenever they reach one: decides one step after the other.
#[derive(Debug)]
pub struct PibtLifelong {
    graph: Arc<Graph>,
    params: PibtParams,
    stepper: Stepper,
    queue: Queue,
    goals: Vec<Vertex>,
    ways: Ways,
}

/// Where agents are led.
#[derive(Debug)]
enum Ways {
    /// Along the shortest ways.
    Shortest { distances: Distances, costs: Vec<CostToGo> },
    /// Around the traffic.
    Guided { guide: Guide, costs: Vec<Vec<u32>> },
}

impl PibtLifelong {
    /// For so many agents on a map.
    pub fn new(graph: Arc<Graph>, num_agents: usize, params: PibtParams) -> Self {
        let ways = match params.guide {
            Some(guide) => Ways::Guided {
                guide: Guide::new(graph.clone(), num_agents, guide),
                costs: vec![Vec::new(); num_agents],
            },
            None => Ways::Shortest {
                distances: Distances::new(graph.clone(), Distances::DEFAULT_BYTES),
                costs: Vec::new(),
            },
        };
        let stepper = Stepper::new(&graph, params.rules, params.seed);
        let queue = Queue::new(patience_by(num_agents, |_| 0));
        Self { graph, params, stepper, queue, goals: vec![Vertex::MAX; num_agents], ways }
    }

    /// Where agents go next that are now here and have these goals, which may be equal and out of reach.
    ///
    /// # Errors
    /// [`Error::Length`] for another number of agents, [`Error::Agent`] for a vertex that is none or two agents in one.
    pub fn step(&mut self, now: &[Vertex], goals: &[Vertex]) -> Result<&[Vertex], Error> {
        self.check(now, goals)?;
        self.lead(now, goals);
        let graph = &self.graph;
        let (order, hints) = (self.queue.order(), &Hints::default());
        let next = match &self.ways {
            Ways::Shortest { costs, .. } => {
                self.stepper.step(&Scene { graph, now, goals, costs, order, hints }, &[])
            }
            Ways::Guided { costs, .. } => {
                self.stepper.step(&Scene { graph, now, goals, costs, order, hints }, &[])
            }
        };
        let next = next.ok_or_else(|| Error::instance("two agents are in one cell"))?;
        self.queue.wait(|agent| next[agent] == goals[agent]);
        Ok(next)
    }

    fn check(&mut self, now: &[Vertex], goals: &[Vertex]) -> Result<(), Error> {
        Error::check_length("agents", self.goals.len(), now.len())?;
        Error::check_length("goals", self.goals.len(), goals.len())?;
        let num_vertices = self.graph.num_vertices() as Vertex;
        for (agent, (&place, &goal)) in now.iter().zip(goals).enumerate() {
            if place.max(goal) >= num_vertices {
                return Err(Error::agent(agent, format!("the map has {num_vertices} free cells")));
            }
        }
        match self.stepper.shared_place(now) {
            Some(agent) => Err(Error::agent(agent, "it is in one cell with another")),
            None => Ok(()),
        }
    }

    /// Makes the costs to go of new goals.
    fn lead(&mut self, now: &[Vertex], goals: &[Vertex]) {
        if let Ways::Shortest { distances, costs } = &mut self.ways
            && costs.is_empty()
        {
            *costs = distances.to_all(goals);
        }
        for (agent, &goal) in goals.iter().enumerate() {
            if self.goals[agent] == goal {
                continue;
            }
            match &mut self.ways {
                Ways::Shortest { distances, costs } => costs[agent] = distances.to(goal),
                Ways::Guided { guide, costs } => {
                    guide.plan(agent as Agent, now[agent], goal, &mut costs[agent]);
                }
            }
        }
        self.goals.copy_from_slice(goals);
    }
}

impl Lifelong for PibtLifelong {
    fn name(&self) -> &'static str {
        if self.params.guide.is_some() { "guided-pibt" } else { "pibt" }
    }

    fn reset(&mut self) {
        *self = Self::new(self.graph.clone(), self.goals.len(), self.params.clone());
    }

    /// It takes no longer than it takes, whatever the budget.
    fn next(&mut self, now: &[Vertex], goals: &[Vertex], _: &Budget) -> Result<Vec<Vertex>, Error> {
        if now.len() != self.goals.len() {
            *self = Self::new(self.graph.clone(), now.len(), self.params.clone());
        }
        self.step(now, goals).map(<[Vertex]>::to_vec)
    }
}
