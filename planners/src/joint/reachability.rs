//! Breadth-first search through joint states, which decides whether a small problem is solvable.

use rustc_hash::FxHashSet;

use crate::budget::Clock;
use crate::graph::{Graph, Vertex};
use crate::problem::Problem;

/// The verdict of the search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reachability {
    /// The goals can be reached.
    Reachable,
    /// The goals cannot be reached.
    Unreachable,
    /// The limit on joint states or the budget was exceeded.
    Unknown,
}

/// Decides whether the goals can be reached, by breadth-first search up to a limit on joint states.
///
/// Reachability does not depend on time, and every agent can wait. It is therefore enough to move one agent at a time,
/// or one ring of agents that follow each other.
pub(crate) fn reachability(problem: &Problem, max_states: usize, clock: &mut Clock) -> Reachability {
    let mut seen: FxHashSet<Vec<Vertex>> = FxHashSet::from_iter([problem.starts.clone()]);
    let mut level = vec![problem.starts.clone()];
    while !level.is_empty() {
        let mut next = Vec::new();
        for places in &level {
            if *places == problem.goals {
                return Reachability::Reachable;
            }
            for moved in moves(&problem.graph, places) {
                if seen.insert(moved.clone()) {
                    next.push(moved);
                }
            }
            if seen.len() > max_states || clock.is_spent() {
                return Reachability::Unknown;
            }
        }
        level = next;
    }
    Reachability::Unreachable
}

/// Returns the joint states after one agent moves to a free vertex or a ring of agents rotates.
fn moves(graph: &Graph, places: &[Vertex]) -> Vec<Vec<Vertex>> {
    let mut found = Vec::new();
    for agent in 0..places.len() {
        let mut chain = vec![agent];
        follow(graph, places, &mut chain, &mut found);
    }
    found
}

/// Extends a chain of agents, each of which follows the next, by a move of its last agent.
fn follow(graph: &Graph, places: &[Vertex], chain: &mut Vec<usize>, found: &mut Vec<Vec<Vertex>>) {
    let last = chain[chain.len() - 1];
    for &to in graph.neighbours(places[last]) {
        match places.iter().position(|&place| place == to) {
            None if chain.len() == 1 => {
                let mut moved = places.to_vec();
                moved[last] = to;
                found.push(moved);
            }
            // A ring is found only from its lowest agent. Two agents cannot swap.
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
