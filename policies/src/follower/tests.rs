//! Compares the planner with a second, simple implementation of the same search.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::{HashMap, VecDeque};
use std::sync::atomic::AtomicBool;

use pogema_core::{Action, Cell, Map, Occupancy, State};
use pogema_numpy::Generator;
use proptest::prelude::*;

use super::{FollowerPlanner, FollowerVersion};
use crate::grid::{Layout, Marks};

/// Row and column on the map.
type Place = (i32, i32);

fn place(cell: Cell) -> Place {
    (i32::from(cell.row), i32::from(cell.col))
}

/// Right, down, up, left.
fn around((row, col): Place) -> [Place; 4] {
    [(row, col + 1), (row + 1, col), (row - 1, col), (row, col - 1)]
}

/// An element of the queue.
#[derive(Clone, Copy)]
struct Element {
    at: Place,
    g: f32,
    h: f32,
    f: f32,
}

fn comes_after(a: Element, b: Element) -> bool {
    if a.f > b.f {
        return true;
    }
    let difference = (f64::from(a.f) - f64::from(b.f)).abs();
    difference < 1e-5 && a.g > b.g
}

fn push(heap: &mut Vec<Element>, element: Element) {
    heap.push(element);
    let mut at = heap.len() - 1;
    while at > 0 && comes_after(heap[(at - 1) / 2], element) {
        heap.swap(at, (at - 1) / 2);
        at = (at - 1) / 2;
    }
}

fn pop(heap: &mut Vec<Element>) -> Element {
    let root = heap[0];
    let last = heap.pop().unwrap();
    if heap.is_empty() {
        return root;
    }
    let mut hole = 0;
    loop {
        let children: Vec<usize> =
            [2 * hole + 1, 2 * hole + 2].into_iter().filter(|&it| it < heap.len()).collect();
        let next = match children[..] {
            [] => break,
            [only] => only,
            [left, right] => {
                if comes_after(heap[right], heap[left]) {
                    left
                } else {
                    right
                }
            }
            _ => unreachable!(),
        };
        heap[hole] = heap[next];
        hole = next;
    }
    heap[hole] = last;
    while hole > 0 && comes_after(heap[(hole - 1) / 2], last) {
        heap.swap(hole, (hole - 1) / 2);
        hole = (hole - 1) / 2;
    }
    root
}

/// The plain planner.
struct Plain {
    free: Vec<Place>,
    costs: HashMap<Place, f32>,
    goals: Vec<Option<Cell>>,
    heuristics: Vec<HashMap<Place, f32>>,
    dynamic: Vec<HashMap<Place, f32>>,
}

impl Plain {
    fn new(map: &Map, num_agents: usize) -> Self {
        let cells = (0..map.height() * map.width()).map(|index| map.cell_at(index));
        let free: Vec<Place> = cells.filter(|&cell| !map.is_obstacle(cell)).map(place).collect();
        let means: Vec<f32> = free.iter().map(|&from| mean_distance(&free, from)).collect();
        let mut largest = f32::NAN;
        for &mean in &means {
            largest = if largest.is_nan() || mean > largest { mean } else { largest };
        }
        let costs = free.iter().zip(means).map(|(&at, mean)| (at, largest / mean)).collect();
        let none = || vec![HashMap::new(); num_agents];
        Self { free, costs, goals: vec![None; num_agents], heuristics: none(), dynamic: none() }
    }

    fn path(&mut self, agent: usize, cells: &[Cell], goal: Cell, sight: i32) -> Vec<Place> {
        if self.goals[agent] != Some(goal) {
            self.goals[agent] = Some(goal);
            self.dynamic[agent].clear();
            self.heuristics[agent] = self.heuristic(place(goal));
        }
        let (start, goal) = (place(cells[agent]), place(goal));
        for &other in cells {
            let (row, col) = place(other);
            let is_seen = (row - start.0).abs() <= sight && (col - start.1).abs() <= sight;
            if is_seen && (row, col) != start {
                *self.dynamic[agent].entry((row, col)).or_insert(0.0) += 1.0;
            }
        }
        self.search(agent, start, goal)
    }

    fn heuristic(&self, goal: Place) -> HashMap<Place, f32> {
        let (mut known, mut heap) = (HashMap::from([(goal, 0.0_f32)]), Vec::new());
        push(&mut heap, Element { at: goal, g: 0.0, h: 0.0, f: 0.0 });
        while !heap.is_empty() {
            let from = pop(&mut heap);
            for next in around(from.at).into_iter().filter(|next| self.costs.contains_key(next)) {
                let g = from.g + self.costs[&next];
                if known.get(&next).is_none_or(|&known| known > g) {
                    known.insert(next, g);
                    push(&mut heap, Element { at: next, g, h: 0.0, f: g });
                }
            }
        }
        known
    }

    fn search(&self, agent: usize, start: Place, goal: Place) -> Vec<Place> {
        let h = |at: &Place| self.heuristics[agent].get(at).copied().unwrap_or(f32::INFINITY);
        let (mut best, mut parents) = (HashMap::new(), HashMap::new());
        let mut heap = Vec::new();
        push(&mut heap, Element { at: start, g: 0.0, h: h(&start), f: h(&start) });
        let mut last = start;
        let mut is_first = true;
        while !heap.is_empty() && (is_first || last != goal) {
            is_first = false;
            let from = pop(&mut heap);
            last = from.at;
            if best.get(&from.at).copied().unwrap_or(1e9_f32) < from.g {
                continue;
            }
            for next in around(from.at).into_iter().filter(|next| self.costs.contains_key(next)) {
                let cost = self.costs[&next] + self.dynamic[agent].get(&next).copied().unwrap_or(0.0);
                let g = from.g + cost;
                if best.get(&next).copied().unwrap_or(1e9) > g {
                    best.insert(next, g);
                    parents.insert(next, from.at);
                    let element = Element { at: next, g, h: h(&next), f: g + h(&next) };
                    assert!(element.h >= 0.0);
                    push(&mut heap, element);
                }
            }
        }
        if start == goal || !parents.contains_key(&goal) {
            return Vec::new();
        }
        let mut path = vec![goal];
        while path.last() != Some(&start) {
            path.push(parents[path.last().unwrap()]);
        }
        path.reverse();
        path
    }
}

fn mean_distance(free: &[Place], from: Place) -> f32 {
    let (mut known, mut queue) = (HashMap::from([(from, 0)]), VecDeque::from([from]));
    while let Some(at) = queue.pop_front() {
        for next in around(at) {
            if free.contains(&next) && !known.contains_key(&next) {
                known.insert(next, known[&at] + 1);
                queue.push_back(next);
            }
        }
    }
    known.values().sum::<i32>() as f32 / (known.len() - 1) as f32
}

/// Draws the next cells and goals: some agents move to a free neighbour, and some get another goal.
fn advance(generator: &mut Generator, map: &Map, cells: &mut [Cell], goals: &mut [Cell], free: &[Place]) {
    let mut draw = |high: usize| generator.integers(0, high as i64).unwrap() as usize;
    for agent in 0..cells.len() {
        let next = Cell::checked(cells[agent].toward(Action::ALL[draw(5)]));
        if let Some(next) = next.filter(|next| !map.is_obstacle(*next) && !cells.contains(next)) {
            cells[agent] = next;
        }
        if draw(8) == 0 {
            let (row, col) = free[draw(free.len())];
            goals[agent] = Cell::new(row as u16, col as u16);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn paths_are_those_of_the_plain_search(
        height in 1_usize..13,
        width in 2_usize..13,
        density in 0_i64..45,
        num_agents in 1_usize..9,
        sight in 1_usize..6,
        seed in any::<u64>(),
    ) {
        let mut generator = Generator::seeded(seed);
        let mut draw = |high: i64| generator.integers(0, high).unwrap();
        let obstacles = (0..height * width).map(|_| draw(100) < density).collect();
        let map = Map::new(height, width, obstacles).unwrap();
        let mut plain = Plain::new(&map, num_agents);
        prop_assume!(plain.free.len() >= num_agents);
        let free = plain.free.clone();
        let cell = |(row, col): Place| Cell::new(row as u16, col as u16);
        let mut cells: Vec<Cell> = free.iter().copied().map(cell).collect();
        generator.shuffle(&mut cells);
        let mut goals = cells.clone();
        generator.shuffle(&mut goals);
        cells.truncate(num_agents);
        goals.truncate(num_agents);
        let layout = Layout::new(&map, sight);
        let present = Marks::new(layout, Occupancy::Exact);
        let mut planner = FollowerPlanner::new(layout, &map, sight, FollowerVersion::Cpp, 1 << 20);
        planner.begin(num_agents, present);
        let (active, on_goal) = (vec![true; num_agents], vec![false; num_agents]);
        let stop = AtomicBool::new(false);
        for step in 0..12 {
            let state = State { step, cells: &cells, goals: &goals, active: &active, on_goal: &on_goal };
            prop_assert_eq!(planner.plan(state, &stop), Ok(()));
            for agent in 0..num_agents {
                let found: Vec<usize> = planner.path(agent, layout.place(cells[agent])).collect();
                let expected = plain.path(agent, &cells, goals[agent], sight as i32);
                let expected: Vec<usize> = expected.into_iter().map(|at| layout.place(cell(at))).collect();
                prop_assert_eq!(found, expected, "agent {} in step {}", agent, step);
            }
            advance(&mut generator, &map, &mut cells, &mut goals, &free);
        }
    }
}

#[test]
fn on_its_goal_an_agent_keeps_its_path_only_in_the_python_version() {
    let map = Map::from_rows(&["....."]).unwrap();
    let layout = Layout::new(&map, 5);
    let (active, on_goal) = ([true], [false]);
    for (version, expected) in [(FollowerVersion::Cpp, 0), (FollowerVersion::Python, 1)] {
        let present = Marks::new(layout, Occupancy::Exact);
        let mut planner = FollowerPlanner::new(layout, &map, 5, version, 1 << 20);
        planner.begin(1, present);
        for (step, col) in [(0, 3), (1, 4)] {
            let cells = [Cell::new(0, col)];
            let goals = [Cell::new(0, 4)];
            let state = State { step, cells: &cells, goals: &goals, active: &active, on_goal: &on_goal };
            planner.plan(state, &AtomicBool::new(false)).unwrap();
        }
        assert_eq!(planner.path(0, layout.place(Cell::new(0, 4))).count(), expected, "{version:?}");
    }
}
