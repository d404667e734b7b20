//! The graph of a map: one vertex for each free cell.

use pogema_core::{Action, Cell, Error, Map};

/// The index of a free cell, in row-major order.
pub type Vertex = u32;

/// The free cells of a map and their neighbours.
///
/// No edge leads off the map.
#[derive(Debug)]
pub struct Graph {
    width: usize,
    cells: Vec<Cell>,
    /// The vertex of each cell of the map in row-major order, or `NO_VERTEX`.
    vertices: Vec<Vertex>,
    /// The neighbours of each vertex in the order up, down, left, right, padded with `NO_VERTEX`.
    neighbours: Vec<[Vertex; 4]>,
    degrees: Vec<u8>,
}

/// The entry of an obstacle, and the padding of neighbours.
const NO_VERTEX: Vertex = Vertex::MAX;

impl Graph {
    /// Builds the graph of a map.
    pub fn new(map: &Map) -> Self {
        let mut vertices = vec![NO_VERTEX; map.height() * map.width()];
        let mut cells = Vec::with_capacity(map.num_free());
        for (index, vertex) in vertices.iter_mut().enumerate() {
            let cell = map.cell_at(index);
            if !map.is_obstacle(cell) {
                *vertex = cells.len() as Vertex;
                cells.push(cell);
            }
        }
        let mut graph =
            Self { width: map.width(), cells, vertices, neighbours: Vec::new(), degrees: Vec::new() };
        for &cell in &graph.cells {
            let (mut around, mut degree) = ([NO_VERTEX; 4], 0);
            for action in Action::MOVES {
                if let Some(neighbour) = step_from(map, cell, action).and_then(|cell| graph.vertex(cell)) {
                    around[degree] = neighbour;
                    degree += 1;
                }
            }
            graph.neighbours.push(around);
            graph.degrees.push(degree as u8);
        }
        graph
    }

    /// Returns the number of free cells.
    pub fn num_vertices(&self) -> usize {
        self.cells.len()
    }

    /// Returns the vertex of a cell, if the cell is free.
    pub fn vertex(&self, cell: Cell) -> Option<Vertex> {
        if usize::from(cell.col) >= self.width {
            return None;
        }
        let index = usize::from(cell.row) * self.width + usize::from(cell.col);
        self.vertices.get(index).copied().filter(|&vertex| vertex != NO_VERTEX)
    }

    /// Returns the cell of a vertex.
    pub fn cell(&self, vertex: Vertex) -> Cell {
        self.cells[vertex as usize]
    }

    /// Returns the neighbours of a vertex, without the vertex itself, in the order up, down, left, right.
    pub fn neighbours(&self, vertex: Vertex) -> &[Vertex] {
        &self.neighbours[vertex as usize][..usize::from(self.degrees[vertex as usize])]
    }

    /// Returns the action that leads from a vertex to itself or to a neighbour.
    pub fn action(&self, from: Vertex, to: Vertex) -> Action {
        self.cell(from).action_to(self.cell(to)).unwrap_or(Action::Stay)
    }

    /// Converts one cell per agent to vertices; `what` names the cells in the error.
    ///
    /// # Errors
    /// [`Error::Agent`] for a cell off the map or on an obstacle.
    pub fn vertices_of(&self, what: &str, cells: &[Cell]) -> Result<Vec<Vertex>, Error> {
        cells.iter().enumerate().map(|(agent, &cell)| self.vertex_of(agent, what, cell)).collect()
    }

    /// Converts a cell of an agent to a vertex; `what` names the cell in the error.
    ///
    /// # Errors
    /// [`Error::Agent`] for a cell off the map or on an obstacle.
    pub fn vertex_of(&self, agent: usize, what: &str, cell: Cell) -> Result<Vertex, Error> {
        let error = || Error::agent(agent, format!("{what} {cell} is not a free cell of the map"));
        self.vertex(cell).ok_or_else(error)
    }
}

/// Returns the cell that an action leads to, unless it is off the map.
pub(crate) fn step_from(map: &Map, cell: Cell, action: Action) -> Option<Cell> {
    Cell::checked(cell.toward(action)).filter(|&cell| map.contains(cell))
}
