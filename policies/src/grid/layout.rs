//! A padded grid: the map with a margin on every side, so that no window needs a bounds check.

use pogema_core::{Cell, Error, Map, Outside};

/// The shape of a padded grid in row-major order. A *place* is the index of a cell in the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    height: usize,
    width: usize,
    /// Width of the margin, at least 1. Units: cells.
    margin: usize,
}

impl Layout {
    /// Returns the layout of a map for windows up to a radius.
    pub fn new(map: &Map, radius: usize) -> Self {
        Self { height: map.height(), width: map.width(), margin: radius.max(1) }
    }

    /// Checks that the cells of all agents lie on the map; `what` names them in the error.
    ///
    /// # Errors
    /// [`Error::Agent`] for the first cell outside the map.
    pub fn check_inside(&self, what: &str, cells: &[Cell]) -> Result<(), Error> {
        let Self { height, width, .. } = *self;
        let is_outside = |cell: &Cell| usize::from(cell.row) >= height || usize::from(cell.col) >= width;
        match cells.iter().position(is_outside) {
            None => Ok(()),
            Some(agent) => Err(Error::outside(agent, what, cells[agent], height, width)),
        }
    }

    /// Returns the number of places.
    pub fn len(&self) -> usize {
        (self.height + 2 * self.margin) * self.stride()
    }

    /// Returns the distance between the places of two vertically adjacent cells.
    pub fn stride(&self) -> usize {
        self.width + 2 * self.margin
    }

    /// Returns the place of a cell of the map.
    pub fn place(&self, cell: Cell) -> usize {
        (usize::from(cell.row) + self.margin) * self.stride() + usize::from(cell.col) + self.margin
    }

    /// Returns the place of a cell that may lie outside the map; `None` beyond the margin.
    pub fn find_place(&self, row: i32, col: i32) -> Option<usize> {
        let place = |x: i32, len: usize| {
            usize::try_from(i64::from(x) + self.margin as i64).ok().filter(|&x| x < len + 2 * self.margin)
        };
        Some(place(row, self.height)? * self.stride() + place(col, self.width)?)
    }

    /// Returns the first place of each row of the window around a place.
    pub fn window_rows(&self, place: usize, radius: usize) -> impl Iterator<Item = usize> + use<> {
        let (first, stride) = (place - radius * self.stride() - radius, self.stride());
        (0..=2 * radius).map(move |row| first + row * stride)
    }

    /// Copies the window around a place.
    pub fn copy_window<T: Copy>(&self, grid: &[T], place: usize, out: &mut [T]) {
        self.map_window(grid, place, out, |value| value);
    }

    /// Writes the window around a place, each value converted by a function.
    pub fn map_window<T: Copy, V: Copy>(
        &self,
        grid: &[T],
        place: usize,
        out: &mut [V],
        convert: impl Fn(T) -> V + Copy,
    ) {
        // A row length known at compile time halves the time. The arms are the areas of windows of radius 2 to 5 and 7.
        match out.len() {
            25 => self.map_rows::<5, _, _>(grid, place, out, convert),
            49 => self.map_rows::<7, _, _>(grid, place, out, convert),
            81 => self.map_rows::<9, _, _>(grid, place, out, convert),
            121 => self.map_rows::<11, _, _>(grid, place, out, convert),
            225 => self.map_rows::<15, _, _>(grid, place, out, convert),
            len => {
                let side = len.isqrt();
                for (row, first) in out.chunks_exact_mut(side).zip(self.window_rows(place, side / 2)) {
                    row.iter_mut()
                        .zip(&grid[first..first + side])
                        .for_each(|(out, &value)| *out = convert(value));
                }
            }
        }
    }

    fn map_rows<const SIDE: usize, T: Copy, V: Copy>(
        &self,
        grid: &[T],
        place: usize,
        out: &mut [V],
        convert: impl Fn(T) -> V,
    ) {
        let (rows, _) = out.as_chunks_mut::<SIDE>();
        for (row, first) in rows.iter_mut().zip(self.window_rows(place, SIDE / 2)) {
            if let Some(values) = grid[first..].first_chunk::<SIDE>() {
                // `values.map` would compile to a loop without vector instructions.
                row.iter_mut().zip(values).for_each(|(out, &value)| *out = convert(value));
            }
        }
    }

    /// Returns one value per place: 1 for an obstacle as POGEMA shows it, else 0.
    ///
    /// A wall one cell thick surrounds the map. Beyond the wall, the noise of the instance determines the obstacles.
    /// Without noise, and outside the area of the noise, all cells are free.
    ///
    /// Rule: border/ring, border/outside, border/noise
    pub fn obstacles(&self, map: &Map, outside: &Outside) -> Vec<f32> {
        let noise = match outside {
            Outside::Free => None,
            Outside::Noise(noise) => Some((noise, (noise.height() - map.height()) / 2)),
        };
        let is_obstacle = |row: i64, col: i64| {
            let (rows, cols) = (-1..=self.height as i64, -1..=self.width as i64);
            if rows.contains(&row) && cols.contains(&col) {
                // A cell outside the map counts as an obstacle: the wall.
                return Cell::checked((row, col)).is_none_or(|cell| map.is_obstacle(cell));
            }
            noise.is_some_and(|(noise, border)| {
                let place = Cell::checked((row + border as i64, col + border as i64));
                place.is_some_and(|cell| noise.contains(cell) && noise.is_obstacle(cell))
            })
        };
        let margin = self.margin as i64;
        let rows = -margin..self.height as i64 + margin;
        let all = rows.flat_map(|row| (-margin..self.width as i64 + margin).map(move |col| (row, col)));
        all.map(|(row, col)| f32::from(u8::from(is_obstacle(row, col)))).collect()
    }
}
