//! Ways that keep apart: each agent's, chosen so that it crosses few of the others', for PIBT to follow first.
//!
//! Paper: Okumura, "Engineering LaCAM*: Towards Real-Time, Large-Scale, and Near-Optimal Multi-Agent Pathfinding",
//! AAMAS 2024, where they are found by a search of their own; here by that of [`crate::sipp`] for few conflicts.
//!
//! | here | there |
//! | --- | --- |
//! | `ROUNDS`, `SLACK` | until nothing is gained; the cost margin |
//! | `Hints` | the paths, by which vertices are preferred |

use crate::conflict::one_leg_each;
use crate::distances::CostToGo;
use crate::graph::Vertex;
use crate::problem::{Clock, Problem};
use crate::reservations::Reservations;
use crate::sipp::{Horizon, Order, Sipp, Task, Way};
use crate::stepper::Agent;

/// Times that every way is chosen anew.
const ROUNDS: usize = 4;

/// Steps that a way may take more than the shortest.
const SLACK: u32 = 10;

/// Where agents would rather go from where they are; by default nowhere.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hints {
    /// For each agent, the moves of its way, by where they begin.
    moves: Vec<Vec<(Vertex, Vertex)>>,
}

impl Hints {
    /// Where an agent's way leads on from a vertex, if it comes there.
    #[inline]
    pub fn next(&self, agent: Agent, from: Vertex) -> Option<Vertex> {
        let moves = self.moves.get(agent as usize)?;
        let at = moves.binary_search_by_key(&from, |&(from, _)| from).ok()?;
        Some(moves[at].1)
    }

    fn of(ways: &[Vec<Vertex>]) -> Self {
        let moves = |way: &Vec<Vertex>| {
            let steps = way.windows(2).filter(|step| step[0] != step[1]);
            let mut moves: Vec<(Vertex, Vertex)> = steps.map(|step| (step[0], step[1])).collect();
            // Where it passes twice, what it does last counts: it then goes on to its goal.
            moves.reverse();
            moves.sort_by_key(|&(from, _)| from);
            moves.dedup_by_key(|&mut (from, _)| from);
            moves
        };
        Self { moves: ways.iter().map(moves).collect() }
    }
}

/// Ways that keep apart, as far as there is time to look for them.
pub(crate) fn scatter(problem: &Problem, costs: &[CostToGo], clock: &mut Clock) -> Hints {
    let legs = one_leg_each(costs);
    let mut sipp = Sipp::new(problem.graph.clone());
    let (nobody, mut others) =
        (Reservations::new(problem.graph.num_vertices()), Reservations::new(problem.graph.num_vertices()));
    let mut ways: Vec<Vec<Vertex>> = vec![Vec::new(); problem.num_agents()];
    let mut least = u32::MAX;
    for _ in 0..ROUNDS {
        let mut num_conflicts: u32 = 0;
        for agent in 0..problem.num_agents() {
            if clock.count_node() {
                return Hints::of(&ways);
            }
            others.remove(agent, &ways[agent], true);
            let shortest = costs[agent][problem.starts[agent] as usize];
            let task = Task {
                start: problem.starts[agent],
                legs: &legs[agent],
                reserved: &nobody,
                avoided: Some(&others),
                banned: &[],
                horizon: Horizon::Stay { at_most: shortest + SLACK },
                order: Order::Conflicts { at_most: shortest + SLACK },
                salt: agent as u32,
            };
            if let Some(Way { path, conflicts, .. }) = sipp.find(&task) {
                ways[agent] = path;
                num_conflicts += conflicts;
            }
            others.add(agent, &ways[agent], true);
        }
        if num_conflicts >= least {
            break;
        }
        least = num_conflicts;
    }
    Hints::of(&ways)
}
