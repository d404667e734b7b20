//! Breadth-first search over a whole map, as quick as can be: a wall stands for the list of neighbours.

use crate::distances::UNREACHABLE;
use crate::graph::{Graph, Vertex};

/// A map with a wall around it, and the room that a search takes.
#[derive(Debug)]
pub(crate) struct Flood {
    width: usize,
    /// Where each vertex is, row by row, the wall included.
    places: Vec<u32>,
    /// [`UNREACHABLE`] in every free place, which a search takes for "not yet reached".
    blank: Vec<u32>,
    costs: Vec<u32>,
    front: Vec<u32>,
    next: Vec<u32>,
}

impl Flood {
    /// For a graph.
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
        Self { width, places, blank, costs: Vec::new(), front: Vec::new(), next: Vec::new() }
    }

    /// Steps to a goal from each vertex, or [`UNREACHABLE`].
    pub fn costs_to_go(&mut self, goal: Vertex) -> impl Iterator<Item = u32> + '_ {
        self.costs.clone_from(&self.blank);
        let start = self.places[goal as usize];
        self.costs[start as usize] = 0;
        self.front.clear();
        self.front.push(start);
        let mut cost = 0;
        while !self.front.is_empty() {
            cost += 1;
            for &place in &self.front {
                let place = place as usize;
                for neighbour in [place - self.width, place + self.width, place - 1, place + 1] {
                    if self.costs[neighbour] == UNREACHABLE {
                        self.costs[neighbour] = cost;
                        self.next.push(neighbour as u32);
                    }
                }
            }
            self.front.clear();
            std::mem::swap(&mut self.front, &mut self.next);
        }
        self.places.iter().map(|&place| self.costs[place as usize])
    }
}
