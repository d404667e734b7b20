//! The set of cells that a search has reached.

use rustc_hash::FxHashSet;

use crate::replan::place::Place;

/// A set of cells of an unbounded grid, fast around one cell.
#[derive(Clone, Debug)]
pub(crate) struct Reached {
    /// The first row and column of the cells that have a bit.
    origin: Place,
    /// For each cell around the middle, a bit: words of 64 columns, row by row.
    bits: Vec<u64>,
    /// The other cells.
    far: FxHashSet<Place>,
}

impl Default for Reached {
    fn default() -> Self {
        Self { origin: (0, 0), bits: vec![0; Self::SIDE * Self::SIDE / 64], far: FxHashSet::default() }
    }
}

impl Reached {
    /// The number of rows and columns of the cells that have a bit.
    const SIDE: usize = 512;

    /// Removes all cells, and makes the set fast around `middle`.
    pub fn clear_around(&mut self, middle: Place) {
        let half = (Self::SIDE / 2) as i32;
        self.origin = (middle.0 - half, middle.1 - half);
        self.bits.fill(0);
        self.far.clear();
    }

    /// Returns whether the set contains a cell.
    pub fn contains(&self, place: Place) -> bool {
        match self.bit(place) {
            Some(bit) => self.bits[bit / 64] >> (bit % 64) & 1 == 1,
            None => self.far.contains(&place),
        }
    }

    /// Adds a cell.
    pub fn insert(&mut self, place: Place) {
        match self.bit(place) {
            Some(bit) => self.bits[bit / 64] |= 1 << (bit % 64),
            None => {
                self.far.insert(place);
            }
        }
    }

    fn bit(&self, place: Place) -> Option<usize> {
        let row = place.0.wrapping_sub(self.origin.0) as u32 as usize;
        let col = place.1.wrapping_sub(self.origin.1) as u32 as usize;
        (row < Self::SIDE && col < Self::SIDE).then_some(row * Self::SIDE + col)
    }
}
