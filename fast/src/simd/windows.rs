//! Windows of up to 11 x 11, cut out of the strips.
//!
//! All of it happens in vectors. Rows of a window are brought to 16 bits each, then pairs and fours of them are pushed
//! together, and what is left, up to six parts, is put where it belongs in the words of the agent. The whole record is
//! then shifted to the bit where the one before ended.

use std::arch::x86_64::{
    __m512i, _mm_cvtsi32_si128, _mm512_and_si512, _mm512_loadu_si512, _mm512_madd_epi16,
    _mm512_mask_loadu_epi64, _mm512_mask_or_epi64, _mm512_mask_storeu_epi64, _mm512_maskz_alignr_epi64,
    _mm512_maskz_loadu_epi64, _mm512_maskz_permutexvar_epi64, _mm512_permutex2var_epi16,
    _mm512_permutexvar_epi64, _mm512_rolv_epi64, _mm512_set1_epi64, _mm512_setzero_si512, _mm512_sll_epi64,
    _mm512_srl_epi64, _mm512_storeu_si512, _mm512_ternarylogic_epi64,
};
use std::ops::Range;
use std::sync::atomic::AtomicU64;

use super::{MOST_WORDS, Scene};

/// Words of a vector.
const LANES: usize = 8;

/// Writes all three channels of some agents, or says that the windows are too large for this.
pub fn pack(scene: &Scene<'_>, agents: Range<usize>, lead: usize, apart: bool, words: &mut [u64]) -> bool {
    // SAFETY: the path is only taken where its features are there (`Path::check`).
    unsafe {
        match (scene.radius, apart) {
            (1, false) => pack_on::<3>(scene, agents, lead, words),
            (2, false) => pack_on::<5>(scene, agents, lead, words),
            (3, false) => pack_on::<7>(scene, agents, lead, words),
            (4, false) => pack_on::<9>(scene, agents, lead, words),
            (5, false) => pack_on::<11>(scene, agents, lead, words),
            (1, true) => pack_apart::<3, 1>(scene, agents, words),
            (2, true) => pack_apart::<5, 2>(scene, agents, words),
            (3, true) => pack_apart::<7, 3>(scene, agents, words),
            (4, true) => pack_apart::<9, 4>(scene, agents, words),
            (5, true) => pack_apart::<11, 6>(scene, agents, words),
            _ => return false,
        }
    }
    true
}

/// Each agent's bits right after those of the agent before.
#[target_feature(enable = "avx512f,avx512bw")]
fn pack_on<const SIDE: usize>(scene: &Scene<'_>, agents: Range<usize>, lead: usize, words: &mut [u64]) {
    let mut bit = lead;
    // The word in which the agent before ended, in the first lane.
    let mut carry = _mm512_setzero_si512();
    for agent in agents {
        let record = record::<SIDE, false>(scene, agent);
        let (first, shift) = (bit / 64, bit % 64);
        let left = _mm512_sll_epi64(record, _mm_cvtsi32_si128(shift as i32));
        // Bits that a shift pushes out of a word go on in the next one.
        let below = _mm512_maskz_alignr_epi64::<7>(0xfe, record, record);
        let right = _mm512_srl_epi64(below, _mm_cvtsi32_si128(64 - shift as i32));
        let shifted = _mm512_ternarylogic_epi64::<OR>(left, right, carry);
        let out: &mut [u64] = &mut words[first..first + MOST_WORDS];
        // SAFETY: `out` holds as many words as a vector.
        unsafe { _mm512_storeu_si512(out.as_mut_ptr().cast(), shifted) };
        bit += 3 * SIDE * SIDE;
        let last = _mm512_set1_epi64((bit / 64 - first) as i64);
        carry = _mm512_maskz_permutexvar_epi64(1, last, shifted);
    }
}

/// Each agent's bits in words of its own.
#[target_feature(enable = "avx512f,avx512bw")]
fn pack_apart<const SIDE: usize, const WORDS: usize>(
    scene: &Scene<'_>,
    agents: Range<usize>,
    words: &mut [u64],
) {
    for (agent, out) in agents.zip(words.as_chunks_mut::<WORDS>().0) {
        let record = record::<SIDE, true>(scene, agent);
        // SAFETY: the mask leaves out what lies after `out`.
        unsafe { _mm512_mask_storeu_epi64(out.as_mut_ptr().cast(), (1 << WORDS) - 1, record) };
    }
}

/// `a | b | c`.
const OR: i32 = 0xfe;
/// `a | b & c`.
const OR_AND: i32 = 0xf8;
/// `a ? b : c`, bit by bit.
const CHOOSE: i32 = 0xca;

/// All bits of an agent. `APART` only makes each caller's copy its own, so that it is put in place there.
#[target_feature(enable = "avx512f,avx512bw")]
#[inline]
fn record<const SIDE: usize, const APART: bool>(scene: &Scene<'_>, agent: usize) -> __m512i {
    let cell = scene.cells[agent];
    let (row, col) = (usize::from(cell.row), usize::from(cell.col));
    let (obstacles, shift) = scene.obstacles.window(row, col);
    let (occupied, _) = scene.occupied.window(row, col);
    let parts = parts::<SIDE>(&obstacles[..SIDE], &occupied[..SIDE], shift);
    let mut record = _mm512_setzero_si512();
    let table = const { &Table::of(SIDE) };
    for term in &table.terms[..table.num_terms] {
        let moved =
            _mm512_rolv_epi64(_mm512_permutexvar_epi64(vector(&term.lane), parts), vector(&term.turn));
        record = _mm512_ternarylogic_epi64::<OR_AND>(record, moved, vector(&term.mask));
    }
    let goal = 2 * SIDE * SIDE + scene.goal_index(agent);
    let bit = _mm512_set1_epi64((1u64 << (goal % 64)) as i64);
    _mm512_mask_or_epi64(record, 1 << (goal / 64), record, bit)
}

/// The rows of both windows by fours: lane by lane rows 0 to 3 and 4 to 7 of the obstacles, the same of the agents, then
/// the last rows of the obstacles and of the agents. Above their bits lanes hold anything.
#[target_feature(enable = "avx512f,avx512bw")]
#[inline]
fn parts<const SIDE: usize>(obstacles: &[AtomicU64], occupied: &[AtomicU64], shift: u32) -> __m512i {
    let is_row = if SIDE < LANES { (1u8 << SIDE) - 1 } else { 0xff };
    let shift = _mm_cvtsi32_si128(shift as i32);
    let (obstacles, occupied) = (obstacles.as_ptr().cast::<i64>(), occupied.as_ptr().cast::<i64>());
    // SAFETY: the masks let only the first SIDE rows be read, and the caller has cut out so many. No thread writes them,
    // since a step borrows the engine mutably.
    let (first, second) =
        unsafe { (_mm512_maskz_loadu_epi64(is_row, obstacles), _mm512_maskz_loadu_epi64(is_row, occupied)) };
    let (first, second) = (_mm512_srl_epi64(first, shift), _mm512_srl_epi64(second, shift));
    let table = const { &Table::of(SIDE) };
    let mut rows = _mm512_permutex2var_epi16(first, words(&table.first_rows), second);
    if SIDE > LANES {
        let is_last = (1u8 << (SIDE - LANES)) - 1;
        // SAFETY: as above; the last rows of the agents go to the upper lanes.
        let last = unsafe {
            let last = _mm512_maskz_loadu_epi64(is_last, obstacles.add(LANES));
            _mm512_mask_loadu_epi64(last, is_last << 4, occupied.add(LANES).wrapping_sub(4))
        };
        rows = _mm512_permutex2var_epi16(rows, words(&table.last_rows), _mm512_srl_epi64(last, shift));
    }
    let rows = _mm512_and_si512(rows, words(&table.is_wanted));
    let pairs = _mm512_madd_epi16(rows, words(&table.pair));
    let upper = _mm512_srl_epi64(pairs, _mm_cvtsi32_si128(32 - 2 * SIDE as i32));
    let is_upper = ((1u64 << (2 * SIDE)) - 1) << (2 * SIDE);
    _mm512_ternarylogic_epi64::<CHOOSE>(_mm512_set1_epi64(is_upper as i64), upper, pairs)
}

#[target_feature(enable = "avx512f")]
#[inline]
fn vector(lanes: &[u64; LANES]) -> __m512i {
    // SAFETY: the array is as large as a vector.
    unsafe { _mm512_loadu_si512(lanes.as_ptr().cast()) }
}

#[target_feature(enable = "avx512f")]
#[inline]
fn words(words: &[u16; 4 * LANES]) -> __m512i {
    // SAFETY: as in `vector`.
    unsafe { _mm512_loadu_si512(words.as_ptr().cast()) }
}

/// Where the bits of a window go; everything follows from its side.
struct Table {
    /// Which 16 bits of two vectors of rows are wanted where.
    first_rows: [u16; 4 * LANES],
    last_rows: [u16; 4 * LANES],
    /// The bits of a row, where there is one.
    is_wanted: [u16; 4 * LANES],
    /// Puts the second row of a pair after the first.
    pair: [u16; 4 * LANES],
    terms: [Term; 4],
    num_terms: usize,
}

/// One part of each word of a record.
#[derive(Clone, Copy)]
struct Term {
    /// Where the part comes from.
    lane: [u64; LANES],
    /// How far it is turned to the left.
    turn: [u64; LANES],
    /// Which of its bits are wanted.
    mask: [u64; LANES],
}

impl Table {
    /// The channel and the first row of each part.
    const PARTS: [(usize, usize); 6] = [(0, 0), (0, 4), (1, 0), (1, 4), (0, 8), (1, 8)];

    const fn of(side: usize) -> Self {
        let none = Term { lane: [0; LANES], turn: [0; LANES], mask: [0; LANES] };
        let mut table = Self {
            first_rows: [0; 4 * LANES],
            last_rows: [0; 4 * LANES],
            is_wanted: [0; 4 * LANES],
            pair: [0; 4 * LANES],
            terms: [none; 4],
            num_terms: 0,
        };
        // Plain loops, since a constant knows no iterators.
        let mut word = 0;
        while word < 4 * LANES {
            table.place_row(side, word);
            word += 1;
        }
        let mut word = 0;
        while word < LANES {
            table.place_parts(side, word);
            word += 1;
        }
        table
    }

    const fn place_row(&mut self, side: usize, word: usize) {
        const OTHER: u16 = 32;
        let (row, lane) = (word as u16 % 8, word as u16 / 4);
        // Row after row of the obstacles, then of the agents; a row is in the lowest 16 bits of its lane.
        self.first_rows[word] = if word < 8 { 4 * row } else { OTHER | (4 * row) };
        self.last_rows[word] = if word < 16 { word as u16 } else { OTHER | (4 * (word as u16 - 16) % 32) };
        self.pair[word] = if word.is_multiple_of(2) { 1 } else { 1 << side };
        if (lane as usize) < Self::PARTS.len() {
            let (_, first) = Self::PARTS[lane as usize];
            let is_row = first + word % 4 < side;
            self.is_wanted[word] = if is_row { (1 << side) - 1 } else { 0 };
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
                self.terms[term].turn[word] = ((begin + 64 * LANES - 64 * word) % 64) as u64;
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
