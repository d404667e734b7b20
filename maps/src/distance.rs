//! Shortest-path distances between cells.

use std::collections::VecDeque;

use pogema_core::{Action, Cell, Map};

/// Returns the distance from each cell to a goal, row by row; [`u32::MAX`] for cells without a path. Units: steps.
pub fn distances_to(map: &Map, goal: Cell) -> Vec<u32> {
    let mut distances = vec![u32::MAX; map.obstacles().len()];
    if map.is_obstacle(goal) {
        return distances;
    }
    distances[map.index(goal)] = 0;
    let mut frontier = VecDeque::from([goal]);
    while let Some(cell) = frontier.pop_front() {
        let distance = distances[map.index(cell)] + 1;
        for next in free_neighbours(map, cell) {
            let known = &mut distances[map.index(next)];
            if *known == u32::MAX {
                *known = distance;
                frontier.push_back(next);
            }
        }
    }
    distances
}

/// Returns the free cells above, below, left and right of a cell.
pub fn free_neighbours(map: &Map, cell: Cell) -> impl Iterator<Item = Cell> + '_ {
    let targets = Action::MOVES.into_iter().filter_map(move |action| Cell::checked(cell.toward(action)));
    targets.filter(|&target| !map.is_obstacle(target))
}
