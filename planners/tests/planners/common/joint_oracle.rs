//! The oracle of small scenarios: a search through all joint states, independent of the planners.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use pogema_core::{Cell, Map, OnGoal};
use pogema_maps::{distances_to, free_neighbours};
use pogema_planners::Solvability;

/// Finds the least sum of costs of a scenario.
///
/// Agents move as under `soft`. With [`OnGoal::Finish`], an agent leaves the map on its goal. The search gives up once
/// it knows more than `max_states` states.
pub fn oracle(map: &Map, starts: &[Cell], goals: &[Cell], on_goal: OnGoal, max_states: usize) -> Solvability {
    let Some(mut search) = Search::new(map, starts, goals, on_goal, max_states) else {
        return Solvability::Unknown;
    };
    search.run()
}

/// The cells of all agents, and the set of agents that are done: resting on their goals, or gone.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
struct State {
    cells: Vec<u32>,
    done: u32,
}

struct Search<'a> {
    map: &'a Map,
    goals: Vec<u32>,
    leaves: bool,
    max_states: usize,
    /// For each agent, the steps from each cell to its goal.
    distances: Vec<Vec<u32>>,
    /// The least known cost of each state.
    costs: HashMap<State, u64>,
    queue: BinaryHeap<Reverse<(u64, Reverse<u64>, State)>>,
}

impl<'a> Search<'a> {
    /// Creates the search. Returns `None` if the number of agents exceeds the number of bits in the set of done agents.
    fn new(
        map: &'a Map,
        starts: &[Cell],
        goals: &[Cell],
        on_goal: OnGoal,
        max_states: usize,
    ) -> Option<Self> {
        (starts.len() <= u32::BITS as usize).then_some(())?;
        let index = |cell: &Cell| map.index(*cell) as u32;
        let mut search = Self {
            map,
            goals: goals.iter().map(index).collect(),
            leaves: on_goal == OnGoal::Finish,
            max_states,
            distances: goals.iter().map(|&goal| distances_to(map, goal)).collect(),
            costs: HashMap::new(),
            queue: BinaryHeap::new(),
        };
        // An agent that starts on its goal does not leave before the first step.
        search.reach(State { cells: starts.iter().map(index).collect(), done: 0 }, 0, false);
        Some(search)
    }

    fn run(&mut self) -> Solvability {
        while let Some(Reverse((_, Reverse(cost), state))) = self.queue.pop() {
            if self.costs.get(&state).is_some_and(|&known| known < cost) {
                continue;
            }
            let num_agents = state.cells.len();
            let waiting = num_agents as u64 - u64::from(state.done.count_ones());
            if waiting == 0 {
                return Solvability::Solvable { sum_of_costs: cost };
            }
            if self.costs.len() > self.max_states {
                return Solvability::Unknown;
            }
            let mut moved = state.cells.clone();
            self.move_agents(&state, 0, &mut moved, cost + waiting);
        }
        Solvability::Unsolvable
    }

    /// Assigns moves to an agent and to those after it.
    fn move_agents(&mut self, from: &State, agent: usize, to: &mut Vec<u32>, cost: u64) {
        if agent == to.len() {
            let next = State { cells: to.clone(), done: from.done };
            return self.reach(next, cost, true);
        }
        if from.done >> agent & 1 == 1 {
            return self.move_agents(from, agent + 1, to, cost);
        }
        for target in self.targets(from.cells[agent]) {
            if self.is_open(from, agent, to, target) {
                to[agent] = target;
                self.move_agents(from, agent + 1, to, cost);
            }
        }
        to[agent] = from.cells[agent];
    }

    /// Returns a cell and its free neighbours.
    fn targets(&self, cell: u32) -> Vec<u32> {
        let at = self.map.cell_at(cell as usize);
        let neighbours = free_neighbours(self.map, at).map(|next| self.map.index(next) as u32);
        std::iter::once(cell).chain(neighbours).collect()
    }

    /// Returns whether a cell is free for an agent, given the moves of earlier agents and the agents that are done.
    fn is_open(&self, from: &State, agent: usize, to: &[u32], target: u32) -> bool {
        (0..to.len()).filter(|&other| other != agent).all(|other| {
            let is_done = from.done >> other & 1 == 1;
            if is_done {
                return self.leaves || from.cells[other] != target;
            }
            let has_chosen = other < agent;
            let swaps = from.cells[other] == target && to[other] == from.cells[agent];
            !has_chosen || (to[other] != target && !swaps)
        })
    }

    /// Adds a state in which the agents that arrived are done. If agents stay on the map, adds one for each set of them
    /// that may rest.
    fn reach(&mut self, state: State, cost: u64, has_moved: bool) {
        let on_goal = (0..state.cells.len()).filter(|&agent| state.cells[agent] == self.goals[agent]);
        let arrived = on_goal.fold(0, |arrived, agent| arrived | 1 << agent) & !state.done;
        if self.leaves {
            let done = if has_moved { state.done | arrived } else { state.done };
            return self.add(State { done, ..state }, cost);
        }
        // Any subset of the arrived agents may rest.
        let mut staying = arrived;
        loop {
            self.add(State { cells: state.cells.clone(), done: state.done | staying }, cost);
            if staying == 0 {
                return;
            }
            staying = (staying - 1) & arrived;
        }
    }

    fn add(&mut self, state: State, cost: u64) {
        let mut bound = cost;
        for (agent, &cell) in state.cells.iter().enumerate() {
            if state.done >> agent & 1 == 0 {
                let distance = self.distances[agent][cell as usize];
                if distance == u32::MAX {
                    return;
                }
                bound += u64::from(distance);
            }
        }
        if self.costs.get(&state).is_none_or(|&known| cost < known) {
            self.costs.insert(state.clone(), cost);
            self.queue.push(Reverse((bound, Reverse(cost), state)));
        }
    }
}
