//! Whether small problems have a plan at all: a walk through all joint places of all agents.

use std::collections::HashSet;

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
