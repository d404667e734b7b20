//! Makes a valid plan better: takes some agents out, plans them anew one after the other, keeps what is no worse.
//!
//! Papers: Li, Chen, Harabor, Stuckey, Koenig, "Anytime Multi-Agent Path Finding via Large Neighborhood Search", IJCAI
//! 2021, and "MAPF-LNS2", AAAI 2022; several at work on one plan: Chan, Chen, Harabor, Stuckey, "Anytime Multi-Agent
//! Path Finding with Operation Parallelism in Large Neighborhood Search", AAMAS 2024.
//!
//! | here | there |
//! | --- | --- |
//! | `Team` | P: the paths |
//! | `Choice` | the destroy heuristics and their weights |
//! | `Refiner::repair` | the replan: prioritized planning in random order |

mod choice;
mod detour;
mod reservations;
mod shared;
mod team;

use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

use crate::distances::CostToGo;
use crate::graph::Vertex;
use crate::problem::Problem;
use crate::random::{below, shuffle};
use crate::stepper::Agent;
use choice::Choice;
use detour::{Detours, Trip};
use reservations::{Path, Reservations};
pub(crate) use shared::Shared;
use team::Team;
pub(crate) use team::{paths_of, steps_of};

/// One who refines, alone or beside others.
#[derive(Debug)]
pub(crate) struct Refiner<'a> {
    team: Team<'a>,
    shared: &'a Shared,
    /// How much of what is shared the team has taken over.
    num_taken_over: usize,
    choice: Choice,
    detours: Detours,
    random: Pcg64Mcg,
    agents: Vec<Agent>,
    old: Vec<Path>,
    new: Vec<Path>,
}

/// Number of times that a team needs whose plan has so many steps.
pub(crate) fn span(problem: &Problem, num_steps: usize) -> usize {
    let slack = num_steps + num_steps / 4 + 8;
    problem.most_steps.map_or(slack, |most| slack.min(most)).max(num_steps) + 1
}

/// Bytes that one refiner takes.
pub(crate) fn bytes(problem: &Problem, num_steps: usize) -> usize {
    let (num_vertices, span) = (problem.graph.num_vertices(), span(problem, num_steps));
    Reservations::bytes(num_vertices, span) + Detours::bytes(num_vertices, span)
}

/// Whether there are not too many agents.
pub(crate) fn fits(problem: &Problem) -> bool {
    (1..Reservations::MOST_AGENTS).contains(&problem.num_agents())
}

/// Orders in which all agents are planned anew at the beginning.
const ORDERS: usize = 4;

impl<'a> Refiner<'a> {
    /// Begins with a valid plan that all refiners have in common.
    pub fn new(
        problem: &'a Problem,
        costs: &'a [CostToGo],
        plan: &[Vec<Vertex>],
        shared: &'a Shared,
        seed: u64,
    ) -> Self {
        let span = span(problem, plan.len() - 1);
        let num_vertices = problem.graph.num_vertices();
        Self {
            team: Team::new(problem, costs, &paths_of(plan), span),
            shared,
            num_taken_over: 0,
            choice: Choice::new(problem.num_agents(), num_vertices),
            detours: Detours::new(num_vertices, span as u32),
            random: Pcg64Mcg::seed_from_u64(seed),
            agents: Vec::new(),
            old: Vec::new(),
            new: Vec::new(),
        }
    }

    /// By how much agents arrive later than each would alone, with what is after the cap counted many times.
    pub fn total_delay(&self) -> u64 {
        self.team.total_delay()
    }

    /// The sum of costs of the plan, unless it is longer than it may be.
    pub fn cost(&self) -> Option<u64> {
        self.team.cost()
    }

    /// The plan as it now is.
    pub fn plan(&self) -> Vec<Vec<Vertex>> {
        steps_of(self.team.paths())
    }

    /// Puts a whole plan in the place of this one, if it is better and has no more steps than there are times.
    pub fn replace(&mut self, plan: &[Vec<Vertex>]) {
        let paths = paths_of(plan);
        let span = self.team.span() as usize;
        let delay = |(agent, path): (usize, &Path)| self.team.delay_of(agent as Agent, path.len() as u32 - 1);
        let delays: u64 = paths.iter().enumerate().map(delay).sum();
        if delays >= self.team.total_delay() || paths.iter().any(|path| path.len() > span) {
            return;
        }
        let all: Vec<Agent> = (0..paths.len() as Agent).collect();
        loop {
            self.take_over();
            if let Some(seen) = self.shared.publish(&all, &paths, self.num_taken_over) {
                self.num_taken_over = seen;
                break;
            }
        }
        self.agents = all;
        self.exchange(&paths);
    }

    /// Attempts to plan all agents anew, in some orders, unless it is told to stop.
    pub fn begin(&mut self, mut stop: impl FnMut() -> bool) {
        for order in 0..ORDERS {
            if self.team.total_delay() == 0 || stop() {
                return;
            }
            self.agents.clear();
            self.agents.extend(0..self.team.num_agents() as Agent);
            shuffle(&mut self.agents, &mut self.random);
            let team = &self.team;
            match order {
                0 => self.agents.sort_by_key(|&agent| std::cmp::Reverse(team.least(agent))),
                1 => self.agents.sort_by_key(|&agent| std::cmp::Reverse(team.delay(agent))),
                _ => {}
            }
            if self.repair(&mut stop) {
                self.publish();
            }
        }
    }

    /// One attempt to make the plan better; whether it did.
    pub fn improve(&mut self) -> bool {
        self.take_over();
        if self.team.total_delay() == 0 {
            return false;
        }
        let work = self.detours.num_expanded();
        let chosen = self.choice.choose(&self.team, &mut self.random);
        self.agents.clear();
        self.agents.extend_from_slice(chosen);
        shuffle(&mut self.agents, &mut self.random);
        let before = self.team.total_delay();
        let is_changed = self.repair(|| false) && self.publish();
        let gain = before.saturating_sub(self.team.total_delay()) as f64;
        let work = (self.detours.num_expanded() - work + 100) as f64;
        self.choice.reward(if is_changed { gain.min(64.0) * 1000.0 / work } else { 0.0 });
        is_changed && gain > 0.0
    }

    /// Plans the agents anew in their order, with no more delay in sum; if that fails, they keep their paths.
    fn repair(&mut self, mut stop: impl FnMut() -> bool) -> bool {
        let mut left: u64 = self.agents.iter().map(|&agent| self.team.delay(agent)).sum();
        if left == 0 {
            return false;
        }
        keep(&mut self.old, self.agents.iter().map(|&agent| &self.team.path(agent)[..]));
        self.agents.iter().for_each(|&agent| self.team.lift(agent));
        self.new.resize_with(self.agents.len().max(self.new.len()), Path::new);
        for index in 0..self.agents.len() {
            let agent = self.agents[index];
            if stop() || !self.find(agent, left, index) {
                self.agents[..index].iter().for_each(|&agent| self.team.lift(agent));
                for (&agent, path) in self.agents.iter().zip(&self.old) {
                    self.team.put(agent, path);
                }
                return false;
            }
            self.team.put(agent, &self.new[index]);
            left -= self.team.delay(agent);
        }
        true
    }

    fn find(&mut self, agent: Agent, delay: u64, index: usize) -> bool {
        let (start, goal) = self.team.ends(agent);
        let (costs, latest) = (self.team.costs(agent), self.team.latest(agent, delay));
        let dice = below(&mut self.random, u32::MAX as usize) as u32;
        let trip = Trip { start, goal, costs, latest, dice };
        self.detours.find(self.team.graph(), self.team.taken(), trip, &mut self.new[index])
    }

    /// Tells the others; if they have been at the same agents meanwhile, or in the way, the old paths come back.
    fn publish(&mut self) -> bool {
        let num_agents = self.agents.len();
        loop {
            if let Some(seen) =
                self.shared.publish(&self.agents, &self.new[..num_agents], self.num_taken_over)
            {
                self.num_taken_over = seen;
                return true;
            }
            let old = std::mem::take(&mut self.old);
            self.exchange(&old[..num_agents]);
            self.old = old;
            let agents = std::mem::take(&mut self.agents);
            let is_touched = self.take_over_but(&agents);
            self.agents = agents;
            if is_touched || !self.put_if_free() {
                return false;
            }
        }
    }

    /// Gives the agents their new paths once more, if those are still free.
    fn put_if_free(&mut self) -> bool {
        keep(&mut self.old, self.agents.iter().map(|&agent| &self.team.path(agent)[..]));
        self.agents.iter().for_each(|&agent| self.team.lift(agent));
        for index in 0..self.agents.len() {
            if self.team.taken().is_free(&self.new[index]) {
                self.team.put(self.agents[index], &self.new[index]);
                continue;
            }
            self.agents[..index].iter().for_each(|&agent| self.team.lift(agent));
            for (&agent, path) in self.agents.iter().zip(&self.old) {
                self.team.put(agent, path);
            }
            return false;
        }
        true
    }

    /// Gives the agents other paths, all at once.
    fn exchange(&mut self, paths: &[Path]) {
        self.agents.iter().for_each(|&agent| self.team.lift(agent));
        for (&agent, path) in self.agents.iter().zip(paths) {
            self.team.put(agent, path);
        }
    }

    fn take_over(&mut self) {
        self.take_over_but(&[]);
    }

    /// Takes over what others have published; whether any of these agents are among it.
    fn take_over_but(&mut self, agents: &[Agent]) -> bool {
        let mut is_touched = false;
        for change in self.shared.since(self.num_taken_over) {
            is_touched |= change.agents.iter().any(|agent| agents.contains(agent));
            self.agents.clear();
            self.agents.extend_from_slice(&change.agents);
            self.exchange(&change.paths);
            self.num_taken_over += 1;
        }
        is_touched
    }
}

/// Copies paths into room that is used again and again.
fn keep<'p>(room: &mut Vec<Path>, paths: impl Iterator<Item = &'p [Vertex]>) {
    for (index, path) in paths.enumerate() {
        if index == room.len() {
            room.push(Path::new());
        }
        room[index].clear();
        room[index].extend_from_slice(path);
    }
}
