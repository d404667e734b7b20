//! The truth about small instances: a search through all joint states.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use pogema_core::{Cell, Map, OnGoal};

use crate::distance::{distances_to, free_neighbours};

/// What a search through all joint states found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// All agents can reach their goals, and with [`OnGoal::Nothing`] be there all at once.
    Solvable {
        /// The least sum over all agents of the steps until they are there to stay.
        sum_of_costs: u64,
    },
    /// They cannot, whatever they do.
    Unsolvable,
    /// There were more states to look at than allowed.
    Unknown,
}

/// Looks for a solution of least sum of costs, so that none is missed.
///
/// Agents move as under `soft`: into any cell but an obstacle, one agent to a cell, no two in each other's place;
/// whatever they can do under the other collision systems is among that. With [`OnGoal::Finish`] an agent leaves the
/// map on its goal. At most `most_states` states are looked at.
///
/// Rule: collide/soft, goal/finish/leave
pub fn search(map: &Map, starts: &[Cell], goals: &[Cell], on_goal: OnGoal, most_states: usize) -> Verdict {
    let Some(mut search) = Search::new(map, starts, goals, on_goal, most_states) else {
        return Verdict::Unknown;
    };
    search.run()
}

/// Cells of all agents, and which of them are done: at their goals to stay, or gone.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
struct State {
    cells: Vec<u32>,
    done: u32,
}

struct Search<'a> {
    map: &'a Map,
    goals: Vec<u32>,
    leaves: bool,
    most_states: usize,
    /// For each agent, the steps from each cell to its goal.
    distances: Vec<Vec<u32>>,
    /// The least cost known of each state.
    costs: HashMap<State, u64>,
    queue: BinaryHeap<Reverse<(u64, Reverse<u64>, State)>>,
}

impl<'a> Search<'a> {
    /// None for more agents than a set of them has bits.
    fn new(
        map: &'a Map,
        starts: &[Cell],
        goals: &[Cell],
        on_goal: OnGoal,
        most_states: usize,
    ) -> Option<Self> {
        (starts.len() <= u32::BITS as usize).then_some(())?;
        let index = |cell: &Cell| map.index(*cell) as u32;
        let mut search = Self {
            map,
            goals: goals.iter().map(index).collect(),
            leaves: on_goal == OnGoal::Finish,
            most_states,
            distances: goals.iter().map(|&goal| distances_to(map, goal)).collect(),
            costs: HashMap::new(),
            queue: BinaryHeap::new(),
        };
        // An agent that starts on its goal does not leave before a step.
        search.reach(State { cells: starts.iter().map(index).collect(), done: 0 }, 0, false);
        Some(search)
    }

    fn run(&mut self) -> Verdict {
        while let Some(Reverse((_, Reverse(cost), state))) = self.queue.pop() {
            if self.costs.get(&state).is_some_and(|&known| known < cost) {
                continue;
            }
            let num_agents = state.cells.len();
            let waiting = num_agents as u64 - u64::from(state.done.count_ones());
            if waiting == 0 {
                return Verdict::Solvable { sum_of_costs: cost };
            }
            if self.costs.len() > self.most_states {
                return Verdict::Unknown;
            }
            let mut moved = state.cells.clone();
            self.move_agents(&state, 0, &mut moved, cost + waiting);
        }
        Verdict::Unsolvable
    }

    /// Chooses a move for an agent and those after it.
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

    /// The cell itself and its free neighbours.
    fn targets(&self, cell: u32) -> Vec<u32> {
        let at = self.map.cell_at(cell as usize);
        let neighbours = free_neighbours(self.map, at).map(|next| self.map.index(next) as u32);
        std::iter::once(cell).chain(neighbours).collect()
    }

    /// Whether the agents before this one, and those that are done, leave a cell to it.
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

    /// Takes a state in, and those in which agents on their goals are done.
    fn reach(&mut self, state: State, cost: u64, has_moved: bool) {
        let on_goal = (0..state.cells.len()).filter(|&agent| state.cells[agent] == self.goals[agent]);
        let arrived = on_goal.fold(0, |arrived, agent| arrived | 1 << agent) & !state.done;
        if self.leaves {
            let done = if has_moved { state.done | arrived } else { state.done };
            return self.take(State { done, ..state }, cost);
        }
        // Every set of those that arrived may be there to stay.
        let mut staying = arrived;
        loop {
            self.take(State { cells: state.cells.clone(), done: state.done | staying }, cost);
            if staying == 0 {
                return;
            }
            staying = (staying - 1) & arrived;
        }
    }

    fn take(&mut self, state: State, cost: u64) {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(rows: &[&str], agents: &[[(u16, u16); 2]], on_goal: OnGoal) -> Verdict {
        let map = Map::from_rows(rows).unwrap_or_else(|_| unreachable!("a map"));
        let cell = |(row, col): (u16, u16)| Cell::new(row, col);
        let starts: Vec<Cell> = agents.iter().map(|[start, _]| cell(*start)).collect();
        let goals: Vec<Cell> = agents.iter().map(|[_, goal]| cell(*goal)).collect();
        search(&map, &starts, &goals, on_goal, 1_000_000)
    }

    #[test]
    fn two_in_a_corridor_cannot_pass_unless_one_leaves() {
        let crossing = [[(0, 0), (0, 4)], [(0, 4), (0, 0)]];
        assert_eq!(verdict(&["....."], &crossing, OnGoal::Nothing), Verdict::Unsolvable);
        assert_eq!(verdict(&["....."], &crossing, OnGoal::Finish), Verdict::Unsolvable);
        // The second is gone before the first comes by.
        let behind = [[(0, 0), (0, 4)], [(0, 2), (0, 1)]];
        assert_eq!(verdict(&["....."], &behind, OnGoal::Nothing), Verdict::Unsolvable);
        assert_eq!(verdict(&["....."], &behind, OnGoal::Finish), Verdict::Solvable { sum_of_costs: 6 });
    }

    #[test]
    fn a_bay_costs_what_it_takes_to_let_pass() {
        let crossing = [[(0, 0), (0, 4)], [(0, 4), (0, 0)]];
        let bay = [".....", "##.##"];
        // One goes into the bay and out again.
        assert_eq!(verdict(&bay, &crossing, OnGoal::Nothing), Verdict::Solvable { sum_of_costs: 11 });
    }

    #[test]
    fn a_full_ring_turns_and_two_do_not_swap() {
        let ring = [[(0, 0), (0, 1)], [(0, 1), (1, 1)], [(1, 1), (1, 0)], [(1, 0), (0, 0)]];
        assert_eq!(verdict(&["..", ".."], &ring, OnGoal::Nothing), Verdict::Solvable { sum_of_costs: 4 });
        let pair = [[(0, 0), (0, 1)], [(0, 1), (0, 0)]];
        assert_eq!(verdict(&[".."], &pair, OnGoal::Nothing), Verdict::Unsolvable);
        assert_eq!(verdict(&[".."], &pair, OnGoal::Finish), Verdict::Unsolvable);
    }

    #[test]
    fn an_agent_may_have_to_leave_its_goal_for_another() {
        // The second starts on its goal, lets the first one pass and comes right back.
        let blocked = [[(0, 0), (0, 2)], [(0, 1), (0, 1)]];
        assert_eq!(
            verdict(&["...", "#.#"], &blocked, OnGoal::Nothing),
            Verdict::Solvable { sum_of_costs: 4 }
        );
    }

    #[test]
    fn a_search_that_is_too_large_says_so() {
        let rows = ["........"; 8];
        let agents: Vec<[(u16, u16); 2]> = (0..6).map(|at| [(0, at), (7, 7 - at)]).collect();
        let map = Map::from_rows(&rows).unwrap_or_else(|_| unreachable!("a map"));
        let cells = |at: usize| -> Vec<Cell> {
            agents.iter().map(|ends| Cell::new(ends[at].0, ends[at].1)).collect()
        };
        assert_eq!(search(&map, &cells(0), &cells(1), OnGoal::Nothing, 1000), Verdict::Unknown);
    }
}
