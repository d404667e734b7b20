//! Maps of obstacles.

use serde::{Deserialize, Serialize};

use crate::{Cell, Error, counted};

/// The obstacles of a rectangular map, without any border.
///
/// Shape: `[height, width]`, row-major.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "Vec<String>", into = "Vec<String>")]
pub struct Map {
    height: usize,
    width: usize,
    obstacles: Vec<bool>,
}

impl Map {
    /// Longest side of a map: the largest 16-bit number minus the widest border on both sides.
    pub const LONGEST_SIDE: usize = (u16::MAX as usize) - 2 * crate::Config::LARGEST_RADIUS;

    /// Creates a map from its obstacles in row-major order.
    ///
    /// # Errors
    /// [`Error::Instance`] for an empty map or a side over [`Map::LONGEST_SIDE`], [`Error::Length`] for a wrong number
    /// of cells.
    pub fn new(height: usize, width: usize, obstacles: Vec<bool>) -> Result<Self, Error> {
        if height == 0 || width == 0 {
            return Err(Error::instance("the map has no cells"));
        }
        check_sides(height, width)?;
        Error::check_length("obstacles", height * width, obstacles.len())?;
        Ok(Self { height, width, obstacles })
    }

    /// Creates a map from lines of `.` (free) and `#` (obstacle).
    ///
    /// # Errors
    /// [`Error::Map`] with line and column for any other character or a line of another length. Also the errors of
    /// [`Map::new`].
    pub fn from_rows<S: AsRef<str>>(rows: &[S]) -> Result<Self, Error> {
        let width = rows.first().map_or(0, |row| row.as_ref().chars().count());
        check_sides(rows.len(), width)?;
        // Reserves no memory in advance: 200 kB of text with one long row and many short ones would claim billions of
        // cells.
        let mut obstacles = Vec::new();
        for (index, row) in rows.iter().enumerate() {
            for (column, character) in row.as_ref().chars().enumerate() {
                match character {
                    '.' => obstacles.push(false),
                    '#' => obstacles.push(true),
                    other => {
                        let reason = format!("`{other}` is not `.` or `#`");
                        return Err(Error::Map { line: index + 1, column: column + 1, reason });
                    }
                }
            }
            check_row_length(index, row.as_ref().chars().count(), width)?;
        }
        Self::new(rows.len(), width, obstacles)
    }

    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Returns the number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the numbers of rows and columns.
    pub fn sides(&self) -> (usize, usize) {
        (self.height, self.width)
    }

    /// Returns one flag per cell in row-major order: true for an obstacle.
    pub fn obstacles(&self) -> &[bool] {
        &self.obstacles
    }

    /// Returns whether a cell lies on the map.
    pub fn contains(&self, cell: Cell) -> bool {
        cell.is_within(self.height, self.width)
    }

    /// Returns whether a cell holds an obstacle; every cell outside the map does.
    pub fn is_obstacle(&self, cell: Cell) -> bool {
        !self.contains(cell) || self.obstacles[self.index(cell)]
    }

    /// Removes the obstacle from a cell and returns whether there was one.
    pub fn clear(&mut self, cell: Cell) -> bool {
        if !self.contains(cell) {
            return false;
        }
        let index = self.index(cell);
        std::mem::replace(&mut self.obstacles[index], false)
    }

    /// Returns the number of free cells.
    pub fn num_free(&self) -> usize {
        self.obstacles.iter().filter(|&&obstacle| !obstacle).count()
    }

    /// Returns the free cells, row by row.
    pub fn free_cells(&self) -> impl Iterator<Item = Cell> {
        let free = self.obstacles.iter().enumerate().filter(|(_, obstacle)| !**obstacle);
        free.map(|(index, _)| self.cell_at(index))
    }

    /// Returns the index in [`Map::obstacles`] of a cell of the map.
    pub fn index(&self, cell: Cell) -> usize {
        usize::from(cell.row) * self.width + usize::from(cell.col)
    }

    /// Returns the cell at an index of [`Map::obstacles`].
    pub fn cell_at(&self, index: usize) -> Cell {
        Cell::new((index / self.width) as u16, (index % self.width) as u16)
    }

    /// Returns the map as lines of `.` and `#`.
    pub fn rows(&self) -> Vec<String> {
        let line = |row: &[bool]| row.iter().map(|&obstacle| if obstacle { '#' } else { '.' }).collect();
        self.obstacles.chunks(self.width).map(line).collect()
    }
}

fn check_sides(height: usize, width: usize) -> Result<(), Error> {
    let longest = Map::LONGEST_SIDE;
    if height.max(width) <= longest {
        return Ok(());
    }
    Err(Error::instance(format!("the map has {height} x {width} cells, expected at most {longest} per side")))
}

/// Checks that row `index` is as long as the first row.
///
/// # Errors
/// [`Error::Map`] at the first missing or surplus cell of the row.
pub fn check_row_length(index: usize, length: usize, width: usize) -> Result<(), Error> {
    if length == width {
        return Ok(());
    }
    Err(Error::Map { line: index + 1, column: length.min(width) + 1, reason: uneven_row(length, width) })
}

/// Returns the reason of the error for a row whose length differs from that of the first row.
pub fn uneven_row(length: usize, width: usize) -> String {
    format!("the row has {}, expected {width} as in the first row", counted(length, "cell"))
}

impl TryFrom<Vec<String>> for Map {
    type Error = Error;

    fn try_from(rows: Vec<String>) -> Result<Self, Error> {
        Self::from_rows(&rows)
    }
}

impl From<Map> for Vec<String> {
    fn from(map: Map) -> Self {
        map.rows()
    }
}
