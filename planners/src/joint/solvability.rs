//! The solvability of a small scenario, decided by joint A*.

use std::sync::Arc;

use pogema_core::{Cell, Error, Map, OnGoal};

use crate::bfs::UNREACHABLE;
use crate::budget::Budget;
use crate::distances::{CostToGo, Distances};
use crate::graph::{Graph, Vertex};
use crate::joint::astar::{Found, JointTask, search};

/// The solvability of a scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solvability {
    /// All agents can reach their goals. Unless they leave the map there ([`OnGoal::Finish`]), they can also all be at
    /// their goals at the same time.
    Solvable {
        /// The least sum of costs. Units: steps, summed over all agents.
        sum_of_costs: u64,
    },
    /// No plan brings all agents to their goals.
    Unsolvable,
    /// The limit on joint states was exceeded, a step has too many combinations of moves, or there are more than 32
    /// agents.
    Unknown,
}

impl Solvability {
    /// Returns whether the scenario is solvable, if the search could decide it.
    pub fn is_solvable(self) -> Option<bool> {
        match self {
            Self::Solvable { .. } => Some(true),
            Self::Unsolvable => Some(false),
            Self::Unknown => None,
        }
    }
}

/// Decides whether a scenario is solvable, and finds its least sum of costs.
///
/// Agents move as under `soft`, which allows every move that another collision system allows. With [`OnGoal::Finish`],
/// an agent leaves the map when it ends a step on its goal. At most `max_states` joint states are generated.
///
/// # Errors
/// [`Error::Length`] if the numbers of starts and goals differ; [`Error::Agent`] for a start or goal that is not a free
/// cell.
///
/// Rule: collide/soft, goal/finish/leave
pub fn solvability(
    map: &Map,
    starts: &[Cell],
    goals: &[Cell],
    on_goal: OnGoal,
    max_states: usize,
) -> Result<Solvability, Error> {
    Error::check_length("goals", starts.len(), goals.len())?;
    let graph = Arc::new(Graph::new(map));
    let starts = graph.vertices_of("start", starts)?;
    let goals = graph.vertices_of("goal", goals)?;
    let costs = Distances::new(graph.clone(), usize::MAX).to_all(&goals);
    let is_unreachable = |(&start, costs): (&Vertex, &CostToGo)| costs[start as usize] == UNREACHABLE;
    if starts.iter().zip(&costs).any(is_unreachable) {
        return Ok(Solvability::Unsolvable);
    }
    let leaves = on_goal == OnGoal::Finish;
    let task = JointTask { graph: &graph, starts: &starts, goals: &goals, costs: &costs, leaves, max_states };
    Ok(match search(&task, &mut Budget::default().start()) {
        Found::Paths(paths) => {
            Solvability::Solvable { sum_of_costs: paths.iter().map(|path| path.len() as u64 - 1).sum() }
        }
        Found::Nothing => Solvability::Unsolvable,
        Found::Unknown => Solvability::Unknown,
    })
}
