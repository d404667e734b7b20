//! Tests of the search and of the memory of the agents.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use pogema_core::{Action, Cell, GoalStream, Instance, Map, Occupancy, Outside, State};
use proptest::prelude::*;

use super::place::{Place, distance, toward};
use super::planner::{Plan, ReplanVersion, Replanner};
use super::search::{Query, Search};
use ReplanVersion::{Cpp, Python};

const RIGHT_DOWN_UP_LEFT: [Action; 4] = [Action::Right, Action::Down, Action::Up, Action::Left];

fn step(start: Place, goal: Place, best_move: bool, is_blocked: impl Fn(Place) -> bool) -> Option<Place> {
    Search::default().first_step(Query { start, goal, moves: RIGHT_DOWN_UP_LEFT, best_move }, is_blocked)
}

/// Creates an instance from the start and the goal of each agent.
fn instance(rows: &[&str], agents: &[([u16; 2], [u16; 2])]) -> Instance {
    let starts = agents.iter().map(|&(start, _)| start.into()).collect();
    let goals = agents.iter().map(|&(_, goal)| GoalStream::single(goal.into())).collect();
    Instance::new(Map::from_rows(rows).unwrap(), Outside::Free, starts, goals).unwrap()
}

/// The plans of agents at given cells, with fixed goals.
struct Walk {
    planner: Replanner,
    goals: Vec<Cell>,
    step: u64,
}

impl Walk {
    fn begin(version: ReplanVersion, rows: &[&str], sight: usize, agents: &[([u16; 2], [u16; 2])]) -> Self {
        let instance = instance(rows, agents);
        let planner = Replanner::begin(version, &instance, Occupancy::Exact, sight);
        Self { planner, goals: agents.iter().map(|&(_, goal)| goal.into()).collect(), step: 0 }
    }

    fn plan(&mut self, cells: &[[u16; 2]]) -> Vec<Plan> {
        let cells: Vec<Cell> = cells.iter().map(|&cell| cell.into()).collect();
        let (active, on_goal) = (vec![true; cells.len()], vec![false; cells.len()]);
        self.step += 1;
        self.planner.plan(State {
            step: self.step,
            cells: &cells,
            goals: &self.goals,
            active: &active,
            on_goal: &on_goal,
        })
    }

    /// Plans for the first agent alone.
    fn plan_one(&mut self, cell: [u16; 2]) -> Plan {
        self.plan(&[cell])[0]
    }
}

#[test]
fn equal_paths_follow_the_order_of_rows_and_moves() {
    // Both neighbours have equal costs; the one with the smaller row index is expanded first.
    assert_eq!(step((0, 0), (2, 2), false, |_| false), Some((0, 1)));
    assert_eq!(step((2, 2), (0, 0), false, |_| false), Some((1, 2)));
    assert_eq!(step((0, 0), (0, -3), false, |_| false), Some((0, -1)));
    // The grid has no bounds.
    assert_eq!(step((0, 0), (0, 4), false, |(row, col)| col == 2 && row.abs() < 3), Some((0, 1)));
}

#[test]
fn without_a_path_there_is_no_move_or_a_move_towards_the_nearest_cell() {
    let is_wall = |(row, col): Place| row.abs().max(col.abs()) == 3;
    assert_eq!(step((0, 0), (0, 9), false, is_wall), None);
    assert_eq!(step((0, 0), (0, 9), true, is_wall), Some((0, 1)));
    // The start is the nearest cell.
    assert_eq!(step((0, 2), (0, 9), true, is_wall), None);
    // The goal is occupied, and infinitely many free cells surround it.
    assert_eq!(step((0, 0), (5, 0), false, |place| place == (5, 0)), None);
    assert_eq!(step((0, 0), (5, 0), true, |place| place == (5, 0)), Some((1, 0)));
}

/// The search with a heap and a map of parents.
fn plain_first_step(query: Query, is_blocked: impl Fn(Place) -> bool) -> Option<Place> {
    let Query { start, goal, moves, best_move } = query;
    let mut heap = BinaryHeap::from([Reverse((distance(start, goal), 0, start))]);
    let mut parents = HashMap::from([(start, start)]);
    let mut best = (distance(start, goal), start);
    for _ in 0..10_000 {
        let Some(Reverse((_, cost, place))) = heap.pop() else { break };
        let left = distance(place, goal);
        if left < best.0 {
            best = (left, place);
        }
        if left == 0 {
            break;
        }
        for next in moves.map(|action| toward(place, action)) {
            if !parents.contains_key(&next) && !is_blocked(next) {
                parents.insert(next, place);
                heap.push(Reverse((cost + 1 + distance(next, goal), cost + 1, next)));
            }
        }
    }
    let (left, mut end) = best;
    if end == start || !(left == 0 || best_move) {
        return None;
    }
    while parents[&end] != start {
        end = parents[&end];
    }
    Some(end)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]
    #[test]
    fn searches_equal_those_with_a_heap(
        obstacles in proptest::collection::vec(proptest::bool::weighted(0.35), 400),
        ends in [(-2..22, -2..22), (-2..22, -2..22)],
        has_walls in any::<bool>(),
        best_move in any::<bool>(),
        version in 0..2_usize,
    ) {
        let is_blocked = |(row, col): Place| {
            if (0..20).contains(&row) && (0..20).contains(&col) {
                return obstacles[(20 * row + col) as usize];
            }
            // With walls, most goals outside are out of reach, and some searches leave through a gap.
            has_walls && (row, col) != (7, 20) && row.min(col) >= -1 && row.max(col) <= 20
        };
        let moves = [RIGHT_DOWN_UP_LEFT, Action::MOVES];
        let query = Query { start: ends[0], goal: ends[1], moves: moves[version], best_move };
        // The second search reuses the memory of the first.
        let mut search = Search::default();
        for query in [query, Query { start: query.goal, goal: query.start, ..query }] {
            prop_assert_eq!(search.first_step(query, is_blocked), plain_first_step(query, is_blocked));
        }
    }
}

#[test]
fn searches_far_from_the_start_equal_those_with_a_heap() {
    // A corridor of two rows leads beyond the cells that have a bit in the set of reached cells.
    let is_blocked = |(row, col): Place| !(0..2).contains(&row) || (row == 1 && col % 7 == 0);
    for goal in [(0, 900), (1, -700), (1, 700), (5, 300)] {
        let query = Query { start: (0, 3), goal, moves: RIGHT_DOWN_UP_LEFT, best_move: true };
        let step = Search::default().first_step(query, is_blocked);
        assert_eq!(step, plain_first_step(query, is_blocked), "{goal:?}");
        assert!(step.is_some());
    }
}

#[test]
fn agents_know_the_obstacles_that_they_have_seen() {
    let rows = ["......", "..##..", "......"];
    let mut walk = Walk::begin(Cpp, &rows, 1, &[([1, 0], [1, 5])]);
    // The obstacles are out of sight.
    assert_eq!(walk.plan_one([1, 0]), Plan::Move(Action::Right));
    // Both detours are equally long; the cell with the smaller row index is expanded first.
    assert_eq!(walk.plan_one([1, 1]), Plan::Move(Action::Up));
    assert_eq!(walk.plan_one([0, 1]), Plan::Move(Action::Right));
    assert_eq!(walk.plan_one([0, 2]), Plan::Move(Action::Right));
    assert_eq!(walk.plan_one([0, 3]), Plan::Move(Action::Right));
    // On the goal there is no move.
    assert_eq!(walk.plan_one([1, 5]), Plan::None);
}

#[test]
fn agents_in_sight_are_obstacles_for_one_step() {
    let row = [".........."];
    let mut walk = Walk::begin(Cpp, &row, 2, &[([0, 0], [0, 4]), ([0, 3], [0, 5])]);
    // The other agent is on the path, but out of sight.
    assert_eq!(walk.plan(&[[0, 0], [0, 3]])[0], Plan::Move(Action::Right));
    let open = ["......", "......"];
    let mut walk = Walk::begin(Cpp, &open, 2, &[([0, 0], [0, 4]), ([0, 1], [1, 1])]);
    assert_eq!(walk.plan(&[[0, 0], [0, 1]])[0], Plan::Move(Action::Down));
    assert_eq!(walk.plan(&[[0, 0], [1, 1]])[0], Plan::Move(Action::Right));
    // A goal under an agent is out of reach.
    assert_eq!(walk.plan(&[[0, 2], [0, 4]])[0], Plan::None);
    assert_eq!(walk.plan(&[[0, 1], [0, 4]])[0], Plan::Move(Action::Right));
}

#[test]
fn a_cell_that_was_not_reached_is_avoided_while_the_agent_waits() {
    let rows = ["....", "...."];
    let mut walk = Walk::begin(Cpp, &rows, 3, &[([0, 0], [0, 3])]);
    assert_eq!(walk.plan_one([0, 0]), Plan::Move(Action::Right));
    // The agent was pushed back; now it goes around.
    assert_eq!(walk.plan_one([0, 0]), Plan::Move(Action::Down));
    // It did not reach this cell either.
    assert_eq!(walk.plan_one([0, 0]), Plan::None);
    // After a step without a plan, the failed cells are cleared.
    assert_eq!(walk.plan_one([0, 0]), Plan::Move(Action::Right));
}

#[test]
fn moves_back_to_the_last_two_cells_are_marked() {
    let mut walk = Walk::begin(Cpp, &["....."], 1, &[([0, 1], [0, 4])]);
    assert_eq!(walk.plan_one([0, 1]), Plan::Move(Action::Right));
    // With only one earlier cell, the move back is not marked yet.
    assert_eq!(walk.plan_one([0, 0]), Plan::Move(Action::Right));
    assert_eq!(walk.plan_one([0, 0]), Plan::None, "the only way failed");
    assert_eq!(walk.plan_one([0, 0]), Plan::Return(Action::Right));
    assert_eq!(walk.plan_one([0, 1]), Plan::Move(Action::Right));
}

#[test]
fn the_versions_differ_in_order_and_best_move() {
    let rows = ["...", "...", "..."];
    let goals = [([0, 0], [2, 2])];
    let blocked = ["..#", ".#.", "#.."];
    for (version, expected) in [(Cpp, Plan::None), (Python, Plan::Move(Action::Right))] {
        assert_eq!(Walk::begin(version, &rows, 1, &goals).plan_one([0, 0]), Plan::Move(Action::Right));
        let mut walk = Walk::begin(version, &blocked, 3, &goals);
        assert_eq!(walk.plan_one([0, 0]), expected, "{version:?}");
    }
}
