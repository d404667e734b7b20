//! The grid: a map with its border.

use pogema_core::{Cell, Instance, Outside};

/// One flag per cell of the map and of its border, which is as wide as the radius.
///
/// Rows and columns are counted from the top left corner of the map, so those of the border above and to the left are
/// negative.
#[derive(Clone, Debug, Default)]
pub struct Grid {
    border: i32,
    rows: Vec<Vec<bool>>,
}

impl Grid {
    /// Creates a grid with all flags unset.
    pub fn empty(height: usize, width: usize, radius: usize) -> Self {
        let rows = vec![vec![false; width + 2 * radius]; height + 2 * radius];
        Self { border: radius as i32, rows }
    }

    /// Returns the flag at (row, col).
    pub fn get(&self, (row, col): (i32, i32)) -> bool {
        self.rows[(row + self.border) as usize][(col + self.border) as usize]
    }

    /// Sets the flag at (row, col).
    pub fn set(&mut self, (row, col): (i32, i32), flag: bool) {
        self.rows[(row + self.border) as usize][(col + self.border) as usize] = flag;
    }

    /// Returns all flags, border included, from the top left corner of the border.
    pub fn rows(&self) -> &[Vec<bool>] {
        &self.rows
    }
}

/// Returns (row, col) of a cell, signed.
pub fn place(cell: Cell) -> (i32, i32) {
    (i32::from(cell.row), i32::from(cell.col))
}

/// Returns the obstacles of an instance with its border.
///
/// Writes the outside first, then the wall, then the map.
///
/// Rule: border/ring, border/outside, border/noise
///
/// Source: POGEMA 1.4.0, `grid.py`, `Grid.add_artificial_border`
pub fn obstacles_with_border(instance: &Instance, radius: usize) -> Grid {
    let (height, width) = (instance.map().height(), instance.map().width());
    let mut grid = Grid::empty(height, width, radius);
    if let Outside::Noise(noise) = instance.outside() {
        for (row, cells) in grid.rows.iter_mut().zip(noise.obstacles().chunks(noise.width())) {
            row.copy_from_slice(cells);
        }
    }
    let (bottom, right) = (height as i32, width as i32);
    for col in -1..=right {
        grid.set((-1, col), true);
        grid.set((bottom, col), true);
    }
    for row in -1..=bottom {
        grid.set((row, -1), true);
        grid.set((row, right), true);
    }
    for (index, &obstacle) in instance.map().obstacles().iter().enumerate() {
        grid.set(place(instance.map().cell_at(index)), obstacle);
    }
    grid
}
