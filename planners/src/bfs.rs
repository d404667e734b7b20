//! Breadth-first search from a goal over the whole map.
//!
//! A wall of marked places around the map replaces the bounds check, so the search reads no neighbour lists.

use crate::graph::{Graph, Vertex};

/// The cost to go of a vertex from which no path leads to the goal.
pub const UNREACHABLE: u32 = u32::MAX;

/// A map with a wall around it, and the memory of its searches.
#[derive(Debug)]
pub struct Bfs {
    width: usize,
    /// For each vertex, its place in the walled map, row by row.
    places: Vec<u32>,
    /// [`UNREACHABLE`] in every free place, which means "not yet reached" during a search.
    blank: Vec<u32>,
    costs: Vec<u32>,
    frontier: Vec<u32>,
    next: Vec<u32>,
}

impl Bfs {
    /// Prepares searches of a graph.
    pub fn new(graph: &Graph) -> Self {
        let cells = || (0..graph.num_vertices() as Vertex).map(|vertex| graph.cell(vertex));
        let last = |of: fn(pogema_core::Cell) -> u16| cells().map(of).max().map_or(0, usize::from);
        let (height, width) = (last(|cell| cell.row) + 3, last(|cell| cell.col) + 3);
        let place = |cell: pogema_core::Cell| (usize::from(cell.row) + 1) * width + usize::from(cell.col) + 1;
        let places: Vec<u32> = cells().map(|cell| place(cell) as u32).collect();
        let mut blank = vec![0; height * width];
        for &place in &places {
            blank[place as usize] = UNREACHABLE;
        }
        Self { width, places, blank, costs: Vec::new(), frontier: Vec::new(), next: Vec::new() }
    }

    /// Returns the steps from each vertex to a goal, or [`UNREACHABLE`].
    ///
    /// # Panics
    /// If the goal is not a vertex of the graph.
    pub fn costs_to_go(&mut self, goal: Vertex) -> impl Iterator<Item = u32> + '_ {
        self.costs.clone_from(&self.blank);
        let start = self.places[goal as usize];
        self.costs[start as usize] = 0;
        self.frontier.clear();
        self.frontier.push(start);
        let mut cost = 0;
        while !self.frontier.is_empty() {
            cost += 1;
            for &place in &self.frontier {
                let place = place as usize;
                for neighbour in [place - self.width, place + self.width, place - 1, place + 1] {
                    if self.costs[neighbour] == UNREACHABLE {
                        self.costs[neighbour] = cost;
                        self.next.push(neighbour as u32);
                    }
                }
            }
            self.frontier.clear();
            std::mem::swap(&mut self.frontier, &mut self.next);
        }
        self.places.iter().map(|&place| self.costs[place as usize])
    }
}
