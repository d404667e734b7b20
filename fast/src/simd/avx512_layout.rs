//! The layout of the bits of windows of up to 11 x 11 cells.

/// Number of words in a vector.
pub const LANES: usize = 8;

/// The layout of a window, which depends only on its side.
pub struct Layout {
    /// The source of each 16-bit element in the two vectors with the first eight rows.
    pub first_rows: [u16; 4 * LANES],
    /// The source of each 16-bit element when the rows after the eighth are added.
    pub last_rows: [u16; 4 * LANES],
    /// A mask of the bits of each row; 0 beyond the last row.
    pub row_mask: [u16; 4 * LANES],
    /// The factors that shift the second row of a pair to the bits after the first row.
    pub pair: [u16; 4 * LANES],
    pub terms: [Term; 4],
    pub num_terms: usize,
}

/// One part of each word of a record.
#[derive(Clone, Copy)]
pub struct Term {
    /// The source lane of the part.
    pub lane: [u64; LANES],
    /// The left rotation of the part.
    pub rotation: [u64; LANES],
    /// A mask of the bits that belong to the word.
    pub mask: [u64; LANES],
}

impl Layout {
    /// The channel and the first row of each part.
    const PARTS: [(usize, usize); 6] = [(0, 0), (0, 4), (1, 0), (1, 4), (0, 8), (1, 8)];

    pub const fn of(side: usize) -> Self {
        let none = Term { lane: [0; LANES], rotation: [0; LANES], mask: [0; LANES] };
        let mut layout = Self {
            first_rows: [0; 4 * LANES],
            last_rows: [0; 4 * LANES],
            row_mask: [0; 4 * LANES],
            pair: [0; 4 * LANES],
            terms: [none; 4],
            num_terms: 0,
        };
        // Plain loops, since constant functions cannot use iterators.
        let mut word = 0;
        while word < 4 * LANES {
            layout.place_row(side, word);
            word += 1;
        }
        let mut word = 0;
        while word < LANES {
            layout.place_parts(side, word);
            word += 1;
        }
        layout
    }

    const fn place_row(&mut self, side: usize, word: usize) {
        const OTHER: u16 = 32;
        let (row, lane) = (word as u16 % 8, word as u16 / 4);
        // First the rows of the obstacles, then those of the agents. A row is in the lowest 16 bits of its lane.
        self.first_rows[word] = if word < 8 { 4 * row } else { OTHER | (4 * row) };
        self.last_rows[word] = if word < 16 { word as u16 } else { OTHER | (4 * (word as u16 - 16) % 32) };
        self.pair[word] = if word.is_multiple_of(2) { 1 } else { 1 << side };
        if (lane as usize) < Self::PARTS.len() {
            let (_, first) = Self::PARTS[lane as usize];
            let is_row = first + word % 4 < side;
            self.row_mask[word] = if is_row { (1 << side) - 1 } else { 0 };
        }
    }

    const fn place_parts(&mut self, side: usize, word: usize) {
        let (mut part, mut term) = (0, 0);
        while part < Self::PARTS.len() {
            let (channel, first) = Self::PARTS[part];
            let num_rows = if first >= side { 0 } else { min(side - first, 4) };
            let begin = channel * side * side + first * side;
            let (low, high) = (max(begin, 64 * word), min(begin + num_rows * side, 64 * word + 64));
            if low < high {
                self.terms[term].lane[word] = part as u64;
                self.terms[term].rotation[word] = ((begin + 64 * LANES - 64 * word) % 64) as u64;
                self.terms[term].mask[word] = (u64::MAX >> (64 - (high - low))) << (low - 64 * word);
                term += 1;
            }
            part += 1;
        }
        self.num_terms = max(self.num_terms, term);
    }
}

const fn min(one: usize, other: usize) -> usize {
    if one < other { one } else { other }
}

const fn max(one: usize, other: usize) -> usize {
    if one < other { other } else { one }
}
