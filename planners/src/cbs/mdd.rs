//! Multi-valued decision diagrams (MDDs): all optimal paths of one agent.

use crate::cbs::node::Constraint;
use crate::graph::{Graph, Vertex};
use crate::team_task::TeamTask;

/// For each step, the vertices that lie on optimal paths of an agent.
///
/// Source: Sharon et al., "The increasing cost tree search for optimal multi-agent pathfinding", Artificial
/// Intelligence 195, 2013
#[derive(Debug)]
pub(crate) struct Mdd {
    levels: Vec<Vec<Vertex>>,
}

impl Mdd {
    /// Builds the MDD of the paths of a given cost that satisfy the constraints.
    pub(crate) fn new(
        graph: &Graph,
        team: &TeamTask<'_>,
        agent: usize,
        cost: u32,
        constraints: &[Constraint],
    ) -> Self {
        let to_go = &team.legs[agent][0].to_go;
        let allows = |from: Vertex, to: Vertex, step: usize| {
            let breaks = |constraint: &Constraint| {
                constraint.step == step && constraint.at == to && constraint.from.is_none_or(|at| at == from)
            };
            !constraints.iter().any(breaks)
        };
        let mut levels = vec![vec![team.starts[agent]]];
        for step in 1..=cost as usize {
            let left = cost - step as u32;
            let mut level = Vec::new();
            for &from in &levels[step - 1] {
                for &to in graph.neighbours(from).iter().chain([&from]) {
                    if to_go[to as usize] <= left && !level.contains(&to) && allows(from, to, step) {
                        level.push(to);
                    }
                }
            }
            levels.push(level);
        }
        for step in (0..cost as usize).rev() {
            let (before, after) = levels.split_at_mut(step + 1);
            let leads = |&from: &Vertex| {
                let mut targets = graph.neighbours(from).iter().chain([&from]);
                targets.any(|&to| after[0].contains(&to) && allows(from, to, step + 1))
            };
            before[step].retain(leads);
        }
        Self { levels }
    }

    /// Returns the memory of the MDD. Units: bytes.
    pub(crate) fn num_bytes(&self) -> usize {
        let level = |level: &Vec<Vertex>| size_of_val(level) + size_of_val(level.as_slice());
        self.levels.iter().map(level).sum()
    }

    /// Returns whether every optimal path is at a vertex after a step; with `from`, whether every optimal path makes
    /// that move in the step.
    pub(crate) fn is_forced(&self, step: usize, from: Option<Vertex>, at: Vertex) -> bool {
        let is_only =
            |step: usize, vertex: Vertex| self.levels.get(step).is_none_or(|level| *level == [vertex]);
        is_only(step, at) && from.is_none_or(|from| is_only(step - 1, from))
    }
}
