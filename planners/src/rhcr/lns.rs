//! The large neighbourhood search of RHCR, which improves the plan of a window.
//!
//! A neighbourhood of a few agents is replanned one agent after the other. If the total loss would grow, the old paths
//! are restored.
//!
//! Source: Li et al., "Anytime Multi-Agent Path Finding via Large Neighborhood Search", IJCAI 2021
//!
//! | paper | here |
//! | --- | --- |
//! | neighbourhood | `agents` |
//! | delay | cost minus cost to go |
//!
//! LaCAM* has another large neighbourhood search. Its SIPP and its reservation table require that every path ends at a
//! single goal, where the agent stays; here paths end with the window and may visit several goals. The general SIPP
//! and reservation table, which both neighbourhood searches could share, would make the searches of LaCAM* take 2.0 to
//! 2.6 times as long (measured in one run on five instances).

use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

use crate::budget::Clock;
use crate::graph::Vertex;
use crate::random::{below, shuffle};
use crate::reservations::Reservations;
use crate::rhcr::discount::Discount;
use crate::rhcr::window_plan::{WindowPlan, num_reached};
use crate::sipp::{Horizon, Leg, Order, Sipp, Task};

/// The search for one window.
pub(super) struct Lns<'a> {
    pub plan: &'a mut WindowPlan,
    pub legs: &'a [Vec<Leg>],
    pub discount: &'a Discount,
    pub sipp: &'a mut Sipp,
    /// Soft constraints: the old paths of removed agents. Empty between neighbourhoods.
    pub removed: &'a mut Reservations,
    pub clock: &'a mut Clock,
    pub rng: &'a mut Pcg64Mcg,
}

impl Lns<'_> {
    /// Limit on failed neighbourhoods in a row, as a multiple of the number of delayed agents plus one. Beyond the
    /// limit, the search stops.
    const PATIENCE: usize = 16;

    /// Improves the plan: replans the agents with new goals first, then neighbourhoods of delayed agents. Stops if the
    /// budget is spent, no agent is delayed, or too many neighbourhoods in a row fail.
    pub fn run(&mut self, changed: &[usize]) {
        for &agent in changed {
            if self.clock.is_spent() {
                return;
            }
            self.replan(&[agent]);
        }
        let mut num_failed = 0;
        while !self.clock.is_spent() {
            let Some((agent, num_delayed)) = self.draw_delayed() else { return };
            if num_failed > Self::PATIENCE * (1 + num_delayed) {
                return;
            }
            let agents = self.neighbourhood(agent);
            let before = self.total_loss();
            self.replan(&agents);
            num_failed = if self.total_loss() < before { 0 } else { num_failed + 1 };
        }
    }

    fn total_loss(&self) -> u64 {
        self.plan.costs.iter().map(|&cost| self.discount.loss(cost)).sum()
    }

    fn delay(&self, agent: usize) -> u64 {
        let distance = distance(&self.plan.paths[agent], &self.legs[agent]);
        u64::from(self.plan.costs[agent].saturating_sub(distance))
    }

    /// Draws an agent with probability proportional to its delay; also returns the number of delayed agents.
    fn draw_delayed(&mut self) -> Option<(usize, usize)> {
        let delays: Vec<u64> = (0..self.plan.paths.len()).map(|agent| self.delay(agent)).collect();
        let num_delayed = delays.iter().filter(|&&delay| delay > 0).count();
        let total: u64 = delays.iter().sum();
        if total == 0 {
            return None;
        }
        let mut left = below(self.rng, total as usize) as u64;
        let agent = delays.iter().position(|&delay| {
            let is_drawn = left < delay;
            left = left.saturating_sub(delay);
            is_drawn
        });
        agent.map(|agent| (agent, num_delayed))
    }

    /// Collects an agent and agents in its way.
    fn neighbourhood(&mut self, agent: usize) -> Vec<usize> {
        let max_agents = 2 + below(self.rng, 6);
        let mut agents = vec![agent];
        for _ in 0..3 {
            let walker = agents[below(self.rng, agents.len())];
            let start = below(self.rng, 2) * below(self.rng, self.plan.num_steps);
            self.walk(walker, start, max_agents, &mut agents);
            if agents.len() >= max_agents {
                break;
            }
        }
        agents
    }

    /// Walks from a step of the path of an agent toward its goal, and collects the agents on the way.
    fn walk(&mut self, agent: usize, start: usize, max_agents: usize, agents: &mut Vec<usize>) {
        let path = &self.plan.paths[agent];
        let legs = &self.legs[agent];
        let Some(leg) = legs.get(num_reached(&path[..=start], legs)) else { return };
        let mut at = path[start];
        for step in start + 1..=self.plan.num_steps {
            let cost = leg.to_go[at as usize];
            let nearer = |&&to: &&Vertex| leg.to_go[to as usize] < cost;
            let around = self.plan.graph.neighbours(at);
            let count = around.iter().filter(nearer).count();
            if count == 0 {
                return;
            }
            let to = around.iter().filter(nearer).nth(below(self.rng, count)).copied().unwrap_or(at);
            for other in self.plan.reserved.holders(to, step as u32 - 1, step as u32) {
                if agents.len() < max_agents && !agents.contains(&other) {
                    agents.push(other);
                }
            }
            at = to;
        }
    }

    /// Replans a neighbourhood in random order, unless the total loss would grow.
    fn replan(&mut self, agents: &[usize]) {
        let mut order = agents.to_vec();
        shuffle(&mut order, self.rng);
        for &agent in &order {
            self.plan.reserved.remove(agent, &self.plan.paths[agent], false);
            self.removed.add(agent, &self.plan.paths[agent], false);
        }
        let found = self.find_all(&order);
        for &agent in order.iter().skip(found.len()) {
            self.removed.remove(agent, &self.plan.paths[agent], false);
        }
        if found.len() == order.len() {
            for (&agent, (path, cost)) in order.iter().zip(found) {
                self.plan.paths[agent] = path;
                self.plan.costs[agent] = cost;
            }
            return;
        }
        for (&agent, (path, _)) in order.iter().zip(&found) {
            self.plan.reserved.remove(agent, path, false);
        }
        for &agent in &order {
            self.plan.reserved.add(agent, &self.plan.paths[agent], false);
        }
    }

    /// Returns the new paths of the first agents in the order, as long as the total loss does not grow.
    fn find_all(&mut self, order: &[usize]) -> Vec<(Vec<Vertex>, u32)> {
        let max_loss: u64 = order.iter().map(|&agent| self.discount.loss(self.plan.costs[agent])).sum();
        let (mut found, mut loss) = (Vec::with_capacity(order.len()), 0);
        for &agent in order {
            if self.clock.count_node() {
                break;
            }
            self.removed.remove(agent, &self.plan.paths[agent], false);
            let path = self.find(agent);
            loss += path.as_ref().map_or(0, |path| self.discount.loss(path.1));
            let Some(path) = path.filter(|_| loss <= max_loss) else {
                self.removed.add(agent, &self.plan.paths[agent], false);
                break;
            };
            self.plan.reserved.add(agent, &path.0, false);
            found.push(path);
        }
        found
    }

    fn find(&mut self, agent: usize) -> Option<(Vec<Vertex>, u32)> {
        let task = Task {
            start: self.plan.paths[agent][0],
            legs: &self.legs[agent],
            reserved: &self.plan.reserved,
            avoided: Some(self.removed),
            banned: &[],
            horizon: Horizon::Window(self.plan.num_steps as u32),
            order: Order::Cost,
            salt: self.rng.next_u32(),
        };
        self.sipp.find(&task).map(|path| (path.path, path.cost))
    }
}

/// Returns the shortest distance from the start of a path through all goals. Units: steps.
fn distance(path: &[Vertex], legs: &[Leg]) -> u32 {
    legs.first().map_or(0, |leg| leg.to_go[path[0] as usize].saturating_add(leg.then))
}
