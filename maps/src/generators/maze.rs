//! Generator of mazes whose walls tend to be straight.

use pogema_core::{Error, Map};

use super::{check_sides, draw_between, draw_share};
use pogema_numpy::Generator;

/// Maximum number of wall pieces, which bounds the run time.
const MAX_PIECES: f64 = 1e9;

/// The ranges from which the settings of a maze are drawn.
///
/// Source: pogema-toolbox 0.1.1, `maze_generator.py`, `MazeRangeSettings`
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "each is a bound of the setting in its name")]
pub struct MazeRanges {
    pub width_min: i64,
    pub width_max: i64,
    pub height_min: i64,
    pub height_max: i64,
    pub obstacle_density_min: f64,
    pub obstacle_density_max: f64,
    pub wall_components_min: i64,
    pub wall_components_max: i64,
    pub go_straight_min: f64,
    pub go_straight_max: f64,
}

impl Default for MazeRanges {
    fn default() -> Self {
        Self {
            width_min: 5,
            width_max: 9,
            height_min: 5,
            height_max: 9,
            obstacle_density_min: 0.0,
            obstacle_density_max: 1.0,
            wall_components_min: 1,
            wall_components_max: 8,
            go_straight_min: 0.75,
            go_straight_max: 0.85,
        }
    }
}

impl MazeRanges {
    /// Draws the settings of a maze from a seed.
    ///
    /// # Errors
    /// [`Error::Argument`] for a range that is empty or not finite, or a range of whole numbers that ends at
    /// [`i64::MAX`].
    ///
    /// Source: pogema-toolbox 0.1.1, `maze_generator.py`, `MazeRangeSettings.sample`
    pub fn sample(&self, seed: u64) -> Result<Maze, Error> {
        let mut generator = Generator::seeded(seed);
        let rng = &mut generator;
        let densities = (self.obstacle_density_min, self.obstacle_density_max);
        let components = (self.wall_components_min, self.wall_components_max);
        Ok(Maze {
            width: draw_between(rng, "width", (self.width_min, self.width_max))?,
            height: draw_between(rng, "height", (self.height_min, self.height_max))?,
            obstacle_density: draw_share(rng, "obstacle_density", densities)?,
            wall_components: draw_between(rng, "wall_components", components)?,
            go_straight: draw_share(rng, "go_straight", (self.go_straight_min, self.go_straight_max))?,
            seed,
        })
    }
}

/// The settings of one maze.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "each is the setting with its name")]
pub struct Maze {
    pub width: i64,
    pub height: i64,
    pub obstacle_density: f64,
    pub wall_components: i64,
    pub go_straight: f64,
    pub seed: u64,
}

impl Maze {
    /// Generates the map.
    ///
    /// Walls lie on even rows and columns of a grid with a ring around it, and the ring is then removed. A maze
    /// therefore has an odd number of rows and columns, one more than an even `width` or `height`.
    ///
    /// # Errors
    /// [`Error::Argument`] for a side, density or share out of range.
    ///
    /// Source: pogema-toolbox 0.1.1, `maze_generator.py`, `MazeGenerator.generate_maze`
    pub fn generate(&self) -> Result<Map, Error> {
        check_sides(self.width, self.height)?;
        let num_walls = self.num_walls()?;
        let mut grid = Grid::new(grid_side(self.height), grid_side(self.width));
        let mut generator = Generator::seeded(self.seed);
        for _ in 0..num_walls {
            grid.build_wall(self, &mut generator)?;
        }
        grid.inner_map()
    }

    fn num_walls(&self) -> Result<u64, Error> {
        if !self.obstacle_density.is_finite() {
            return Err(Error::argument("obstacle_density", self.obstacle_density, "a finite number"));
        }
        if self.wall_components == 0 {
            return Ok(0);
        }
        let num_cells = (grid_side(self.height) * grid_side(self.width)) as f64;
        let pieces = num_cells * self.obstacle_density;
        let num_walls = floor_divide(pieces, self.wall_components as f64);
        // A wall marks its first cell even if `wall_components` is negative.
        if pieces.max(num_walls) > MAX_PIECES {
            let expected = format!("a density with at most {MAX_PIECES:e} pieces of wall in the whole maze");
            return Err(Error::argument("obstacle_density", self.obstacle_density, expected));
        }
        // The cast turns negative numbers into zero, which means no wall.
        Ok(num_walls as u64)
    }
}

/// Returns the side of the grid, ring included.
fn grid_side(side: i64) -> usize {
    (side as usize / 2) * 2 + 3
}

/// Divides as Python's `//` does for floats: rounds down the exact quotient, not the rounded one.
fn floor_divide(dividend: f64, divisor: f64) -> f64 {
    let rest = dividend % divisor;
    let quotient = (dividend - rest) / divisor;
    let is_between = rest != 0.0 && (rest < 0.0) != (divisor < 0.0);
    (if is_between { quotient - 1.0 } else { quotient }).round()
}

/// A move of two cells along one axis, as (rows, cols). Before the first move, the last direction is (0, 0).
type Direction = (i64, i64);

struct Grid {
    height: i64,
    width: i64,
    walls: Vec<bool>,
}

impl Grid {
    fn new(height: usize, width: usize) -> Self {
        let on_ring = |row, col| row == 0 || row == height - 1 || col == 0 || col == width - 1;
        let cells = (0..height).flat_map(|row| (0..width).map(move |col| (row, col)));
        let walls = cells.map(|(row, col)| on_ring(row, col)).collect();
        Self { height: height as i64, width: width as i64, walls }
    }

    fn wall(&mut self, row: i64, col: i64) -> &mut bool {
        &mut self.walls[(row * self.width + col) as usize]
    }

    /// Builds a wall of up to `wall_components` pieces from a random cell.
    fn build_wall(&mut self, maze: &Maze, generator: &mut Generator) -> Result<(), Error> {
        // INVARIANT: a grid has at least three rows and columns, so neither range is empty.
        let mut col = generator.integers(0, self.width / 2).unwrap_or_default() * 2;
        let mut row = generator.integers(0, self.height / 2).unwrap_or_default() * 2;
        *self.wall(row, col) = true;
        let mut last = (0, 0);
        for _ in 0..maze.wall_components {
            let Some((rows, cols)) = self.next_direction(row, col, last, maze.go_straight, generator)? else {
                continue;
            };
            // The direction is remembered even if the wall cannot continue there.
            last = (rows, cols);
            if !*self.wall(row + rows, col + cols) {
                *self.wall(row + rows, col + cols) = true;
                *self.wall(row + rows / 2, col + cols / 2) = true;
                (row, col) = (row + rows, col + cols);
            }
        }
        Ok(())
    }

    fn next_direction(
        &self,
        row: i64,
        col: i64,
        last: Direction,
        go_straight: f64,
        generator: &mut Generator,
    ) -> Result<Option<Direction>, Error> {
        let open = [
            (col > 1, (0, -2)),
            (col < self.width - 2, (0, 2)),
            (row > 1, (-2, 0)),
            (row < self.height - 2, (2, 0)),
        ];
        let directions: Vec<Direction> =
            open.into_iter().filter(|(is_open, _)| *is_open).map(|(_, way)| way).collect();
        if directions.is_empty() {
            return Ok(None);
        }
        let weight = |&way: &Direction| if way == last { go_straight } else { 1.0 - go_straight };
        let mut weights: Vec<f64> = directions.iter().map(weight).collect();
        if weights.iter().all(|&weight| weight == go_straight) {
            weights.fill(1.0 / directions.len() as f64);
        } else {
            let total = weights.iter().fold(0.0, |sum, weight| sum + weight);
            for weight in &mut weights {
                *weight /= total;
            }
        }
        let chosen = generator.choice_weighted(&weights).map_err(|_| {
            Error::argument("go_straight", go_straight, "a share from 0 up to but not including 1")
        })?;
        Ok(Some(directions[chosen]))
    }

    /// Returns the map without the ring.
    fn inner_map(&self) -> Result<Map, Error> {
        let rows = self.walls.chunks(self.width as usize).skip(1).take(self.height as usize - 2);
        let inner: Vec<bool> = rows.flat_map(|row| row[1..row.len() - 1].iter().copied()).collect();
        Map::new(self.height as usize - 2, self.width as usize - 2, inner)
    }
}

#[cfg(test)]
mod tests {
    use super::floor_divide;

    #[test]
    fn floor_division_matches_python() {
        assert_eq!(floor_divide(7.0, 2.0), 3.0);
        assert_eq!(floor_divide(-7.0, 2.0), -4.0);
        assert_eq!(floor_divide(6.0, 3.0), 2.0);
        // 1 / 0.1 rounds to 10, but ten times the double 0.1 is more than 1.
        assert_eq!(floor_divide(1.0, 0.1), 9.0);
    }
}
