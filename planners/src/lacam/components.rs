//! Small connected components of a map, which can be searched exhaustively on their own.

use std::collections::HashSet;

use crate::distances::CostToGo;
use crate::graph::{Graph, Vertex};
use crate::problem::Problem;

/// The size limit of a small component.
const MAX_CELLS: usize = 64;

/// The problem of the agents in one component.
#[derive(Debug)]
pub(crate) struct Component {
    pub agents: Vec<usize>,
    pub problem: Problem,
    pub costs: Vec<CostToGo>,
}

/// Returns the small components with at least two agents, unless one contains all agents.
pub(crate) fn small_components(problem: &Problem, costs: &[CostToGo]) -> Vec<Component> {
    let mut seen = HashSet::new();
    let mut components = Vec::new();
    for &start in &problem.starts {
        if seen.contains(&start) {
            continue;
        }
        let Some(cells) = small_component(&problem.graph, start) else {
            continue;
        };
        let agents = 0..problem.num_agents();
        let agents: Vec<usize> = agents.filter(|&agent| cells.contains(&problem.starts[agent])).collect();
        if (2..problem.num_agents()).contains(&agents.len()) {
            let costs = agents.iter().map(|&agent| costs[agent].clone()).collect();
            let problem = Problem { max_steps: None, ..problem.only(&agents) };
            components.push(Component { agents, problem, costs });
        }
        seen.extend(cells);
    }
    components
}

/// Returns the component of a vertex, if it is small.
fn small_component(graph: &Graph, start: Vertex) -> Option<HashSet<Vertex>> {
    let mut cells = HashSet::from([start]);
    let mut queue = vec![start];
    while let Some(vertex) = queue.pop() {
        queue.extend(graph.neighbours(vertex).iter().filter(|&&vertex| cells.insert(vertex)));
        if cells.len() > MAX_CELLS {
            return None;
        }
    }
    Some(cells)
}
