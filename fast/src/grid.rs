//! The map with its border, stored as bits for the windows and as squares for the moves.

use std::hint::select_unpredictable;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering::Relaxed};

use pogema_core::{Cell, Error, Instance, Outside};

/// One bit per cell of a map with its border, stored in vertical strips.
///
/// A strip holds one word per row. It begins 32 columns after the previous strip and is 64 columns wide. Every cell is
/// therefore in two strips, and a window of up to 33 columns lies in one strip: its rows are adjacent in memory and
/// only need to be shifted. An extra strip precedes the first, so that the cells of the first columns are in two
/// strips, too.
#[derive(Debug, Default)]
pub struct Strips {
    words: Vec<AtomicU64>,
    num_rows: usize,
}

/// Number of rows that vector loads read for a window, rows beyond the window included. The same number of padding
/// words follows the last strip.
pub const MAX_ROWS: usize = 12;

/// Columns from one strip to the next.
pub const STRIDE: usize = 32;

impl Strips {
    /// Creates strips with all bits unset.
    pub fn empty(height: usize, width: usize) -> Result<Self, Error> {
        let num_strips = width.div_ceil(STRIDE) + 2;
        let num_words = num_strips.checked_mul(height).and_then(|words| words.checked_add(MAX_ROWS));
        let words = reserve(num_words, || AtomicU64::new(0))?;
        Ok(Self { words, num_rows: height })
    }

    /// Returns the number of rows, border included.
    pub fn num_rows(&self) -> usize {
        self.num_rows
    }

    /// Returns the number of bytes of all strips.
    pub fn num_bytes(&self) -> usize {
        num_bytes(&self.words)
    }

    /// Returns the words of all strips.
    #[inline]
    pub fn words(&self) -> &[AtomicU64] {
        &self.words
    }

    /// Returns the index of a cell's word in the strip whose first 32 columns hold the cell, and the bit of the cell in
    /// that word.
    #[inline]
    pub fn locate(&self, row: usize, col: usize) -> (usize, u32) {
        ((col / STRIDE + 1) * self.num_rows + row, (col % STRIDE) as u32)
    }

    /// Returns the words of a window's first strip from its first row on, and the shift that moves its first column to
    /// bit 0.
    ///
    /// The strips to the right follow at distances of [`Strips::num_rows`].
    #[inline]
    pub fn window(&self, row: usize, col: usize) -> (&[AtomicU64], u32) {
        let (first, shift) = self.locate(row, col);
        (&self.words[first..], shift)
    }

    /// Returns the two words of a cell, and a mask of its bit in the first; in the second its bit is 32 bits higher.
    fn words_of(&self, row: usize, col: usize) -> (&AtomicU64, &AtomicU64, u64) {
        let (here, bit) = self.locate(row, col);
        (&self.words[here], &self.words[here - self.num_rows], 1 << bit)
    }

    pub fn get(&self, row: usize, col: usize) -> bool {
        let (word, _, bit) = self.words_of(row, col);
        word.load(Relaxed) & bit != 0
    }

    /// Sets a bit if a condition is true. `is_shared` states that other threads may set bits at the same time.
    #[inline]
    pub fn set_if(&self, condition: bool, row: usize, col: usize, is_shared: bool) {
        let (word, other, bit) = self.words_of(row, col);
        if !is_shared {
            let bit = select_unpredictable(condition, bit, 0);
            word.store(word.load(Relaxed) | bit, Relaxed);
            other.store(other.load(Relaxed) | bit << STRIDE, Relaxed);
        } else if condition {
            word.fetch_or(bit, Relaxed);
            other.fetch_or(bit << STRIDE, Relaxed);
        }
    }

    /// Clears one bit.
    pub fn clear(&self, row: usize, col: usize) {
        let (word, other, bit) = self.words_of(row, col);
        word.fetch_and(!bit, Relaxed);
        other.fetch_and(!(bit << STRIDE), Relaxed);
    }

    /// Clears the two words of a cell, the bits of neighbouring cells included.
    pub fn blank(&self, row: usize, col: usize) {
        let (word, other, _) = self.words_of(row, col);
        word.store(0, Relaxed);
        other.store(0, Relaxed);
    }

    pub fn clear_all(&mut self) {
        self.words.fill_with(AtomicU64::default);
    }

    /// Overwrites the bits of a row from column `first` on.
    fn write_row(&mut self, row: usize, first: usize, flags: &[bool]) {
        let mut col = first;
        let mut rest = flags;
        while !rest.is_empty() {
            let (here, shift) = self.locate(row, col);
            let (now, later) = rest.split_at(rest.len().min(STRIDE - shift as usize));
            let bits = now.iter().rev().fold(0u64, |bits, &flag| bits << 1 | u64::from(flag)) << shift;
            let mask = (u64::MAX >> (64 - now.len())) << shift;
            replace(self.words[here].get_mut(), mask, bits);
            replace(self.words[here - self.num_rows].get_mut(), mask << STRIDE, bits << STRIDE);
            col += now.len();
            rest = later;
        }
    }

    /// Reads the bits of a row from column `first` on as 0 and 1.
    pub fn read_row(&self, row: usize, first: usize, out: &mut [u8]) {
        let mut col = first;
        let mut rest = out;
        while !rest.is_empty() {
            let (here, shift) = self.locate(row, col);
            let number = rest.len().min(STRIDE - shift as usize);
            let (now, later) = rest.split_at_mut(number);
            let bits = self.words[here].load(Relaxed) >> shift;
            for (bit, value) in now.iter_mut().enumerate() {
                *value = (bits >> bit & 1) as u8;
            }
            col += number;
            rest = later;
        }
    }

    /// Writes the obstacles of an instance with its border: first the outside, then the wall, then the map.
    ///
    /// Rule: border/ring, border/outside, border/noise
    pub fn write_obstacles(&mut self, instance: &Instance, radius: usize) {
        self.clear_all();
        let (height, width) = (instance.map().height(), instance.map().width());
        if let Outside::Noise(noise) = instance.outside() {
            for (row, flags) in noise.obstacles().chunks(noise.width()).enumerate() {
                self.write_row(row, 0, flags);
            }
        }
        let wall = vec![true; width + 2];
        self.write_row(radius - 1, radius - 1, &wall);
        self.write_row(radius + height, radius - 1, &wall);
        for (row, flags) in instance.map().obstacles().chunks(width).enumerate() {
            self.write_row(radius + row, radius - 1, &[true]);
            self.write_row(radius + row, radius, flags);
            self.write_row(radius + row, radius + width, &[true]);
        }
    }
}

fn replace(word: &mut u64, mask: u64, bits: u64) {
    *word = *word & !mask | bits;
}

/// The part of a cell's state on which moves depend.
#[derive(Debug)]
pub struct Square {
    /// The active agent on this square, or [`FREE`], or [`OBSTACLE`].
    pub agent: AtomicU32,
    /// While a step is played: the agent that claims this square, or [`NO_AGENT`]; under `block_both`, also a value
    /// that stands for several agents.
    pub claim: AtomicU32,
}

pub const FREE: u32 = u32::MAX - 1;
pub const OBSTACLE: u32 = u32::MAX;
pub const NO_AGENT: u32 = u32::MAX;

/// The squares of a map and of the wall around it. The wall makes bounds checks of moves unnecessary.
#[derive(Debug, Default)]
pub struct Board {
    squares: Vec<Square>,
    width: u32,
}

impl Board {
    /// Creates a board on which every square is an obstacle.
    pub fn walls(height: usize, width: usize) -> Result<Self, Error> {
        let wall = || Square { agent: OBSTACLE.into(), claim: NO_AGENT.into() };
        let squares = reserve((width + 2).checked_mul(height + 2), wall)?;
        Ok(Self { squares, width: width as u32 + 2 })
    }

    /// Returns the number of squares, the wall included.
    pub fn num_squares(&self) -> usize {
        self.squares.len()
    }

    /// Returns the number of bytes of all squares.
    pub fn num_bytes(&self) -> usize {
        num_bytes(&self.squares)
    }

    /// Returns the index of the square of a cell.
    pub fn place(&self, cell: Cell) -> u32 {
        (u32::from(cell.row) + 1) * self.width + u32::from(cell.col) + 1
    }

    /// Returns the wrapping offset that each action adds to the index of a square, in the order of the action numbers.
    pub fn offsets(&self) -> [u32; 5] {
        [0, self.width.wrapping_neg(), self.width, u32::MAX, 1]
    }

    /// Returns all squares, row after row.
    pub fn squares(&self) -> &[Square] {
        &self.squares
    }

    pub fn square(&self, place: u32) -> &Square {
        &self.squares[place as usize]
    }

    /// Copies the obstacles of a map of the board's size, and removes all agents.
    pub fn write_obstacles(&mut self, obstacles: &[bool]) {
        let width = self.width as usize;
        let rows = self.squares.chunks_mut(width).skip(1);
        for (squares, obstacles) in rows.zip(obstacles.chunks(width - 2)) {
            for (square, &obstacle) in squares[1..].iter_mut().zip(obstacles) {
                *square.agent.get_mut() = if obstacle { OBSTACLE } else { FREE };
            }
        }
    }
}

/// Creates a list of `number` entries, or returns an error if there is not enough memory.
pub fn reserve<T>(number: Option<usize>, entry: impl FnMut() -> T) -> Result<Vec<T>, Error> {
    let mut list = Vec::new();
    let is_reserved = number.is_some_and(|number| list.try_reserve_exact(number).is_ok());
    match number {
        Some(number) if is_reserved => list.resize_with(number, entry),
        _ => {
            let bytes = number.and_then(|number| number.checked_mul(size_of::<T>()));
            return Err(Error::Memory { what: "the environment".into(), bytes });
        }
    }
    Ok(list)
}

/// Returns the number of bytes allocated for the entries of a list.
pub fn num_bytes<T>(list: &Vec<T>) -> usize {
    list.capacity() * size_of::<T>()
}
