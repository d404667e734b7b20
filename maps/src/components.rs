//! Connected components of free cells.

use pogema_core::{Cell, Map};

/// The 4-connected components of the free cells of a map.
///
/// Rule: place/components
///
/// Source: POGEMA 1.4.0, `generator.py`, `bfs`
#[derive(Clone, Debug)]
pub struct Components {
    width: usize,
    /// Component of each cell, row by row; [`Components::NONE`] for obstacles.
    labels: Vec<u32>,
    sizes: Vec<u32>,
}

impl Components {
    const NONE: u32 = u32::MAX;

    /// Labels the components of a map.
    pub fn of(map: &Map) -> Self {
        let mut components =
            Self { width: map.width(), labels: vec![Self::NONE; map.obstacles().len()], sizes: vec![] };
        let mut frontier = Vec::new();
        for start in 0..map.obstacles().len() {
            if !map.obstacles()[start] && components.labels[start] == Self::NONE {
                components.flood(map, start, &mut frontier);
            }
        }
        components
    }

    fn flood(&mut self, map: &Map, start: usize, frontier: &mut Vec<usize>) {
        let label = self.sizes.len() as u32;
        let (width, num_cells) = (map.width(), map.obstacles().len());
        let mut size = 0;
        self.labels[start] = label;
        frontier.push(start);
        while let Some(at) = frontier.pop() {
            size += 1;
            let col = at % width;
            let neighbours = [
                (at >= width).then(|| at - width),
                (at + width < num_cells).then_some(at + width),
                (col > 0).then(|| at - 1),
                (col + 1 < width).then_some(at + 1),
            ];
            for next in neighbours.into_iter().flatten() {
                if !map.obstacles()[next] && self.labels[next] == Self::NONE {
                    self.labels[next] = label;
                    frontier.push(next);
                }
            }
        }
        self.sizes.push(size);
    }

    /// Returns the number of components.
    pub fn len(&self) -> usize {
        self.sizes.len()
    }

    /// Returns whether the map has no free cell.
    pub fn is_empty(&self) -> bool {
        self.sizes.is_empty()
    }

    /// Returns the number of cells of each component.
    pub fn sizes(&self) -> &[u32] {
        &self.sizes
    }

    /// Returns the component of the cell at a row-major index; `None` for an obstacle.
    pub fn label_at(&self, index: usize) -> Option<u32> {
        self.labels.get(index).copied().filter(|&label| label != Self::NONE)
    }

    /// Returns the component of a cell; `None` for an obstacle.
    pub fn label(&self, cell: Cell) -> Option<u32> {
        self.label_at(usize::from(cell.row) * self.width + usize::from(cell.col))
    }

    /// Returns the cells of each component, row by row.
    pub fn cells(&self) -> ComponentCells {
        let mut offsets = Vec::with_capacity(self.sizes.len() + 1);
        let mut total = 0;
        offsets.push(0);
        for &size in &self.sizes {
            total += size as usize;
            offsets.push(total);
        }
        let mut next = offsets.clone();
        let mut cells = vec![Cell::new(0, 0); total];
        for (index, &label) in self.labels.iter().enumerate() {
            if label != Self::NONE {
                let place = &mut next[label as usize];
                cells[*place] = Cell::new((index / self.width) as u16, (index % self.width) as u16);
                *place += 1;
            }
        }
        ComponentCells { offsets, cells }
    }
}

/// The cells of each component, row by row.
#[derive(Clone, Debug)]
pub struct ComponentCells {
    offsets: Vec<usize>,
    cells: Vec<Cell>,
}

impl ComponentCells {
    /// Returns the cells of one component.
    pub fn of(&self, label: u32) -> &[Cell] {
        &self.cells[self.offsets[label as usize]..self.offsets[label as usize + 1]]
    }
}
