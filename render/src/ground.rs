//! The map and its border as one grid of cells.

use std::ops::Range;

use pogema_core::{Cell, Instance, Map, Outside, Trace, words};

words! {
    /// The part of the border that is drawn.
    #[derive(Default)]
    pub enum Border {
        /// Only the map.
        None = "none",
        /// The map and the wall around it, as POGEMA draws it.
        #[default]
        Thin = "thin",
        /// The whole border that agents can see, as wide as the radius.
        Full = "full",
    }
}

/// The cells of a map and its border. Rows and columns count from the upper left corner of the map, so those above and
/// to the left of the map are negative.
#[derive(Clone, Copy, Debug)]
pub struct Ground<'a> {
    /// The map without its border.
    pub map: &'a Map,
    /// The area outside the wall.
    pub outside: &'a Outside,
    /// The radius of the agents. Units: cells.
    pub radius: usize,
}

impl<'a> Ground<'a> {
    /// Returns the ground of an instance for agents with this radius.
    pub fn new(instance: &'a Instance, radius: usize) -> Self {
        Self { map: instance.map(), outside: instance.outside(), radius }
    }

    /// Returns the ground of a recorded episode.
    pub fn of(trace: &'a Trace) -> Self {
        let header = &trace.header;
        Self { map: &header.map, outside: &header.outside, radius: header.config.radius }
    }

    /// Returns whether a cell of the map or its border is an obstacle.
    pub fn is_obstacle(&self, row: i32, col: i32) -> bool {
        if let Some(cell) = Cell::checked((row, col)).filter(|&cell| self.map.contains(cell)) {
            return self.map.is_obstacle(cell);
        }
        if self.rows(Border::Thin).contains(&row) && self.cols(Border::Thin).contains(&col) {
            return true;
        }
        let radius = self.radius as i32;
        match self.outside {
            Outside::Free => false,
            Outside::Noise(noise) => {
                Cell::checked((row + radius, col + radius)).is_some_and(|cell| noise.is_obstacle(cell))
            }
        }
    }

    /// Returns the rows of the map and this part of its border.
    pub fn rows(&self, border: Border) -> Range<i32> {
        let width = self.border_width(border);
        -width..self.map.height() as i32 + width
    }

    /// Returns the columns of the map and this part of its border.
    pub fn cols(&self, border: Border) -> Range<i32> {
        let width = self.border_width(border);
        -width..self.map.width() as i32 + width
    }

    /// Returns whether an agent on one cell sees another cell.
    pub fn sees(&self, from: Cell, row: i32, col: i32) -> bool {
        let radius = self.radius as u32;
        i32::from(from.row).abs_diff(row) <= radius && i32::from(from.col).abs_diff(col) <= radius
    }

    fn border_width(&self, border: Border) -> i32 {
        match border {
            Border::None => 0,
            Border::Thin => 1,
            Border::Full => self.radius as i32,
        }
    }
}
