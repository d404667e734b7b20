//! Conflict detection among the paths of all agents.

use std::ops::ControlFlow;

use crate::graph::Vertex;
use crate::paths::{PathConflict, Paths};

/// Returns all conflicts, the earliest first.
pub(crate) fn all_conflicts(paths: &Paths, num_vertices: usize) -> Vec<PathConflict> {
    let mut found = Vec::new();
    let _ = for_each_conflict(paths, num_vertices, |conflict| {
        found.push(conflict);
        ControlFlow::Continue(())
    });
    found
}

/// Returns the earliest conflict.
pub(crate) fn first_conflict(paths: &Paths, num_vertices: usize) -> Option<PathConflict> {
    for_each_conflict(paths, num_vertices, ControlFlow::Break).break_value()
}

/// Visits the conflicts step by step until `visit` breaks.
fn for_each_conflict(
    paths: &Paths,
    num_vertices: usize,
    mut visit: impl FnMut(PathConflict) -> ControlFlow<PathConflict>,
) -> ControlFlow<PathConflict> {
    let agents = 0..paths.num_agents();
    let (mut before, mut now) =
        (Occupancy::new(num_vertices, agents.len()), Occupancy::new(num_vertices, agents.len()));
    for step in 0..=paths.num_steps() {
        for agent in agents.clone() {
            let Some(at) = paths.at(agent, step) else { continue };
            for other in now.at(at) {
                visit(PathConflict { agents: (other, agent), step, from: None, at })?;
            }
            now.enter(agent, at);
            let Some(from) = step.checked_sub(1).and_then(|before| paths.at(agent, before)) else { continue };
            // Only agents with a lower index are considered, so each swap is visited once.
            for other in before.at(at).filter(|&other| other < agent && from != at) {
                if paths.at(other, step) == Some(from) {
                    visit(PathConflict { agents: (other, agent), step, from: Some(at), at: from })?;
                }
            }
        }
        std::mem::swap(&mut before, &mut now);
        now.clear();
    }
    ControlFlow::Continue(())
}

/// The agents on each vertex at one step.
struct Occupancy {
    /// For each vertex, the agent that entered last.
    last: Vec<u32>,
    /// For each agent, the agent that entered the same vertex before it.
    earlier: Vec<u32>,
    taken: Vec<Vertex>,
}

impl Occupancy {
    const NO_AGENT: u32 = u32::MAX;

    fn new(num_vertices: usize, num_agents: usize) -> Self {
        let empty = |count| vec![Self::NO_AGENT; count];
        Self { last: empty(num_vertices), earlier: empty(num_agents), taken: Vec::new() }
    }

    fn enter(&mut self, agent: usize, at: Vertex) {
        self.earlier[agent] = std::mem::replace(&mut self.last[at as usize], agent as u32);
        self.taken.push(at);
    }

    fn at(&self, vertex: Vertex) -> impl Iterator<Item = usize> + '_ {
        let some = |agent: u32| (agent != Self::NO_AGENT).then_some(agent as usize);
        std::iter::successors(some(self.last[vertex as usize]), move |&agent| some(self.earlier[agent]))
    }

    fn clear(&mut self) {
        for vertex in self.taken.drain(..) {
            self.last[vertex as usize] = Self::NO_AGENT;
        }
    }
}
