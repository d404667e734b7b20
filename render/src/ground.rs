//! The map, its wall and what lies beyond, as one field of cells.

use std::ops::Range;

use pogema_core::{Cell, Instance, Map, Outside, Trace, words};

words! {
    /// How much of the border is drawn.
    #[derive(Default)]
    pub enum Border {
        /// The map alone.
        None = "none",
        /// The map and the wall around it, as POGEMA draws it.
        #[default]
        Thin = "thin",
        /// All that agents can see: the border is as wide as the radius.
        Full = "full",
    }
}

/// The cells of a map and of its border; rows and columns count from the map's corner, those above and to the
/// left are negative.
#[derive(Clone, Copy, Debug)]
pub struct Ground<'a> {
    /// The map without its border.
    pub map: &'a Map,
    /// What lies beyond the wall.
    pub outside: &'a Outside,
    /// How far agents see.
    pub radius: usize,
}

impl<'a> Ground<'a> {
    /// The ground of an instance, for agents of this radius.
    pub fn new(instance: &'a Instance, radius: usize) -> Self {
        Self { map: instance.map(), outside: instance.outside(), radius }
    }

    /// The ground of a recorded episode.
    pub fn of(trace: &'a Trace) -> Self {
        let header = &trace.header;
        Self { map: &header.map, outside: &header.outside, radius: header.config.radius }
    }

    /// Whether a cell of the map or its border holds an obstacle.
    pub fn is_obstacle(&self, row: i32, col: i32) -> bool {
        if let Some(cell) = cell(row, col).filter(|&cell| self.map.contains(cell)) {
            return self.map.is_obstacle(cell);
        }
        if self.rows(Border::Thin).contains(&row) && self.cols(Border::Thin).contains(&col) {
            return true;
        }
        let radius = self.radius as i32;
        match self.outside {
            Outside::Free => false,
            Outside::Noise(noise) => {
                cell(row + radius, col + radius).is_some_and(|cell| noise.is_obstacle(cell))
            }
        }
    }

    /// The rows of the map and so much of its border.
    pub fn rows(&self, border: Border) -> Range<i32> {
        let width = self.border_width(border);
        -width..self.map.height() as i32 + width
    }

    /// The columns of the map and so much of its border.
    pub fn cols(&self, border: Border) -> Range<i32> {
        let width = self.border_width(border);
        -width..self.map.width() as i32 + width
    }

    /// Whether an agent on one cell sees another cell.
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

fn cell(row: i32, col: i32) -> Option<Cell> {
    Some(Cell::new(u16::try_from(row).ok()?, u16::try_from(col).ok()?))
}
