//! Statistics of maps and of scenarios on them, computed without playing an episode.

use std::collections::BTreeMap;

use pogema_core::{Cell, Map, OnGoal};

use crate::components::Components;
use crate::distance::{distances_to, free_neighbours};

/// Statistics of a map.
#[derive(Clone, Debug, PartialEq)]
pub struct MapStats {
    /// Number of rows.
    pub height: usize,
    /// Number of columns.
    pub width: usize,
    /// Number of free cells.
    pub num_free: usize,
    /// Share of obstacles among all cells.
    pub density: f64,
    /// The sizes of all components, largest first. Units: cells.
    pub components: Vec<u32>,
    /// Number of free cells with exactly one free neighbour.
    pub dead_ends: usize,
    /// Number of free cells with exactly two free neighbours.
    pub corridor: usize,
    /// Number of pairs of free cells without a path between them.
    pub unreachable_pairs: u64,
}

impl MapStats {
    /// Computes the statistics of a map.
    pub fn of(map: &Map) -> Self {
        let num_cells = map.obstacles().len();
        let num_free = map.num_free();
        let mut components = Components::of(map).sizes().to_vec();
        components.sort_unstable_by(|one, other| other.cmp(one));
        let (mut dead_ends, mut corridor) = (0, 0);
        for cell in map.free_cells() {
            match free_neighbours(map, cell).count() {
                1 => dead_ends += 1,
                2 => corridor += 1,
                _ => {}
            }
        }
        let same: u64 = components.iter().map(|&size| u64::from(size) * u64::from(size)).sum();
        Self {
            height: map.height(),
            width: map.width(),
            num_free,
            density: (num_cells - num_free) as f64 / num_cells as f64,
            components,
            dead_ends,
            corridor,
            unreachable_pairs: (num_free as u64 * num_free as u64 - same) / 2,
        }
    }

    /// Returns the share of corridor cells among the free cells.
    pub fn corridor_share(&self) -> f64 {
        if self.num_free == 0 { 0.0 } else { self.corridor as f64 / self.num_free as f64 }
    }
}

/// A reason why a scenario cannot be solved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Infeasibility {
    /// This agent has no path from its start to its goal.
    NoPath(usize),
    /// These agents share a goal, on which all of them have to stay.
    SameGoal(Vec<usize>, Cell),
    /// These agents share a component, and a search through their joint states finds no solution.
    Locked(Vec<usize>),
    /// These agents share a corridor that none can leave, and their goals are in another order than their starts.
    WrongOrder(Vec<usize>),
}

/// Statistics of a scenario.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScenarioStats {
    /// Number of agents.
    pub num_agents: usize,
    /// The reasons why the scenario cannot be solved. An empty list proves nothing.
    pub infeasibilities: Vec<Infeasibility>,
    /// Whether every part of the scenario is proven solvable.
    pub is_proven_solvable: bool,
    /// Sum of the distances from start to goal over all agents that can reach their goals; a lower bound on the cost of
    /// a solution. Units: steps.
    pub sum_of_distances: u64,
    /// The longest of these distances. Units: steps.
    pub longest_distance: u32,
}

impl ScenarioStats {
    /// Maximum number of joint states of a component that is passed to the joint search.
    pub const MAX_STATES: usize = 200_000;

    /// Computes the statistics of starts and goals on a map.
    ///
    /// `is_solvable` decides small components by a search through their joint states; it returns `None` if it cannot
    /// decide.
    pub fn of(
        map: &Map,
        starts: &[Cell],
        goals: &[Cell],
        on_goal: OnGoal,
        mut is_solvable: impl FnMut(&ScenarioPart) -> Option<bool>,
    ) -> Self {
        let components = Components::of(map);
        let mut figures = Self {
            num_agents: starts.len(),
            infeasibilities: Vec::new(),
            is_proven_solvable: true,
            sum_of_distances: 0,
            longest_distance: 0,
        };
        let mut crowds: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        let mut by_goal: BTreeMap<Cell, Vec<usize>> = BTreeMap::new();
        for (agent, (&start, &goal)) in starts.iter().zip(goals).enumerate() {
            by_goal.entry(goal).or_default().push(agent);
            match (components.label(start), components.label(goal)) {
                (Some(one), Some(other)) if one == other => {
                    let distance = distances_to(map, goal)[map.index(start)];
                    figures.sum_of_distances += u64::from(distance);
                    figures.longest_distance = figures.longest_distance.max(distance);
                    crowds.entry(one).or_default().push(agent);
                }
                _ => figures.infeasibilities.push(Infeasibility::NoPath(agent)),
            }
        }
        if on_goal == OnGoal::Nothing {
            let shared = by_goal.into_iter().filter(|(_, agents)| agents.len() > 1);
            figures
                .infeasibilities
                .extend(shared.map(|(goal, agents)| Infeasibility::SameGoal(agents, goal)));
        }
        for (label, agents) in crowds {
            let part = part_of(map, &components, label, (starts, goals), &agents);
            figures.judge_part(&part, agents, on_goal, &mut is_solvable);
        }
        figures.is_proven_solvable &= figures.infeasibilities.is_empty();
        figures
    }

    fn judge_part(
        &mut self,
        part: &ScenarioPart,
        agents: Vec<usize>,
        on_goal: OnGoal,
        is_solvable: &mut impl FnMut(&ScenarioPart) -> Option<bool>,
    ) {
        if on_goal == OnGoal::Nothing && part.is_in_wrong_order() {
            self.infeasibilities.push(Infeasibility::WrongOrder(agents));
            return;
        }
        if agents.len() == 1 {
            return;
        }
        if !part.is_small() {
            self.is_proven_solvable = false;
            return;
        }
        match is_solvable(part) {
            Some(true) => {}
            Some(false) => self.infeasibilities.push(Infeasibility::Locked(agents)),
            None => self.is_proven_solvable = false,
        }
    }
}

/// One component of a map and the agents in it.
#[derive(Clone, Debug)]
pub struct ScenarioPart {
    /// The bounding box of the component; all other cells are obstacles.
    pub map: Map,
    /// The starts of the agents.
    pub starts: Vec<Cell>,
    /// The goals of the agents.
    pub goals: Vec<Cell>,
}

fn part_of(
    map: &Map,
    components: &Components,
    label: u32,
    (starts, goals): (&[Cell], &[Cell]),
    agents: &[usize],
) -> ScenarioPart {
    let inside: Vec<Cell> = (0..map.obstacles().len())
        .filter(|&index| components.label_at(index) == Some(label))
        .map(|index| map.cell_at(index))
        .collect();
    let span = |of: fn(&Cell) -> u16| {
        let (least, most) = (inside.iter().map(of).min(), inside.iter().map(of).max());
        (least.unwrap_or(0), most.unwrap_or(0))
    };
    let ((top, bottom), (left, right)) = (span(|cell| cell.row), span(|cell| cell.col));
    let (height, width) = (usize::from(bottom - top) + 1, usize::from(right - left) + 1);
    let moved = |cell: &Cell| Cell::new(cell.row - top, cell.col - left);
    let mut obstacles = vec![true; height * width];
    for cell in inside.iter().map(moved) {
        obstacles[usize::from(cell.row) * width + usize::from(cell.col)] = false;
    }
    // INVARIANT: no larger than the whole map, and with at least one cell.
    let part = Map::new(height, width, obstacles).unwrap_or_else(|_| map.clone());
    let of = |cells: &[Cell]| agents.iter().map(|&agent| moved(&cells[agent])).collect();
    ScenarioPart { map: part, starts: of(starts), goals: of(goals) }
}

impl ScenarioPart {
    /// Returns whether the number of joint states is within the limit.
    fn is_small(&self) -> bool {
        let num_free = self.map.num_free();
        let orders = (0..self.starts.len()).map(|agent| num_free.saturating_sub(agent));
        // The factor 2: each agent has finished or not.
        let states = orders.fold(1_usize, |states, choices| states.saturating_mul(2 * choices));
        states <= ScenarioStats::MAX_STATES
    }

    /// Returns whether the part is one corridor along which starts and goals are in different orders.
    fn is_in_wrong_order(&self) -> bool {
        let Some(path) = self.corridor() else { return false };
        let place = |cell: &Cell| path.iter().position(|other| other == cell);
        let mut agents: Vec<usize> = (0..self.starts.len()).collect();
        agents.sort_by_key(|&agent| place(&self.starts[agent]));
        !agents.is_sorted_by_key(|&agent| place(&self.goals[agent]))
    }

    /// Returns all cells from one end to the other if the part is a single corridor.
    fn corridor(&self) -> Option<Vec<Cell>> {
        let free: Vec<Cell> = self.map.free_cells().collect();
        let num_neighbours = |cell: Cell| free_neighbours(&self.map, cell).count();
        let first = *free.iter().find(|&&cell| num_neighbours(cell) <= 1)?;
        if free.iter().any(|&cell| num_neighbours(cell) > 2) {
            return None;
        }
        let distances = distances_to(&self.map, first);
        let mut path = free;
        path.sort_by_key(|&cell| distances[self.map.index(cell)]);
        Some(path)
    }
}
