//! Planning for lifelong agents a few steps ahead, again and again.
//!
//! Source: Li et al., "Lifelong Multi-Agent Path Finding in Large-Scale Warehouses", AAAI 2021
//!
//! | paper | here |
//! | --- | --- |
//! | h, simulation window | `RhcrParams::simulation_window` |
//! | w, planning window | `RhcrParams::planning_window` |
//! | MAPF solver | `RhcrParams::solver` |
//!
//! The paper's agents know their next goals. Here they do not, unless told by [`Lifelong::next_foreseeing`]; so agents
//! plan to their present goals and then only keep out of the way, and plan again when one of them gets a new goal.
//! Where the paper's solver fails, agents stand still or keep but part of their plans; here they go on with what is
//! left of the last plan and push each other past its end, which never leads to a conflict.

use std::sync::Arc;

use pogema_core::Error;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::conflict::Setting;
use crate::distances::{Distances, UNREACHABLE};
use crate::ecbs::{self, EcbsParams, Found};
use crate::graph::{Graph, Vertex};
use crate::lifelong::{Lifelong, check_agents, present_goals};
use crate::pbs;
use crate::problem::{Budget, Clock};
use crate::sipp::{Horizon, Leg, Sipp};
use crate::window::Window;

/// How [`Rhcr`] plans.
#[derive(Clone, Debug, PartialEq)]
pub struct RhcrParams {
    /// Steps between two plannings; new goals and surprises are planned for at once. Units: steps.
    pub simulation_window: usize,
    /// Steps that are free of conflicts, from 1 to [`Rhcr::LONGEST_WINDOW`]. Units: steps.
    pub planning_window: usize,
    /// How a window is planned.
    pub solver: WindowSolver,
    /// Searches for one agent that a planning may take, whatever the budget.
    pub most_searches: u64,
    /// With [`WindowSolver::Neighbourhoods`], how many times as much as the one before each step of a delay weighs; 1
    /// means the sum of costs. Unless it is given, it is 0.85 for at most four agents that do not know their next
    /// goals, and else 1: where few get in each other's way, a delay far ahead may never come, for goals change; in a
    /// crowd it only grows.
    pub discount: Option<f64>,
    /// Chooses among what is equally good.
    pub seed: u64,
}

/// How a window is planned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WindowSolver {
    /// The last plan goes on, agents push each other past its end, and a large-neighbourhood search improves it.
    Neighbourhoods,
    /// Priority-based search, as in the paper.
    Pbs,
    /// Conflict-based search for windows that cost at most so many times the least.
    Ecbs {
        /// How many times.
        weight: f64,
    },
}

impl Default for RhcrParams {
    fn default() -> Self {
        Self {
            simulation_window: 1,
            planning_window: 20,
            solver: WindowSolver::Neighbourhoods,
            most_searches: 500,
            discount: None,
            seed: 0,
        }
    }
}

/// Rolling-horizon planning. A node of its budget is one search for one agent, or with [`WindowSolver::Ecbs`] one node of
/// the constraint tree.
#[derive(Debug)]
pub struct Rhcr {
    params: RhcrParams,
    distances: Distances,
    sipp: Sipp,
    window: Window,
    goals: Vec<Vertex>,
    /// Steps since the last planning.
    age: usize,
    /// For how many agents delays are weighed now, and whether those know their next goals.
    weighed: Option<(usize, bool)>,
    rng: Pcg64Mcg,
}

impl Rhcr {
    /// Most steps that are planned for.
    pub const LONGEST_WINDOW: usize = 1000;

    /// A planner for a map.
    pub fn new(graph: Arc<Graph>, mut params: RhcrParams) -> Self {
        params.planning_window = params.planning_window.clamp(1, Self::LONGEST_WINDOW);
        Self {
            distances: Distances::new(graph.clone(), Distances::DEFAULT_BYTES),
            sipp: Sipp::new(graph.clone()),
            window: Window::new(graph, params.planning_window, params.seed),
            goals: Vec::new(),
            age: 0,
            weighed: None,
            rng: Pcg64Mcg::seed_from_u64(params.seed),
            params,
        }
    }

    /// Chooses what delays weigh, for so many agents that know their next goals or do not.
    fn weigh(&mut self, num_agents: usize, foresees: bool) {
        if self.weighed != Some((num_agents, foresees)) {
            self.weighed = Some((num_agents, foresees));
            let own = if num_agents <= 4 && !foresees { 0.85 } else { 1.0 };
            self.window.set_discount(self.params.discount.unwrap_or(own));
        }
    }

    /// As many goals as an agent may reach within the window; none that it cannot.
    fn legs(&mut self, at: Vertex, goals: &[Vertex]) -> Vec<Leg> {
        let (mut legs, mut lengths, mut from, mut total) = (Vec::new(), Vec::new(), at, 0);
        for &goal in goals {
            let to_go = self.distances.to(goal);
            let length = to_go[from as usize];
            if length == UNREACHABLE || total > self.params.planning_window {
                break;
            }
            total += length as usize;
            lengths.push(length);
            legs.push(Leg::last(to_go));
            from = goal;
        }
        for at in (1..legs.len()).rev() {
            legs[at - 1].then = legs[at].then + lengths[at];
        }
        legs
    }

    fn step(
        &mut self,
        now: &[Vertex],
        goals: Vec<Vertex>,
        legs: Vec<Vec<Leg>>,
        budget: &Budget,
    ) -> Vec<Vertex> {
        let mut budget = budget.clone();
        budget.nodes = Some(budget.nodes.unwrap_or(u64::MAX).min(self.params.most_searches));
        let mut clock = budget.start();
        let is_new = |agent: &usize| self.goals.get(*agent) != Some(&goals[*agent]);
        let changed: Vec<usize> = (0..goals.len()).filter(is_new).collect();
        let is_as_planned = self.window.advance(now, &legs);
        self.age += 1;
        let is_due = self.age >= self.params.simulation_window || !is_as_planned || !changed.is_empty();
        self.goals = goals;
        if is_due {
            self.age = 0;
            match self.params.solver {
                WindowSolver::Neighbourhoods => {
                    self.window.improve(&legs, &changed, &mut clock, &mut self.rng);
                }
                WindowSolver::Pbs | WindowSolver::Ecbs { .. } => self.plan_anew(now, &legs, &mut clock),
            }
        }
        self.window.after(1).collect()
    }

    /// Plans for the whole window, and keeps what is left of the last plan if that fails or costs more.
    fn plan_anew(&mut self, now: &[Vertex], legs: &[Vec<Leg>], clock: &mut Clock) {
        let horizon = Horizon::Window(self.params.planning_window as u32);
        let setting = Setting { starts: now, legs, horizon, salt: self.rng.next_u32() };
        let graph = self.distances.graph().clone();
        let found = match self.params.solver {
            WindowSolver::Ecbs { weight } => {
                let params = EcbsParams { weight, ..EcbsParams::default() };
                match ecbs::search(&mut self.sipp, &graph, &setting, &params, clock, |_| None) {
                    Found::Paths { paths, .. } => Some(paths),
                    Found::Nothing { .. } | Found::Proof(_) => None,
                }
            }
            WindowSolver::Pbs | WindowSolver::Neighbourhoods => {
                pbs::search(&mut self.sipp, &graph, &setting, clock)
            }
        };
        if let Some(paths) = found.filter(|paths| paths.total_cost() <= self.window.total_cost()) {
            let path = |agent| paths.path(agent).to_vec();
            self.window.replace((0..now.len()).map(path).collect(), legs);
        }
    }
}

impl Lifelong for Rhcr {
    fn name(&self) -> &'static str {
        "rhcr"
    }

    fn reset(&mut self) {
        let graph = self.distances.graph().clone();
        self.window = Window::new(graph, self.params.planning_window, self.params.seed);
        self.goals.clear();
        self.age = 0;
        self.weighed = None;
        self.rng = Pcg64Mcg::seed_from_u64(self.params.seed);
    }

    fn next(&mut self, now: &[Vertex], goals: &[Vertex], budget: &Budget) -> Result<Vec<Vertex>, Error> {
        check_agents(self.distances.graph().num_vertices(), now, goals)?;
        self.weigh(now.len(), false);
        let legs = now.iter().zip(goals).map(|(&at, &goal)| self.legs(at, &[goal])).collect();
        Ok(self.step(now, goals.to_vec(), legs, budget))
    }

    fn foresees(&self) -> bool {
        true
    }

    fn next_foreseeing(
        &mut self,
        now: &[Vertex],
        goals: &[Vec<Vertex>],
        budget: &Budget,
    ) -> Result<Vec<Vertex>, Error> {
        let present = present_goals(goals)?;
        let num_vertices = self.distances.graph().num_vertices();
        check_agents(num_vertices, now, &present)?;
        for (agent, goals) in goals.iter().enumerate() {
            if let Some(goal) = goals.iter().find(|&&goal| goal as usize >= num_vertices) {
                return Err(Error::agent(agent, format!("goal {goal} is none of {num_vertices} vertices")));
            }
        }
        self.weigh(now.len(), true);
        let legs = now.iter().zip(goals).map(|(&at, goals)| self.legs(at, goals)).collect();
        Ok(self.step(now, present, legs, budget))
    }
}
