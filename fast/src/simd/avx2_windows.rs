//! Extraction of windows of up to 11 x 11 from the strips with AVX2, four rows at a time.

use std::arch::x86_64::{
    __m256i, _mm_cvtsi32_si128, _mm_cvtsi128_si64, _mm_extract_epi64, _mm_or_si128, _mm256_and_si256,
    _mm256_castsi256_si128, _mm256_extracti128_si256, _mm256_loadu_si256, _mm256_or_si256,
    _mm256_setzero_si256, _mm256_sllv_epi64, _mm256_srl_epi64, _mm256_srlv_epi64, _mm256_unpackhi_epi64,
    _mm256_unpacklo_epi64,
};
use std::ops::Range;
use std::sync::atomic::AtomicU64;

use super::WindowSource;
use super::positions::{GROUP, WindowPositions};
use crate::bits::BitWriter;
use crate::grid::MAX_ROWS;

/// Number of rows in a vector.
const LANES: usize = 4;

/// Writes all three channels of some agents, or returns false if the windows are too large for this path.
pub fn pack(
    source: &WindowSource<'_>,
    agents: Range<usize>,
    lead: usize,
    apart: bool,
    words: &mut [u64],
) -> bool {
    // SAFETY: this path is only used if the machine supports it (`SimdPath::check`).
    unsafe {
        match source.radius {
            1 => pack_side::<3>(source, agents, lead, apart, words),
            2 => pack_side::<5>(source, agents, lead, apart, words),
            3 => pack_side::<7>(source, agents, lead, apart, words),
            4 => pack_side::<9>(source, agents, lead, apart, words),
            5 => pack_side::<11>(source, agents, lead, apart, words),
            _ => return false,
        }
    }
    true
}

#[target_feature(enable = "avx2")]
fn pack_side<const SIDE: usize>(
    source: &WindowSource<'_>,
    agents: Range<usize>,
    lead: usize,
    apart: bool,
    words: &mut [u64],
) {
    let num_cells = SIDE * SIDE;
    let mut writer = BitWriter::new(words, lead);
    for begin in agents.clone().step_by(GROUP) {
        let end = agents.end.min(begin + GROUP);
        let positions = WindowPositions::of::<SIDE>(source, begin..end);
        for index in 0..end - begin {
            let first = positions.first[index] as usize;
            for strips in [source.obstacles, source.occupied] {
                let rows = &strips.words()[first..first + MAX_ROWS];
                let [low, high] = window::<SIDE>(rows, positions.shift[index]);
                writer.push(low, num_cells.min(64) as u32);
                if num_cells > 64 {
                    writer.push(high, num_cells as u32 - 64);
                }
            }
            writer.push_one_of(positions.goal[index] as usize - 2 * num_cells, num_cells);
            if apart {
                writer.end_word();
            }
        }
    }
    writer.end_word();
}

/// Returns the cells of a window, row after row.
#[target_feature(enable = "avx2")]
#[inline]
fn window<const SIDE: usize>(rows: &[AtomicU64], shift: u32) -> [u64; 2] {
    let layout = const { &Layout::of(SIDE) };
    let shift = _mm_cvtsi32_si128(shift as i32);
    let (mut low, mut high) = (_mm256_setzero_si256(), _mm256_setzero_si256());
    for (rows, places) in rows.as_chunks::<LANES>().0.iter().zip(&layout.places[..SIDE.div_ceil(LANES)]) {
        // SAFETY: `rows` holds as many words as a vector. No thread writes them, since a step borrows the engine
        // mutably.
        let rows = unsafe { _mm256_loadu_si256(rows.as_ptr().cast()) };
        let rows = _mm256_and_si256(_mm256_srl_epi64(rows, shift), vector(&places.mask));
        low = _mm256_or_si256(low, _mm256_sllv_epi64(rows, vector(&places.low)));
        let above = _mm256_sllv_epi64(rows, vector(&places.high));
        let over = _mm256_srlv_epi64(rows, vector(&places.over));
        high = _mm256_or_si256(high, _mm256_or_si256(above, over));
    }
    let pairs = _mm256_or_si256(_mm256_unpacklo_epi64(low, high), _mm256_unpackhi_epi64(low, high));
    let words = _mm_or_si128(_mm256_castsi256_si128(pairs), _mm256_extracti128_si256::<1>(pairs));
    [_mm_cvtsi128_si64(words) as u64, _mm_extract_epi64::<1>(words) as u64]
}

#[target_feature(enable = "avx2")]
#[inline]
fn vector(lanes: &[u64; LANES]) -> __m256i {
    // SAFETY: the array is as large as a vector.
    unsafe { _mm256_loadu_si256(lanes.as_ptr().cast()) }
}

/// The target positions of the bits of each row of a window, which depend only on its side.
struct Layout {
    places: [Places; MAX_ROWS / LANES],
}

/// The target positions of the bits of four rows.
#[derive(Clone, Copy)]
struct Places {
    /// A mask of the bits of a row; 0 beyond the last row.
    mask: [u64; LANES],
    /// Left shift in the first word.
    low: [u64; LANES],
    /// Left shift in the second word.
    high: [u64; LANES],
    /// Right shift in the second word, for a row that begins in the first word.
    over: [u64; LANES],
}

impl Layout {
    const fn of(side: usize) -> Self {
        // A shift by 64 clears all bits.
        let none = Places { mask: [0; LANES], low: [64; LANES], high: [64; LANES], over: [64; LANES] };
        let mut places = [none; MAX_ROWS / LANES];
        // A plain loop, since constant functions cannot use iterators.
        let mut row = 0;
        while row < side {
            let (places, lane) = (&mut places[row / LANES], row % LANES);
            let begin = (row * side) as u64;
            places.mask[lane] = (1 << side) - 1;
            if begin >= 64 {
                places.high[lane] = begin - 64;
            } else {
                places.low[lane] = begin;
                if begin > 0 {
                    places.over[lane] = 64 - begin;
                }
            }
            row += 1;
        }
        Self { places }
    }
}
