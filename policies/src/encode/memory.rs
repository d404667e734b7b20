//! The obstacles that each agent has seen in its episode.

use crate::grid::Layout;

/// A square memory of obstacles around the start of an agent. It grows when a window reaches beyond its edge.
#[derive(Clone, Debug)]
pub(crate) struct Memory {
    side: usize,
    /// 1 for an obstacle that was seen, row by row.
    cells: Vec<f32>,
}

/// Position of a cell relative to the start of its agent, (rows, columns).
pub(crate) type Offset = (isize, isize);

impl Memory {
    /// Side of a new memory.
    const SIDE: usize = 65;

    pub fn new() -> Self {
        Self { side: Self::SIDE, cells: vec![0.0; Self::SIDE * Self::SIDE] }
    }

    /// Adds the obstacles of the window around a place.
    pub fn see(&mut self, layout: Layout, obstacles: &[f32], place: usize, at: Offset, radius: usize) {
        self.reach(at, radius);
        let side = 2 * radius + 1;
        let first = self.index(at, radius);
        for (row, seen) in layout.window_rows(place, radius).enumerate() {
            let known = &mut self.cells[first + row * self.side..][..side];
            known.copy_from_slice(&obstacles[seen..seen + side]);
        }
    }

    /// Copies the window around an offset.
    pub fn copy_window(&mut self, at: Offset, out: &mut [f32]) {
        let side = out.len().isqrt();
        self.reach(at, side / 2);
        let first = self.index(at, side / 2);
        for (row, out) in out.chunks_exact_mut(side).enumerate() {
            out.copy_from_slice(&self.cells[first + row * self.side..][..side]);
        }
    }

    /// Returns the index of the top left cell of a window.
    fn index(&self, (row, col): Offset, radius: usize) -> usize {
        let corner = (self.side / 2) as isize - radius as isize;
        ((row + corner) * self.side as isize + col + corner) as usize
    }

    /// Grows until a window fits: from side s to 2s + 1, with the known cells in the middle.
    fn reach(&mut self, (row, col): Offset, radius: usize) {
        let farthest = row.unsigned_abs().max(col.unsigned_abs()) + radius;
        while farthest > self.side / 2 {
            let (old, side) = (self.side, 2 * self.side + 1);
            let corner = side / 2 - old / 2;
            let mut cells = vec![0.0; side * side];
            for (row, known) in self.cells.chunks_exact(old).enumerate() {
                cells[(row + corner) * side + corner..][..old].copy_from_slice(known);
            }
            *self = Self { side, cells };
        }
    }
}
