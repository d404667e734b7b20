//! Traffic guidance: costs to go that include congestion.
//!
//! Source: Chen, Harabor, Li, Stuckey, "Traffic Flow Optimisation for Lifelong Multi-Agent Path Finding", AAAI 2024:
//! each agent plans a guide path over edges whose costs grow with the flow of other agents. Unlike in the paper, PIBT
//! follows the costs to go from the search for this path instead of the path itself.
//!
//! | paper | here |
//! | --- | --- |
//! | f, the flow along an edge | `flows` |
//! | n, the flow through a vertex | `visits` |
//! | contraflow and vertex congestion | [`GuidanceParams::contraflow`], [`GuidanceParams::congestion`] |

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use crate::bfs::UNREACHABLE;
use crate::graph::{Graph, Vertex};
use crate::problem::Agent;

/// The cost of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GuidanceParams {
    /// The cost without traffic; 0 counts as 1.
    pub edge: u32,
    /// The additional cost for each agent that plans to move along the edge in the opposite direction.
    pub contraflow: u32,
    /// The additional cost for each agent that plans to visit the vertex at the end of the edge.
    pub congestion: u32,
}

impl Default for GuidanceParams {
    fn default() -> Self {
        Self { edge: 16, contraflow: 8, congestion: 1 }
    }
}

/// The guide paths of all agents, and the flows that they cause.
#[derive(Debug)]
pub(crate) struct Guidance {
    graph: Arc<Graph>,
    params: GuidanceParams,
    /// For each vertex and neighbour, the number of agents that plan this move.
    flows: Vec<[u32; 4]>,
    /// For each vertex, the number of agents that plan to visit it.
    visits: Vec<u32>,
    /// The guide path of each agent.
    paths: Vec<Vec<Vertex>>,
    queue: BinaryHeap<Reverse<(u32, Vertex)>>,
}

impl Guidance {
    /// Creates guidance without traffic.
    pub fn new(graph: Arc<Graph>, num_agents: usize, params: GuidanceParams) -> Self {
        let num_vertices = graph.num_vertices();
        Self {
            graph,
            params: GuidanceParams { edge: params.edge.max(1), ..params },
            flows: vec![[0; 4]; num_vertices],
            visits: vec![0; num_vertices],
            paths: vec![Vec::new(); num_agents],
            queue: BinaryHeap::new(),
        }
    }

    /// Plans the guide path of an agent in the traffic of all others, and writes its costs to go.
    pub fn plan(&mut self, agent: Agent, from: Vertex, goal: Vertex, costs: &mut Vec<u32>) {
        self.update_flows(agent, false);
        self.search(goal, costs);
        let mut path = std::mem::take(&mut self.paths[agent as usize]);
        path.clear();
        path.push(from);
        let mut place = from;
        while place != goal && costs[place as usize] != UNREACHABLE {
            let around = self.graph.neighbours(place).iter().copied();
            let cost = |vertex: Vertex| costs[vertex as usize];
            let next = around.min_by_key(|&vertex| cost(vertex)).filter(|&next| cost(next) < cost(place));
            // The costs are saturated, so they do not lead to the goal.
            let Some(next) = next else { break };
            place = next;
            path.push(place);
        }
        self.paths[agent as usize] = path;
        self.update_flows(agent, true);
    }

    /// Adds the guide path of an agent to the flows, or removes it.
    fn update_flows(&mut self, agent: Agent, is_added: bool) {
        let change = |count: &mut u32| *count = if is_added { *count + 1 } else { *count - 1 };
        let path = &self.paths[agent as usize];
        for &vertex in path {
            change(&mut self.visits[vertex as usize]);
        }
        for step in path.windows(2) {
            let around = self.graph.neighbours(step[0]);
            if let Some(slot) = around.iter().position(|&vertex| vertex == step[1]) {
                change(&mut self.flows[step[0] as usize][slot]);
            }
        }
    }

    /// Runs Dijkstra backwards from the goal. Large costs saturate.
    fn search(&mut self, goal: Vertex, costs: &mut Vec<u32>) {
        let GuidanceParams { edge, contraflow, congestion } = self.params;
        costs.clear();
        costs.resize(self.graph.num_vertices(), UNREACHABLE);
        costs[goal as usize] = 0;
        self.queue.clear();
        self.queue.push(Reverse((0, goal)));
        while let Some(Reverse((cost, to))) = self.queue.pop() {
            if cost > costs[to as usize] {
                continue;
            }
            let visits = congestion.saturating_mul(self.visits[to as usize]);
            let entering_cost = cost.saturating_add(edge).saturating_add(visits);
            for (slot, &from) in self.graph.neighbours(to).iter().enumerate() {
                let flows = contraflow.saturating_mul(self.flows[to as usize][slot]);
                let cost = entering_cost.saturating_add(flows).min(UNREACHABLE - 1);
                if cost < costs[from as usize] {
                    costs[from as usize] = cost;
                    self.queue.push(Reverse((cost, from)));
                }
            }
        }
    }
}
