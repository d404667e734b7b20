//! Walks through the joint places of all agents: whether small problems have a plan at all, and the best one of a few.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use crate::conflict::Paths;
use crate::distances::CostToGo;
use crate::graph::{Graph, Vertex};
use crate::problem::{Clock, Problem};

/// What the walk found out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reach {
    /// The goals can be reached.
    Solvable,
    /// They cannot.
    Unsolvable,
    /// There were more joint places than allowed.
    Unknown,
}

/// Walks breadth first until the goals are met or so many joint places have been seen.
///
/// Whether agents can get somewhere does not depend on when they do, so no step is counted; and since all can wait,
/// one step of the walk moves one agent, or a ring of agents that follow each other.
pub(crate) fn reach(problem: &Problem, most_places: usize, clock: &mut Clock) -> Reach {
    let mut seen: HashSet<Vec<Vertex>> = HashSet::from([problem.starts.clone()]);
    let mut level = vec![problem.starts.clone()];
    while !level.is_empty() {
        let mut next = Vec::new();
        for places in &level {
            if *places == problem.goals {
                return Reach::Solvable;
            }
            for moved in moves(&problem.graph, places) {
                if seen.insert(moved.clone()) {
                    next.push(moved);
                }
            }
            if seen.len() > most_places || clock.is_spent() {
                return Reach::Unknown;
            }
        }
        level = next;
    }
    Reach::Unsolvable
}

/// The joint places after one agent has moved to a free cell, or a ring of agents has turned.
fn moves(graph: &Graph, places: &[Vertex]) -> Vec<Vec<Vertex>> {
    let mut found = Vec::new();
    for agent in 0..places.len() {
        let mut chain = vec![agent];
        follow(graph, places, &mut chain, &mut found);
    }
    found
}

/// Lets the last agent of a chain, each of which follows the next, go on.
fn follow(graph: &Graph, places: &[Vertex], chain: &mut Vec<usize>, found: &mut Vec<Vec<Vertex>>) {
    let last = chain[chain.len() - 1];
    for &to in graph.neighbours(places[last]) {
        match places.iter().position(|&place| place == to) {
            None if chain.len() == 1 => {
                let mut moved = places.to_vec();
                moved[last] = to;
                found.push(moved);
            }
            // Of a ring only the lowest agent begins the chain; two cannot exchange their places.
            Some(other) if other == chain[0] && chain.len() > 2 => {
                let mut moved = places.to_vec();
                for (at, &agent) in chain.iter().enumerate() {
                    moved[agent] = places[chain[(at + 1) % chain.len()]];
                }
                found.push(moved);
            }
            Some(other) if other > chain[0] && !chain.contains(&other) => {
                chain.push(other);
                follow(graph, places, chain, found);
                chain.pop();
            }
            _ => {}
        }
    }
}

/// Most agents whose best plan is looked for.
const MOST_AGENTS: usize = 3;

/// Where each agent is, and which of them, a bit for each, move no more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Place {
    vertices: [Vertex; MOST_AGENTS],
    at_rest: u8,
}

impl Place {
    fn rests(&self, agent: usize) -> bool {
        self.at_rest >> agent & 1 == 1
    }
}

/// A place that was reached after so many steps of all agents that were not at rest.
#[derive(Clone, Copy, Debug)]
struct Reached {
    place: Place,
    cost: u32,
    parent: Option<u32>,
}

/// A* through joint places, the steps of agents alone being the heuristic.
struct Walk<'a> {
    problem: &'a Problem,
    costs: &'a [CostToGo],
    reached: Vec<Reached>,
    known: HashMap<Place, u32>,
    /// What is still to be looked at, by the cost it promises.
    open: Vec<Vec<u32>>,
}

/// The best paths of a few agents; none if they are too many, so many joint places are not enough, or the paths have
/// more steps than they may.
pub(crate) fn best(
    problem: &Problem,
    costs: &[CostToGo],
    most_places: usize,
    clock: &mut Clock,
) -> Option<Paths> {
    let num_agents = problem.num_agents();
    if num_agents > MOST_AGENTS {
        return None;
    }
    let mut vertices = [0; MOST_AGENTS];
    vertices[..num_agents].copy_from_slice(&problem.starts);
    let mut walk = Walk { problem, costs, reached: Vec::new(), known: HashMap::new(), open: Vec::new() };
    walk.arrive(Place { vertices, at_rest: 0 }, 0, None);
    let mut promise = 0;
    while promise < walk.open.len() {
        let Some(index) = walk.open[promise].pop() else {
            promise += 1;
            continue;
        };
        let Reached { place, cost, .. } = walk.reached[index as usize];
        if walk.known[&place] != index {
            continue;
        }
        if usize::from(place.at_rest) + 1 == 1 << num_agents {
            return walk.paths(index);
        }
        if walk.reached.len() > most_places || clock.is_spent() {
            return None;
        }
        let num_moving = num_agents as u32 - place.at_rest.count_ones();
        walk.step(place, place.vertices, 0, cost + num_moving, index);
    }
    None
}

impl Walk<'_> {
    /// All places after a step, of which the first agents have made theirs.
    fn step(&mut self, from: Place, to: [Vertex; MOST_AGENTS], agent: usize, cost: u32, parent: u32) {
        if agent == self.problem.num_agents() {
            return self.arrive(Place { vertices: to, ..from }, cost, Some(parent));
        }
        let here = from.vertices[agent];
        let graph = self.problem.graph.clone();
        let around = if from.rests(agent) { &[][..] } else { graph.neighbours(here) };
        for &vertex in around.iter().chain([&here]) {
            let meets =
                |other: usize| to[other] == vertex || (to[other] == here && from.vertices[other] == vertex);
            if !(0..agent).any(meets) {
                let mut to = to;
                to[agent] = vertex;
                self.step(from, to, agent + 1, cost, parent);
            }
        }
    }

    /// Notes a place, once for each choice of agents at their goals who rest from now on.
    fn arrive(&mut self, place: Place, cost: u32, parent: Option<u32>) {
        let may_rest = (0..self.problem.num_agents())
            .filter(|&agent| !place.rests(agent) && place.vertices[agent] == self.problem.goals[agent])
            .fold(0, |agents, agent| agents | 1 << agent);
        let mut resting = may_rest;
        loop {
            self.note(Place { at_rest: place.at_rest | resting, ..place }, cost, parent);
            if resting == 0 {
                return;
            }
            resting = (resting - 1) & may_rest;
        }
    }

    fn note(&mut self, place: Place, cost: u32, parent: Option<u32>) {
        if self.known.get(&place).is_some_and(|&known| self.reached[known as usize].cost <= cost) {
            return;
        }
        let moving = (0..self.problem.num_agents()).filter(|&agent| !place.rests(agent));
        let ahead: u32 = moving.map(|agent| self.costs[agent][place.vertices[agent] as usize]).sum();
        let least = self.problem.lower_bound(self.costs);
        let promise = (u64::from(cost + ahead) - least) as usize;
        if self.open.len() <= promise {
            self.open.resize_with(promise + 1, Vec::new);
        }
        let index = self.reached.len() as u32;
        self.open[promise].push(index);
        self.known.insert(place, index);
        self.reached.push(Reached { place, cost, parent });
    }

    /// The paths that led to where all are at rest.
    fn paths(&self, last: u32) -> Option<Paths> {
        let before = |&index: &u32| self.reached[index as usize].parent;
        let mut places: Vec<Place> = std::iter::successors(Some(last), before)
            .map(|index| self.reached[index as usize].place)
            .collect();
        places.reverse();
        let mut paths = Paths::new(self.problem.num_agents(), true);
        for agent in 0..self.problem.num_agents() {
            let num_steps = places.iter().position(|place| place.rests(agent))?;
            if self.problem.most_steps.is_some_and(|most| num_steps > most) {
                return None;
            }
            let path = places[..=num_steps].iter().map(|place| place.vertices[agent]).collect();
            paths.set(agent, Arc::new(path), num_steps as u32);
        }
        Some(paths)
    }
}
