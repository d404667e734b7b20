//! Rolling-horizon collision resolution (RHCR): lifelong planning with conflict-free windows.
//!
//! Source: Li et al., "Lifelong Multi-Agent Path Finding in Large-Scale Warehouses", AAAI 2021
//!
//! | paper | here |
//! | --- | --- |
//! | h, simulation window | [`RhcrParams::simulation_window`] |
//! | w, planning window | [`RhcrParams::planning_window`] |
//! | windowed MAPF solver | [`RhcrParams::solver`] |
//!
//! In the paper, agents know their next goals. Here only [`Lifelong::next_with_future_goals`] provides them. Otherwise
//! agents plan to their current goals, keep out of the way afterwards, and replan when one of them gets a new goal. If
//! the solver of the paper fails, agents wait or keep parts of their plans. Here they continue the last plan, which
//! PIBT extends without conflicts.

mod discount;
mod lns;
mod window_plan;

use std::sync::Arc;

use pogema_core::Error;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::bfs::UNREACHABLE;
use crate::budget::{Budget, Clock};
use crate::cbs::EcbsParams;
use crate::cbs::ecbs::{self, Found};
use crate::distances::Distances;
use crate::graph::{Graph, Vertex};
use crate::lifelong::{Lifelong, check_agents, check_vertex, current_goals};
use crate::pbs;
use crate::reservations::Reservations;
use crate::rhcr::discount::Discount;
use crate::rhcr::lns::Lns;
use crate::rhcr::window_plan::WindowPlan;
use crate::sipp::{Horizon, Leg, Sipp};
use crate::team_task::TeamTask;

/// Parameters of [`Rhcr`].
#[derive(Clone, Debug, PartialEq)]
pub struct RhcrParams {
    /// Steps between two calls of the solver; after new goals or deviations it is called immediately. Units: steps.
    pub simulation_window: usize,
    /// Steps that are free of conflicts, from 1 to [`Rhcr::MAX_WINDOW`]. Units: steps.
    pub planning_window: usize,
    /// The windowed solver.
    pub solver: WindowSolver,
    /// The limit on nodes of one call of the solver, in addition to the budget. [`Rhcr`] says what a node is.
    pub max_nodes: u64,
    /// The discount factor of [`WindowSolver::Lns`] for each step of a path; 1 means the sum of costs. The default is
    /// 0.85 for at most four agents without future goals, and 1 otherwise. With few agents, a distant delay may never
    /// occur because goals change; in a crowd it only grows.
    pub discount: Option<f64>,
    /// Seed of tie-breaking and of random neighbourhoods.
    pub seed: u64,
}

/// The solver of one window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WindowSolver {
    /// Large neighbourhood search, which improves the last plan after PIBT has extended it.
    Lns,
    /// Priority-based search, as in the paper.
    Pbs,
    /// Enhanced conflict-based search.
    Ecbs {
        /// The suboptimality bound.
        weight: f64,
    },
}

impl Default for RhcrParams {
    fn default() -> Self {
        Self {
            simulation_window: 1,
            planning_window: 20,
            solver: WindowSolver::Lns,
            max_nodes: 500,
            discount: None,
            seed: 0,
        }
    }
}

/// The lifelong planner RHCR. Its node budget counts single-agent searches, or with [`WindowSolver::Ecbs`] nodes of the
/// constraint tree.
#[derive(Debug)]
pub struct Rhcr {
    params: RhcrParams,
    distances: Distances,
    sipp: Sipp,
    plan: WindowPlan,
    /// The memory of the LNS for the paths of removed agents.
    removed: Reservations,
    discount: Discount,
    goals: Vec<Vertex>,
    /// Steps since the last call of the solver.
    age: usize,
    /// The number of agents that the discount is for, and whether they have future goals.
    discounted: Option<(usize, bool)>,
    rng: Pcg64Mcg,
}

impl Rhcr {
    /// The limit on the planning window. Units: steps.
    pub const MAX_WINDOW: usize = 1000;

    /// Creates a planner for a map.
    pub fn new(graph: Arc<Graph>, mut params: RhcrParams) -> Self {
        params.planning_window = params.planning_window.clamp(1, Self::MAX_WINDOW);
        Self {
            distances: Distances::new(graph.clone(), Distances::DEFAULT_BYTES),
            sipp: Sipp::new(graph.clone()),
            removed: Reservations::new(graph.num_vertices()),
            discount: Discount::new(1.0),
            plan: WindowPlan::new(graph, params.planning_window, params.seed),
            goals: Vec::new(),
            age: 0,
            discounted: None,
            rng: Pcg64Mcg::seed_from_u64(params.seed),
            params,
        }
    }

    /// Sets the discount for a number of agents with or without future goals.
    fn set_discount(&mut self, num_agents: usize, uses_future_goals: bool) {
        if self.discounted != Some((num_agents, uses_future_goals)) {
            self.discounted = Some((num_agents, uses_future_goals));
            let own = if num_agents <= 4 && !uses_future_goals { 0.85 } else { 1.0 };
            self.discount = Discount::new(self.params.discount.unwrap_or(own));
        }
    }

    /// Returns the legs that an agent may begin within the window.
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

    /// Advances the plan by one step, and calls the solver if it is due.
    fn step(
        &mut self,
        now: &[Vertex],
        goals: Vec<Vertex>,
        legs: Vec<Vec<Leg>>,
        budget: &Budget,
    ) -> Vec<Vertex> {
        let mut budget = budget.clone();
        budget.nodes = Some(budget.nodes.unwrap_or(u64::MAX).min(self.params.max_nodes));
        let mut clock = budget.start();
        let is_new = |agent: &usize| self.goals.get(*agent) != Some(&goals[*agent]);
        let changed: Vec<usize> = (0..goals.len()).filter(is_new).collect();
        let is_as_planned = self.plan.advance(now, &legs);
        self.age += 1;
        let is_due = self.age >= self.params.simulation_window || !is_as_planned || !changed.is_empty();
        self.goals = goals;
        if is_due {
            self.age = 0;
            match self.params.solver {
                WindowSolver::Lns => self.improve(&legs, &changed, &mut clock),
                WindowSolver::Pbs | WindowSolver::Ecbs { .. } => self.plan_window(now, &legs, &mut clock),
            }
        }
        self.plan.after(1).collect()
    }

    /// Improves the plan by LNS.
    fn improve(&mut self, legs: &[Vec<Leg>], changed: &[usize], clock: &mut Clock) {
        let Self { plan, discount, sipp, removed, rng, .. } = self;
        Lns { plan, legs, discount, sipp, removed, clock, rng }.run(changed);
    }

    /// Plans the whole window by PBS or ECBS. Keeps the last plan if the solver fails or the new plan costs more.
    fn plan_window(&mut self, now: &[Vertex], legs: &[Vec<Leg>], clock: &mut Clock) {
        let horizon = Horizon::Window(self.params.planning_window as u32);
        let team = TeamTask { starts: now, legs, horizon, salt: self.rng.next_u32() };
        let graph = self.distances.graph().clone();
        let found = match self.params.solver {
            WindowSolver::Ecbs { weight } => {
                let params = EcbsParams { weight, ..EcbsParams::default() };
                match ecbs::search(&mut self.sipp, &graph, &team, &params, clock, |_| None) {
                    Found::Paths { paths, .. } => Some(paths),
                    Found::Unknown { .. } | Found::Impossible(_) => None,
                }
            }
            WindowSolver::Pbs | WindowSolver::Lns => pbs::search(&mut self.sipp, &graph, &team, clock),
        };
        if let Some(paths) = found.filter(|paths| paths.total_cost() <= self.plan.total_cost()) {
            let path = |agent| paths.path(agent).to_vec();
            self.plan.replace((0..now.len()).map(path).collect(), legs);
        }
    }
}

impl Lifelong for Rhcr {
    fn reset(&mut self) {
        let graph = self.distances.graph().clone();
        self.plan = WindowPlan::new(graph, self.params.planning_window, self.params.seed);
        self.goals.clear();
        self.age = 0;
        self.discounted = None;
        self.rng = Pcg64Mcg::seed_from_u64(self.params.seed);
    }

    fn next(&mut self, now: &[Vertex], goals: &[Vertex], budget: &Budget) -> Result<Vec<Vertex>, Error> {
        check_agents(self.distances.graph().num_vertices(), now, goals)?;
        self.set_discount(now.len(), false);
        let legs = now.iter().zip(goals).map(|(&at, &goal)| self.legs(at, &[goal])).collect();
        Ok(self.step(now, goals.to_vec(), legs, budget))
    }

    fn uses_future_goals(&self) -> bool {
        true
    }

    fn next_with_future_goals(
        &mut self,
        now: &[Vertex],
        goals: &[Vec<Vertex>],
        budget: &Budget,
    ) -> Result<Vec<Vertex>, Error> {
        let present = current_goals(goals)?;
        let num_vertices = self.distances.graph().num_vertices();
        check_agents(num_vertices, now, &present)?;
        for (agent, goals) in goals.iter().enumerate() {
            for &goal in goals {
                check_vertex(num_vertices, agent, "goal", goal)?;
            }
        }
        self.set_discount(now.len(), true);
        let legs = now.iter().zip(goals).map(|(&at, goals)| self.legs(at, goals)).collect();
        Ok(self.step(now, present, legs, budget))
    }
}
