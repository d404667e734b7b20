//! The plan for the steps of the planning window. It is always free of conflicts; PIBT extends it.
//!
//! Source: Jiang et al., "Scaling Lifelong Multi-Agent Path Finding to More Realistic Settings: Research Challenges and
//! Opportunities", Symposium on Combinatorial Search 2024: windows that start from PIBT

use std::sync::Arc;

use crate::bfs::UNREACHABLE;
use crate::distances::CostToGo;
use crate::graph::{Graph, Vertex};
use crate::pibt::PibtRules;
use crate::pibt::input::{Costs, StepInput};
use crate::pibt::step::PibtStep;
use crate::problem::Agent;
use crate::reservations::Reservations;
use crate::sipp::Leg;

/// Conflict-free paths of all agents for the steps of the planning window.
#[derive(Debug)]
pub(crate) struct WindowPlan {
    pub(super) graph: Arc<Graph>,
    pub(super) num_steps: usize,
    /// Shape: `[agents, steps + 1]`
    pub(super) paths: Vec<Vec<Vertex>>,
    /// The cost of each path, including the costs to go after the window.
    pub(super) costs: Vec<u32>,
    pub(super) reserved: Reservations,
    step: PibtStep,
}

impl WindowPlan {
    /// Creates an empty plan for a number of steps.
    pub(crate) fn new(graph: Arc<Graph>, num_steps: usize, seed: u64) -> Self {
        let num_vertices = graph.num_vertices();
        Self {
            num_steps,
            paths: Vec::new(),
            costs: Vec::new(),
            reserved: Reservations::new(num_vertices),
            step: PibtStep::new(&graph, PibtRules::default(), seed),
            graph,
        }
    }

    /// Returns the vertices of all agents after a step of the plan, counted from now.
    pub(crate) fn after(&self, step: usize) -> impl Iterator<Item = Vertex> + '_ {
        self.paths.iter().map(move |path| path[step])
    }

    /// Drops the first step if the agents followed it; otherwise restarts from their positions. Returns whether they
    /// followed it. In both cases PIBT extends the plan to the end of the window.
    pub(crate) fn advance(&mut self, now: &[Vertex], legs: &[Vec<Leg>]) -> bool {
        let is_as_planned = self.paths.len() == now.len() && self.after(1).eq(now.iter().copied());
        if is_as_planned {
            self.paths.iter_mut().for_each(|path| {
                path.remove(0);
            });
        } else {
            self.paths = now.iter().map(|&at| vec![at]).collect();
        }
        self.extend(legs);
        self.update(legs);
        is_as_planned
    }

    /// Replaces all paths with others of the same length.
    pub(crate) fn replace(&mut self, paths: Vec<Vec<Vertex>>, legs: &[Vec<Leg>]) {
        self.paths = paths;
        self.update(legs);
    }

    /// Returns the sum of costs.
    pub(crate) fn total_cost(&self) -> u64 {
        self.costs.iter().map(|&cost| u64::from(cost)).sum()
    }

    /// Extends the plan with PIBT to the end of the window; agents nearest to their goals have the highest priority.
    fn extend(&mut self, legs: &[Vec<Leg>]) {
        let mut length = self.paths.first().map_or(usize::MAX, Vec::len);
        let mut phases: Vec<usize> =
            self.paths.iter().zip(legs).map(|(path, legs)| num_reached(path, legs)).collect();
        let mut order: Vec<Agent> = (0..self.paths.len() as Agent).collect();
        while length <= self.num_steps {
            let now: Vec<Vertex> = self.after(length - 1).collect();
            let target = |agent: usize| match legs[agent].get(phases[agent]) {
                Some(leg) => Target::Goal(&leg.to_go),
                None => Target::Here(now[agent]),
            };
            let costs: Vec<Target<'_>> = (0..now.len()).map(target).collect();
            let distance = |agent: Agent| match costs[agent as usize] {
                Target::Goal(to_go) => to_go[now[agent as usize] as usize],
                Target::Here(_) => UNREACHABLE,
            };
            order.sort_by_key(|&agent| distance(agent));
            // Agents do not stay at their goals, so an agent on its goal does not block a dead end.
            let goals = vec![Vertex::MAX; now.len()];
            let input =
                StepInput { graph: &self.graph, now: &now, goals: &goals, costs: &costs, order: &order };
            // Without constraints, PIBT never fails.
            let next = self.step.run(&input, &[]).map_or_else(|| now.clone(), <[Vertex]>::to_vec);
            for (agent, &to) in next.iter().enumerate() {
                self.paths[agent].push(to);
                phases[agent] = phase_at(to, phases[agent], &legs[agent]);
            }
            length += 1;
        }
    }

    /// Updates reservations and costs.
    fn update(&mut self, legs: &[Vec<Leg>]) {
        self.reserved.clear();
        for (agent, path) in self.paths.iter().enumerate() {
            self.reserved.add(agent, path, false);
        }
        self.costs = self.paths.iter().zip(legs).map(|(path, legs)| cost(path, legs)).collect();
    }
}

/// The vertex that an agent heads for.
#[derive(Clone, Copy, Debug)]
enum Target<'a> {
    /// A goal, by its costs to go.
    Goal(&'a CostToGo),
    /// Its current vertex.
    Here(Vertex),
}

impl Costs for Target<'_> {
    fn cost(&self, vertex: Vertex) -> u32 {
        match self {
            Self::Goal(to_go) => to_go[vertex as usize],
            Self::Here(here) => u32::from(vertex != *here),
        }
    }
}

/// Returns the number of goals that a path reaches.
pub(super) fn num_reached(path: &[Vertex], legs: &[Leg]) -> usize {
    path.iter().fold(0, |phase, &vertex| phase_at(vertex, phase, legs))
}

/// Returns the number of goals reached after a visit to a vertex; `phase` goals were reached before.
fn phase_at(vertex: Vertex, phase: usize, legs: &[Leg]) -> usize {
    phase + legs[phase..].iter().take_while(|leg| leg.to_go[vertex as usize] == 0).count()
}

/// Returns the number of steps until a path reaches its last goal; if it does not, all its steps plus the costs to go.
fn cost(path: &[Vertex], legs: &[Leg]) -> u32 {
    let mut phase = 0;
    for (step, &vertex) in path.iter().enumerate() {
        phase = phase_at(vertex, phase, legs);
        if phase == legs.len() {
            return step as u32;
        }
    }
    let (leg, end) = (&legs[phase], path[path.len() - 1]);
    (path.len() as u32 - 1).saturating_add(leg.to_go[end as usize]).saturating_add(leg.then)
}
