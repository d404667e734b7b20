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
    /// The limit on joint states, the limit on chains or the budget was exceeded.
    Unknown,
}

/// Number of chains of agents that may be extended for each joint state that `max_states` allows.
///
/// In a dense crowd, the number of chains of one joint state is exponential in the number of agents.
const CHAINS_PER_STATE: usize = 100;

/// Decides whether the goals can be reached, by breadth-first search up to a limit on joint states.
///
/// Reachability does not depend on time, and every agent can wait. It is therefore enough to move one agent at a time,
/// or one ring of agents that follow each other.
pub(crate) fn reachability(problem: &Problem, max_states: usize, clock: &mut Clock) -> Reachability {
    let mut search = Search {
        graph: &problem.graph,
        max_states,
        clock,
        seen: FxHashSet::from_iter([problem.starts.clone()]),
        next: vec![problem.starts.clone()],
        holders: vec![None; problem.graph.num_vertices()],
        num_chains: 0,
    };
    while !search.next.is_empty() {
        for places in std::mem::take(&mut search.next) {
            if places == problem.goals {
                return Reachability::Reachable;
            }
            if !search.expand(&places) || search.clock.is_spent() {
                return Reachability::Unknown;
            }
        }
    }
    Reachability::Unreachable
}

/// The search.
struct Search<'a> {
    graph: &'a Graph,
    max_states: usize,
    clock: &'a mut Clock,
    seen: FxHashSet<Vec<Vertex>>,
    /// The joint states of the next level.
    next: Vec<Vec<Vertex>>,
    /// The agent on each vertex in the joint state that is expanded.
    holders: Vec<Option<usize>>,
    num_chains: usize,
}

impl Search<'_> {
    /// Number of chains between two readings of the clock.
    const STRIDE: usize = 1024;

    /// Generates the successors of a joint state; returns whether the limits and the budget allow more.
    fn expand(&mut self, places: &[Vertex]) -> bool {
        for (agent, &place) in places.iter().enumerate() {
            self.holders[place as usize] = Some(agent);
        }
        let is_complete = (0..places.len()).all(|agent| self.follow(places, &mut vec![agent]));
        for &place in places {
            self.holders[place as usize] = None;
        }
        is_complete
    }

    /// Extends a chain of agents, each of which follows the next, by a move of its last agent. If the chain is a single
    /// agent, it may move to a free vertex; if it closes into a ring, the ring rotates. Returns whether the limits and
    /// the budget allow more.
    fn follow(&mut self, places: &[Vertex], chain: &mut Vec<usize>) -> bool {
        self.num_chains += 1;
        if self.num_chains > self.max_states.saturating_mul(CHAINS_PER_STATE)
            || (self.num_chains.is_multiple_of(Self::STRIDE) && self.clock.is_spent())
        {
            return false;
        }
        let (graph, last) = (self.graph, chain[chain.len() - 1]);
        graph.neighbours(places[last]).iter().all(|&to| match self.holders[to as usize] {
            None if chain.len() == 1 => {
                let mut moved = places.to_vec();
                moved[last] = to;
                self.generate(moved)
            }
            // A ring is found only from its agent with the lowest index. Two agents cannot swap.
            Some(other) if other == chain[0] && chain.len() > 2 => {
                let mut moved = places.to_vec();
                for (at, &agent) in chain.iter().enumerate() {
                    moved[agent] = places[chain[(at + 1) % chain.len()]];
                }
                self.generate(moved)
            }
            Some(other) if other > chain[0] && !chain.contains(&other) => {
                chain.push(other);
                let is_complete = self.follow(places, chain);
                chain.pop();
                is_complete
            }
            _ => true,
        })
    }

    /// Adds a joint state; returns whether the limit allows more.
    fn generate(&mut self, moved: Vec<Vertex>) -> bool {
        if self.seen.insert(moved.clone()) {
            self.next.push(moved);
        }
        self.seen.len() <= self.max_states
    }
}

#[cfg(test)]
mod tests {
    use pogema_core::{Cell, Error, Map};

    use super::*;
    use crate::budget::Budget;

    #[test]
    fn a_full_block_exceeds_the_limit_on_states_or_chains() -> Result<(), Error> {
        // 64 agents have more than 10^9 rings.
        let map = Map::new(8, 8, vec![false; 64])?;
        let starts: Vec<Cell> = (0..64).map(|index| map.cell_at(index)).collect();
        let mut goals = starts.clone();
        goals.swap(0, 1);
        let problem = Problem::new(&map, &starts, &goals)?;
        for max_states in [0, 100, 3000] {
            let found = reachability(&problem, max_states, &mut Budget::default().start());
            assert_eq!(found, Reachability::Unknown, "{max_states} states");
        }
        Ok(())
    }
}
