//! Small parts of a map that no way leads out of: what a few agents can do there is soon tried.

use std::collections::HashSet;

use crate::distances::CostToGo;
use crate::graph::{Graph, Vertex};
use crate::problem::Problem;

/// Most cells of a part that counts as small.
const MOST_CELLS: usize = 64;

/// Agents in a part of the map of their own, as a problem of their own.
#[derive(Debug)]
pub(crate) struct Part {
    pub agents: Vec<usize>,
    pub problem: Problem,
    pub costs: Vec<CostToGo>,
}

/// The small parts with at least two agents, unless one has all agents.
pub(crate) fn small_parts(problem: &Problem, costs: &[CostToGo]) -> Vec<Part> {
    let mut seen = HashSet::new();
    let mut parts = Vec::new();
    for &start in &problem.starts {
        if seen.contains(&start) {
            continue;
        }
        let Some(cells) = small_part(&problem.graph, start) else {
            continue;
        };
        let agents = 0..problem.num_agents();
        let agents: Vec<usize> = agents.filter(|&agent| cells.contains(&problem.starts[agent])).collect();
        if (2..problem.num_agents()).contains(&agents.len()) {
            let costs = agents.iter().map(|&agent| costs[agent].clone()).collect();
            let problem = Problem { most_steps: None, ..problem.only(&agents) };
            parts.push(Part { agents, problem, costs });
        }
        seen.extend(cells);
    }
    parts
}

/// All cells that can be reached from one, if they are few.
fn small_part(graph: &Graph, start: Vertex) -> Option<HashSet<Vertex>> {
    let mut cells = HashSet::from([start]);
    let mut queue = vec![start];
    while let Some(vertex) = queue.pop() {
        queue.extend(graph.neighbours(vertex).iter().filter(|&&vertex| cells.insert(vertex)));
        if cells.len() > MOST_CELLS {
            return None;
        }
    }
    Some(cells)
}
