//! One step that always is: agents in an order, each taking the best cell that is left and pushing away who is there.
//!
//! Source: Okumura et al., "Priority Inheritance with Backtracking for Iterative Multi-agent Path Finding",
//! Artificial Intelligence 310, 2022

use crate::distances::CostToGo;
use crate::graph::{Graph, Vertex};

const NOBODY: u32 = u32::MAX;
const UNDECIDED: Vertex = Vertex::MAX;

/// The memory of the rule, kept from step to step.
#[derive(Debug)]
pub(crate) struct Push {
    /// Who is in each vertex now, and who will be.
    now: Vec<u32>,
    next: Vec<u32>,
}

/// What a step is chosen from.
struct Crowd<'a> {
    graph: &'a Graph,
    places: &'a [Vertex],
    /// The costs to go of each agent; none for one that has nowhere to go.
    to_go: &'a [Option<CostToGo>],
    salt: u32,
}

impl Push {
    /// Memory for a graph of so many vertices.
    pub(crate) fn new(num_vertices: usize) -> Self {
        Self { now: vec![NOBODY; num_vertices], next: vec![NOBODY; num_vertices] }
    }

    /// Where each agent goes, those first in the order choosing first.
    pub(crate) fn step(
        &mut self,
        graph: &Graph,
        places: &[Vertex],
        to_go: &[Option<CostToGo>],
        order: &[usize],
        salt: u32,
    ) -> Vec<Vertex> {
        let crowd = Crowd { graph, places, to_go, salt };
        for (agent, &place) in places.iter().enumerate() {
            self.now[place as usize] = agent as u32;
        }
        let mut chosen = vec![UNDECIDED; places.len()];
        for &agent in order {
            if chosen[agent] == UNDECIDED {
                self.choose(&crowd, agent, &mut chosen);
            }
        }
        for (&from, &to) in places.iter().zip(&chosen) {
            self.now[from as usize] = NOBODY;
            self.next[to as usize] = NOBODY;
        }
        chosen
    }

    /// Chooses for an agent, and for those in its way; whether it got what does not stand in another's way.
    fn choose(&mut self, crowd: &Crowd<'_>, agent: usize, chosen: &mut [Vertex]) -> bool {
        let from = crowd.places[agent];
        let (wishes, num_wishes) = crowd.wishes(agent, &self.now);
        for &to in &wishes[..num_wishes] {
            if self.next[to as usize] != NOBODY {
                continue;
            }
            let holder = self.now[to as usize];
            let swaps = holder != NOBODY && holder as usize != agent && chosen[holder as usize] == from;
            if swaps {
                continue;
            }
            self.next[to as usize] = agent as u32;
            chosen[agent] = to;
            let is_free = holder == NOBODY || holder as usize == agent;
            if is_free || chosen[holder as usize] != UNDECIDED || self.choose(crowd, holder as usize, chosen)
            {
                return true;
            }
        }
        self.next[from as usize] = agent as u32;
        chosen[agent] = from;
        false
    }
}

impl Crowd<'_> {
    /// The cells an agent may go to, the best first.
    fn wishes(&self, agent: usize, now: &[u32]) -> ([Vertex; 5], usize) {
        let from = self.places[agent];
        let around = self.graph.neighbours(from);
        let mut wishes = [from; 5];
        wishes[..around.len()].copy_from_slice(around);
        let cost = |to: Vertex| match &self.to_go[agent] {
            Some(to_go) => to_go[to as usize],
            None => u32::from(to != from),
        };
        let key = |&to: &Vertex| {
            let is_taken = now[to as usize] != NOBODY && to != from;
            (cost(to), is_taken, (to ^ self.salt).wrapping_mul(0x9e37_79b1), to)
        };
        wishes[..=around.len()].sort_unstable_by_key(key);
        (wishes, around.len() + 1)
    }
}
