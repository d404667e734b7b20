//! Ways around the traffic: costs to go that count whom an agent would meet.
//!
//! Paper: Chen, Harabor, Li, Stuckey, "Traffic Flow Optimisation for Lifelong Multi-Agent Path Finding", AAAI 2024:
//! each agent plans a way over edges that cost the more, the more others plan to come the other way or by the same
//! vertex. Unlike there, PIBT then follows the costs to go of that search and not only the one way.
//!
//! | here | there |
//! | --- | --- |
//! | `flows` | f: the agents that plan to go along an edge |
//! | `visits` | n: the agents that plan to come by a vertex |
//! | `GuideParams::against`, `GuideParams::crowd` | the contraflow and the vertex congestion in the cost of an edge |

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use crate::distances::UNREACHABLE;
use crate::graph::{Graph, Vertex};
use crate::stepper::Agent;

/// What an edge costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GuideParams {
    /// Units: cost of an edge without traffic.
    pub edge: u32,
    /// Units: cost for each agent that plans to come the other way.
    pub against: u32,
    /// Units: cost for each agent that plans to come by the vertex at its end.
    pub crowd: u32,
}

impl Default for GuideParams {
    fn default() -> Self {
        Self { edge: 16, against: 8, crowd: 1 }
    }
}

/// The ways that all agents plan, and costs to go in their traffic.
#[derive(Debug)]
pub(crate) struct Guide {
    graph: Arc<Graph>,
    params: GuideParams,
    /// For each vertex and neighbour, the agents that plan to go there.
    flows: Vec<[u32; 4]>,
    visits: Vec<u32>,
    /// For each agent, the way it plans.
    ways: Vec<Vec<Vertex>>,
    queue: BinaryHeap<Reverse<(u32, Vertex)>>,
}

impl Guide {
    /// No traffic yet.
    pub fn new(graph: Arc<Graph>, num_agents: usize, params: GuideParams) -> Self {
        let num_vertices = graph.num_vertices();
        Self {
            graph,
            params: GuideParams { edge: params.edge.max(1), ..params },
            flows: vec![[0; 4]; num_vertices],
            visits: vec![0; num_vertices],
            ways: vec![Vec::new(); num_agents],
            queue: BinaryHeap::new(),
        }
    }

    /// Plans a way for an agent through the traffic of all others; writes the costs to go.
    pub fn plan(&mut self, agent: Agent, from: Vertex, goal: Vertex, costs: &mut Vec<u32>) {
        self.enter(agent, false);
        self.search(goal, costs);
        let mut way = std::mem::take(&mut self.ways[agent as usize]);
        way.clear();
        way.push(from);
        let mut place = from;
        while place != goal && costs[place as usize] != UNREACHABLE {
            let around = self.graph.neighbours(place).iter().copied();
            place = around.min_by_key(|&vertex| costs[vertex as usize]).unwrap_or(goal);
            way.push(place);
        }
        self.ways[agent as usize] = way;
        self.enter(agent, true);
    }

    /// Counts the way of an agent in or out.
    fn enter(&mut self, agent: Agent, is_in: bool) {
        let change = |count: &mut u32| *count = if is_in { *count + 1 } else { *count - 1 };
        let way = &self.ways[agent as usize];
        for &vertex in way {
            change(&mut self.visits[vertex as usize]);
        }
        for step in way.windows(2) {
            let around = self.graph.neighbours(step[0]);
            if let Some(slot) = around.iter().position(|&vertex| vertex == step[1]) {
                change(&mut self.flows[step[0] as usize][slot]);
            }
        }
    }

    /// From the goal backwards, by Dijkstra.
    fn search(&mut self, goal: Vertex, costs: &mut Vec<u32>) {
        let GuideParams { edge, against, crowd } = self.params;
        costs.clear();
        costs.resize(self.graph.num_vertices(), UNREACHABLE);
        costs[goal as usize] = 0;
        self.queue.clear();
        self.queue.push(Reverse((0, goal)));
        while let Some(Reverse((cost, to))) = self.queue.pop() {
            if cost > costs[to as usize] {
                continue;
            }
            let enter = cost + edge + crowd * self.visits[to as usize];
            for (slot, &from) in self.graph.neighbours(to).iter().enumerate() {
                let cost = enter + against * self.flows[to as usize][slot];
                if cost < costs[from as usize] {
                    costs[from as usize] = cost;
                    self.queue.push(Reverse((cost, from)));
                }
            }
        }
    }
}
