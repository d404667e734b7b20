//! Everyone's next steps: always free of conflicts, and made better as long as there is time.
//!
//! A few agents at a time are taken out and put back one after the other, each on its best way past all others; what
//! is worse than before is undone. The plan of the last step, shifted, is where the next one begins.
//!
//! Source: Li et al., "Anytime Multi-Agent Path Finding via Large Neighborhood Search", IJCAI 2021, and Jiang et al.,
//! "Scaling Lifelong Multi-Agent Path Finding to More Realistic Settings: Research Challenges and Opportunities",
//! Symposium on Combinatorial Search 2024, for windows that begin with PIBT
//!
//! | paper | here |
//! | --- | --- |
//! | w | `num_steps` |
//! | neighborhood | `group` |
//! | delay | `cost` minus the cost to go |

use std::sync::Arc;

use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

use crate::discount::Discount;
use crate::distances::{CostToGo, UNREACHABLE};
use crate::graph::{Graph, Vertex};
use crate::problem::Clock;
use crate::random::{below, shuffle};
use crate::reservations::Reservations;
use crate::scatter::Hints;
use crate::sipp::{Horizon, Leg, Order, Sipp, Task};
use crate::stepper::{Agent, Costs, PibtRules, Scene, Stepper};

/// The next steps of all agents.
#[derive(Debug)]
pub(crate) struct Window {
    graph: Arc<Graph>,
    num_steps: usize,
    /// Shape: `[agents, steps + 1]`
    paths: Vec<Vec<Vertex>>,
    costs: Vec<u32>,
    discount: Discount,
    reserved: Reservations,
    /// The old paths of those that are taken out and not yet put back.
    left: Reservations,
    sipp: Sipp,
    stepper: Stepper,
}

impl Window {
    /// Neighbourhoods tried in vain for each agent that loses time, before it is left at that.
    const PATIENCE: usize = 16;

    /// A window of so many steps, with nobody in it.
    pub(crate) fn new(graph: Arc<Graph>, num_steps: usize, seed: u64) -> Self {
        let num_vertices = graph.num_vertices();
        Self {
            num_steps,
            paths: Vec::new(),
            costs: Vec::new(),
            discount: Discount::new(1.0),
            reserved: Reservations::new(num_vertices),
            left: Reservations::new(num_vertices),
            sipp: Sipp::new(graph.clone()),
            stepper: Stepper::new(&graph, PibtRules::default(), seed),
            graph,
        }
    }

    /// From now on each step of a delay weighs so many times the one before.
    pub(crate) fn set_discount(&mut self, factor: f64) {
        self.discount = Discount::new(factor);
    }

    /// Where agents are after a step of the plan, counted from now.
    pub(crate) fn after(&self, step: usize) -> impl Iterator<Item = Vertex> + '_ {
        self.paths.iter().map(move |path| path[step])
    }

    /// Takes the first step as done if agents are where it led to, else begins where they are; says which.
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
        self.take_stock(legs);
        is_as_planned
    }

    /// Puts other paths in the place of all, each as long as the window.
    pub(crate) fn replace(&mut self, paths: Vec<Vec<Vertex>>, legs: &[Vec<Leg>]) {
        self.paths = paths;
        self.take_stock(legs);
    }

    pub(crate) fn total_cost(&self) -> u64 {
        self.costs.iter().map(|&cost| u64::from(cost)).sum()
    }

    fn total_loss(&self) -> u64 {
        self.costs.iter().map(|&cost| self.discount.loss(cost)).sum()
    }

    /// Lets agents push each other until the window is full, those first who are nearest to their goals.
    fn extend(&mut self, legs: &[Vec<Leg>]) {
        let mut length = self.paths.first().map_or(usize::MAX, Vec::len);
        let mut phases: Vec<usize> =
            self.paths.iter().zip(legs).map(|(path, legs)| phase(path, legs)).collect();
        let mut order: Vec<Agent> = (0..self.paths.len() as Agent).collect();
        while length <= self.num_steps {
            let now: Vec<Vertex> = self.after(length - 1).collect();
            let wish = |agent: usize| match legs[agent].get(phases[agent]) {
                Some(leg) => Wish::Go(&leg.to_go),
                None => Wish::Rest(now[agent]),
            };
            let costs: Vec<Wish<'_>> = (0..now.len()).map(wish).collect();
            let urgency = |agent: Agent| match costs[agent as usize] {
                Wish::Go(to_go) => to_go[now[agent as usize] as usize],
                Wish::Rest(_) => UNREACHABLE,
            };
            order.sort_by_key(|&agent| urgency(agent));
            let (graph, hints) = (&self.graph, &Hints::default());
            // No place in a corridor is closed by an agent that will not stay.
            let goals = vec![Vertex::MAX; now.len()];
            let scene = Scene { graph, now: &now, goals: &goals, costs: &costs, order: &order, hints };
            // Where nobody is forced, there is always a step.
            let next = self.stepper.step(&scene, &[]).map_or_else(|| now.clone(), <[Vertex]>::to_vec);
            for (agent, &to) in next.iter().enumerate() {
                self.paths[agent].push(to);
                while legs[agent].get(phases[agent]).is_some_and(|leg| leg.to_go[to as usize] == 0) {
                    phases[agent] += 1;
                }
            }
            length += 1;
        }
    }

    fn take_stock(&mut self, legs: &[Vec<Leg>]) {
        self.reserved.clear();
        for (agent, path) in self.paths.iter().enumerate() {
            self.reserved.add(agent, path, false);
        }
        self.costs = self.paths.iter().zip(legs).map(|(path, legs)| cost(path, legs)).collect();
    }

    /// Improves the plan: the ways of those with new goals first, then of whoever loses most.
    pub(crate) fn improve(
        &mut self,
        legs: &[Vec<Leg>],
        changed: &[usize],
        clock: &mut Clock,
        rng: &mut Pcg64Mcg,
    ) {
        for &agent in changed {
            if clock.is_spent() {
                return;
            }
            self.replan(&[agent], legs, clock, rng);
        }
        let mut num_in_vain = 0;
        while !clock.is_spent() {
            let Some((seed, num_late)) = self.choose_late(legs, rng) else { return };
            if num_in_vain > Self::PATIENCE * (1 + num_late) {
                return;
            }
            let group = self.group(seed, legs, rng);
            let before = self.total_loss();
            self.replan(&group, legs, clock, rng);
            num_in_vain = if self.total_loss() < before { 0 } else { num_in_vain + 1 };
        }
    }

    /// An agent that loses time, the more likely the more it loses, and how many there are.
    fn choose_late(&self, legs: &[Vec<Leg>], rng: &mut Pcg64Mcg) -> Option<(usize, usize)> {
        let delay = |agent: usize| {
            u64::from(self.costs[agent].saturating_sub(least(&self.paths[agent], &legs[agent])))
        };
        let num_late = (0..self.paths.len()).filter(|&agent| delay(agent) > 0).count();
        let total: u64 = (0..self.paths.len()).map(delay).sum();
        if total == 0 {
            return None;
        }
        let mut at = below(rng, total as usize) as u64;
        let seed = (0..self.paths.len()).find(|&agent| {
            let found = at < delay(agent);
            at = at.saturating_sub(delay(agent));
            found
        });
        seed.map(|seed| (seed, num_late))
    }

    /// The agent and those that keep it from going straight on.
    fn group(&self, seed: usize, legs: &[Vec<Leg>], rng: &mut Pcg64Mcg) -> Vec<usize> {
        let most = 2 + below(rng, 6);
        let mut group = vec![seed];
        for _ in 0..3 {
            let walker = group[below(rng, group.len())];
            let start = below(rng, 2) * below(rng, self.num_steps);
            self.walk(walker, start, legs, most, &mut group, rng);
            if group.len() >= most {
                break;
            }
        }
        group
    }

    /// Goes from a place on an agent's path toward its goal and collects whom it meets.
    fn walk(
        &self,
        agent: usize,
        start: usize,
        legs: &[Vec<Leg>],
        most: usize,
        group: &mut Vec<usize>,
        rng: &mut Pcg64Mcg,
    ) {
        let path = &self.paths[agent];
        let Some(leg) = legs[agent].get(phase(&path[..=start], &legs[agent])) else { return };
        let mut at = path[start];
        for step in start + 1..=self.num_steps {
            let cost = leg.to_go[at as usize];
            let nearer = |&&to: &&Vertex| leg.to_go[to as usize] < cost;
            let around = self.graph.neighbours(at);
            let count = around.iter().filter(nearer).count();
            if count == 0 {
                return;
            }
            let to = around.iter().filter(nearer).nth(below(rng, count)).copied().unwrap_or(at);
            for other in self.reserved.holders(to, step as u32 - 1, step as u32) {
                if group.len() < most && !group.contains(&other) {
                    group.push(other);
                }
            }
            at = to;
        }
    }

    /// Puts some agents on new ways in a random order, if that is no worse.
    fn replan(&mut self, group: &[usize], legs: &[Vec<Leg>], clock: &mut Clock, rng: &mut Pcg64Mcg) {
        let mut order = group.to_vec();
        shuffle(&mut order, rng);
        for &agent in &order {
            self.reserved.remove(agent, &self.paths[agent], false);
            self.left.add(agent, &self.paths[agent], false);
        }
        let found = self.find_all(&order, legs, clock, rng);
        for &agent in order.iter().skip(found.len()) {
            self.left.remove(agent, &self.paths[agent], false);
        }
        if found.len() == order.len() {
            for (&agent, (path, cost)) in order.iter().zip(found) {
                self.paths[agent] = path;
                self.costs[agent] = cost;
            }
            return;
        }
        for (&agent, (path, _)) in order.iter().zip(&found) {
            self.reserved.remove(agent, path, false);
        }
        for &agent in &order {
            self.reserved.add(agent, &self.paths[agent], false);
        }
    }

    /// The new ways of those first in the order, as far as there are some that are no worse than the old ones.
    fn find_all(
        &mut self,
        order: &[usize],
        legs: &[Vec<Leg>],
        clock: &mut Clock,
        rng: &mut Pcg64Mcg,
    ) -> Vec<(Vec<Vertex>, u32)> {
        let most: u64 = order.iter().map(|&agent| self.discount.loss(self.costs[agent])).sum();
        let (mut found, mut total) = (Vec::with_capacity(order.len()), 0);
        for &agent in order {
            if clock.count_node() {
                break;
            }
            self.left.remove(agent, &self.paths[agent], false);
            let way = self.find(agent, legs, rng.next_u32());
            total += way.as_ref().map_or(0, |way| self.discount.loss(way.1));
            let Some(way) = way.filter(|_| total <= most) else {
                self.left.add(agent, &self.paths[agent], false);
                break;
            };
            self.reserved.add(agent, &way.0, false);
            found.push(way);
        }
        found
    }

    fn find(&mut self, agent: usize, legs: &[Vec<Leg>], salt: u32) -> Option<(Vec<Vertex>, u32)> {
        let task = Task {
            start: self.paths[agent][0],
            legs: &legs[agent],
            reserved: &self.reserved,
            avoided: Some(&self.left),
            banned: &[],
            horizon: Horizon::Window(self.num_steps as u32),
            order: Order::Cost,
            salt,
        };
        self.sipp.find(&task).map(|way| (way.path, way.cost))
    }
}

/// Where an agent would rather be.
#[derive(Clone, Copy, Debug)]
enum Wish<'a> {
    Go(&'a CostToGo),
    /// Where it is.
    Rest(Vertex),
}

impl Costs for Wish<'_> {
    fn cost(&self, vertex: Vertex) -> u32 {
        match self {
            Self::Go(to_go) => to_go[vertex as usize],
            Self::Rest(here) => u32::from(vertex != *here),
        }
    }
}

/// Number of goals that a path reaches.
fn phase(path: &[Vertex], legs: &[Leg]) -> usize {
    let mut phase = 0;
    for &vertex in path {
        while legs.get(phase).is_some_and(|leg| leg.to_go[vertex as usize] == 0) {
            phase += 1;
        }
    }
    phase
}

/// Steps until a path reaches its last goal, beyond its end as if the agent were alone.
fn cost(path: &[Vertex], legs: &[Leg]) -> u32 {
    let mut phase = 0;
    for (step, &vertex) in path.iter().enumerate() {
        while legs.get(phase).is_some_and(|leg| leg.to_go[vertex as usize] == 0) {
            phase += 1;
        }
        if phase == legs.len() {
            return step as u32;
        }
    }
    let (leg, end) = (&legs[phase], path[path.len() - 1]);
    (path.len() as u32 - 1).saturating_add(leg.to_go[end as usize]).saturating_add(leg.then)
}

/// What the way would cost if the agent were alone.
fn least(path: &[Vertex], legs: &[Leg]) -> u32 {
    legs.first().map_or(0, |leg| leg.to_go[path[0] as usize].saturating_add(leg.then))
}
