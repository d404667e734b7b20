//! PIBT as a one-shot planner.

use crate::budget::{Budget, Clock};
use crate::distances::CostToGo;
use crate::graph::Vertex;
use crate::outcome::Outcome;
use crate::pibt::guidance::GuidanceParams;
use crate::pibt::input::StepInput;
use crate::pibt::priorities::Priorities;
use crate::pibt::step::{PibtRules, PibtStep};
use crate::planner::Planner;
use crate::problem::{Agent, Problem};

/// Parameters of [`Pibt`] and [`crate::PibtLifelong`].
#[derive(Clone, Debug, Default)]
pub struct PibtParams {
    /// Seed of tie-breaking.
    pub seed: u64,
    /// Options of a step.
    pub rules: PibtRules,
    /// Traffic guidance of lifelong agents; without it they follow shortest paths.
    pub guidance: Option<GuidanceParams>,
}

/// The planner PIBT: fast, but incomplete. Its node budget counts steps.
#[derive(Clone, Debug, Default)]
pub struct Pibt {
    params: PibtParams,
}

impl Pibt {
    /// Creates a planner with these parameters.
    pub fn new(params: PibtParams) -> Self {
        Self { params }
    }

    /// If the problem has a step limit, the planner plans at least this many steps before it gives up early.
    const MIN_STEPS: usize = 10_000;

    /// Returns the number of steps after which the planner gives up. Agents that do not move in circles need far fewer.
    fn max_steps(problem: &Problem) -> usize {
        let enough = 10 * problem.graph.num_vertices() + 100;
        problem.max_steps.map_or(enough, |limit| limit.min(enough.max(Self::MIN_STEPS)))
    }

    /// Plans step by step until all agents are on their goals, a limit is reached or the budget is spent.
    fn run(
        &self,
        problem: &Problem,
        costs: &[CostToGo],
        mut priorities: Priorities,
        clock: &mut Clock,
    ) -> Vec<Vec<Vertex>> {
        let (graph, goals) = (&problem.graph, &problem.goals[..]);
        let mut step = PibtStep::new(graph, self.params.rules, self.params.seed);
        let mut steps = vec![problem.starts.clone()];
        for _ in 0..Self::max_steps(problem) {
            let now = &steps[steps.len() - 1];
            if now == goals || clock.count_node() {
                break;
            }
            let input = StepInput { graph, now, goals, costs, order: priorities.order() };
            let Some(next) = step.run(&input, &[]).map(<[Vertex]>::to_vec) else {
                break;
            };
            priorities.update(|agent| next[agent] == goals[agent]);
            steps.push(next);
        }
        steps
    }
}

impl Planner for Pibt {
    fn plan(&mut self, problem: &Problem, budget: &Budget) -> Outcome {
        problem.solve(budget, |costs, mut clock| {
            let least = |agent: Agent| costs[agent as usize][problem.starts[agent as usize] as usize];
            let lower_bound = problem.lower_bound(costs);
            let priorities = Priorities::new(problem.num_agents(), least);
            let steps = self.run(problem, costs, priorities, &mut clock);
            let is_solved = steps.last() == Some(&problem.goals);
            match problem.plan_of(&steps).ok() {
                Some(plan) if is_solved => Outcome::Solved { plan, lower_bound },
                best => clock.unsolved(best, lower_bound),
            }
        })
    }
}
