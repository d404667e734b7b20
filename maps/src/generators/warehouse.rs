//! Generator of warehouses: rows of shelves, aisles between them, and bays at both ends.

use pogema_core::{Cell, Error, Map, counted, words};

use crate::text::MapText;

/// The settings of a warehouse.
///
/// Units: cells.
///
/// Source: pogema-toolbox 0.1.1, `warehouse_generator.py`, `WarehouseConfig`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Warehouse {
    /// Number of columns of a shelf.
    pub wall_width: usize,
    /// Number of rows of a shelf.
    pub wall_height: usize,
    /// Number of shelves side by side.
    pub walls_in_row: usize,
    /// Number of shelves one below the other.
    pub walls_rows: usize,
    /// Number of free columns to the left of all shelves, and to the right.
    pub bottom_gap: usize,
    /// Number of free columns between shelves.
    pub horizontal_gap: usize,
    /// Number of free rows between shelves, above all shelves, and below.
    pub vertical_gap: usize,
}

words! {
    /// The cells where agents may start and have their goals.
    #[derive(Default)]
    pub enum Bays {
        /// No possible starts or goals are marked.
        #[default]
        None = "none",
        /// As in pogema-toolbox.
        ///
        /// Starts are in the gaps at both ends, in two of every three rows; goals are along the
        /// shelves.
        Toolbox = "toolbox",
        /// As in the published warehouse.
        ///
        /// Starts are in columns 1, 2, 4 and 5 and the four columns that mirror them, in the rows of each shelf and the
        /// rows next to it. With a `vertical_gap` of at least 3, the first and last rows have no starts.
        Published = "published",
    }
}

impl Default for Warehouse {
    fn default() -> Self {
        Self {
            wall_width: 5,
            wall_height: 2,
            walls_in_row: 5,
            walls_rows: 5,
            bottom_gap: 5,
            horizontal_gap: 1,
            vertical_gap: 3,
        }
    }
}

impl Warehouse {
    /// The settings of the published map `wfi_warehouse`, for use with [`Bays::Published`].
    pub const PUBLISHED: Self = Self {
        wall_width: 10,
        wall_height: 1,
        walls_in_row: 3,
        walls_rows: 8,
        bottom_gap: 7,
        horizontal_gap: 1,
        vertical_gap: 3,
    };

    /// Generates the map, and the cells where agents may start and have their goals.
    ///
    /// # Errors
    /// [`Error::Argument`] for settings out of range; with bays, also for a `vertical_gap` below 2.
    ///
    /// Source: pogema-toolbox 0.1.1, `warehouse_generator.py`, `generate_warehouse` and `generate_wfi_warehouse`
    pub fn generate(&self, bays: Bays) -> Result<MapText, Error> {
        if bays == Bays::None {
            return Ok(MapText::from(self.shelves(0)?));
        }
        self.check_gap()?;
        let map = self.shelves(usize::from(bays == Bays::Published))?;
        let (mut starts, goals) = self.cells(&map, bays)?;
        // A cell that qualifies as both becomes a goal.
        starts.retain(|start| goals.binary_search(start).is_err());
        Ok(MapText { pools: Some((starts, goals)), ..MapText::from(map) })
    }

    /// Returns the possible starts and goals on a map, each in reading order. Of the settings, only
    /// `bottom_gap`, `vertical_gap` and `wall_height` are used.
    ///
    /// # Errors
    /// [`Error::Argument`] for a `vertical_gap` below 2.
    ///
    /// Source: pogema-toolbox 0.1.1, `warehouse_generator.py`, `generate_wfi_positions`
    pub fn cells(&self, map: &Map, bays: Bays) -> Result<(Vec<Cell>, Vec<Cell>), Error> {
        self.check_gap()?;
        let is_start = |cell: &Cell| match bays {
            Bays::None => false,
            Bays::Toolbox => self.is_toolbox_start(map, *cell),
            Bays::Published => self.is_published_start(map, *cell),
        };
        let starts = map.free_cells().filter(is_start).collect();
        Ok((starts, map.free_cells().filter(|&cell| self.is_goal(map, cell)).collect()))
    }

    fn check_gap(&self) -> Result<(), Error> {
        if self.vertical_gap < 2 {
            return Err(Error::argument("vertical_gap", self.vertical_gap, "at least 2, for bays and goals"));
        }
        Ok(())
    }

    /// Returns the map without the first and last `num_cut` rows.
    fn shelves(&self, num_cut: usize) -> Result<Map, Error> {
        let (height, width) = self.sides()?;
        let height = height.saturating_sub(2 * num_cut);
        self.check_sides(height, width)?;
        let is_row_of_shelf = |row: usize| {
            let (period, row) = (self.vertical_gap + self.wall_height, row + num_cut);
            period > 0 && row / period < self.walls_rows && row % period >= self.vertical_gap
        };
        let is_col_of_shelf = |col: usize| {
            let period = self.wall_width + self.horizontal_gap;
            let is_col = |col: usize| col / period < self.walls_in_row && col % period < self.wall_width;
            period > 0 && col.checked_sub(self.bottom_gap).is_some_and(is_col)
        };
        let cells = (0..height).flat_map(|row| (0..width).map(move |col| (row, col)));
        let obstacles = cells.map(|(row, col)| is_row_of_shelf(row) && is_col_of_shelf(col)).collect();
        Map::new(height, width, obstacles)
    }

    /// Returns the height and width of the map before `generate` crops it.
    ///
    /// # Errors
    /// [`Error::Argument`] for a setting out of range.
    pub fn sides(&self) -> Result<(usize, usize), Error> {
        let settings = [
            ("wall_width", self.wall_width),
            ("wall_height", self.wall_height),
            ("walls_in_row", self.walls_in_row),
            ("walls_rows", self.walls_rows),
            ("bottom_gap", self.bottom_gap),
            ("horizontal_gap", self.horizontal_gap),
            ("vertical_gap", self.vertical_gap),
        ];
        if let Some((field, value)) = settings.into_iter().find(|(_, value)| *value > Map::LONGEST_SIDE) {
            return Err(Error::argument(field, value, format!("at most {}", Map::LONGEST_SIDE)));
        }
        let height = self.vertical_gap * (self.walls_rows + 1) + self.wall_height * self.walls_rows;
        let walls = 2 * self.bottom_gap + self.wall_width * self.walls_in_row;
        // Without walls, the number of gaps would be −1, so the subtraction must not go below 0.
        let width = (walls + self.horizontal_gap * self.walls_in_row).saturating_sub(self.horizontal_gap);
        self.check_sides(height, width)?;
        Ok((height, width))
    }

    /// Checks the sides of a map; errors name the number of shelves along the side.
    fn check_sides(&self, height: usize, width: usize) -> Result<(), Error> {
        let sides = [
            ("walls_rows", self.walls_rows, height, "row"),
            ("walls_in_row", self.walls_in_row, width, "column"),
        ];
        for (field, value, side, unit) in sides {
            let change = match side {
                0 => "more",
                1..=Map::LONGEST_SIDE => continue,
                _ => "fewer",
            };
            let (side, longest) = (counted(side, unit), Map::LONGEST_SIDE);
            let expected = format!("{change}: the map would have {side}, and 1 to {longest} are possible");
            return Err(Error::argument(field, value, expected));
        }
        Ok(())
    }

    fn is_toolbox_start(&self, map: &Map, cell: Cell) -> bool {
        let (row, col) = (usize::from(cell.row), usize::from(cell.col));
        let is_inner = row > 0 && row + 1 < map.height();
        // pogema-toolbox leaves out every third row, regardless of the gap between the shelves.
        let is_left = col + 1 < self.bottom_gap;
        let is_right = col + self.bottom_gap > map.width();
        is_inner && row % 3 != 0 && (is_left || is_right)
    }

    fn is_published_start(&self, map: &Map, cell: Cell) -> bool {
        let col = usize::from(cell.col).min(map.width() - 1 - usize::from(cell.col));
        let period = self.vertical_gap + self.wall_height;
        // The rows of a shelf, the row above the shelf and the row below.
        let row = usize::from(cell.row) % period;
        let is_beside_shelf =
            (self.vertical_gap - 2..=self.vertical_gap - 1 + self.wall_height).contains(&row);
        [1, 2, 4, 5].contains(&col) && is_beside_shelf
    }

    fn is_goal(&self, map: &Map, cell: Cell) -> bool {
        let is_shelf = |row: Option<u16>| {
            row.map(|row| Cell::new(row, cell.col))
                .is_some_and(|other| map.contains(other) && map.is_obstacle(other))
        };
        // If shelves are two rows apart, goals are on one side only.
        let has_below = self.vertical_gap != 2 && is_shelf(cell.row.checked_add(1));
        is_shelf(cell.row.checked_sub(1)) || has_below
    }
}
