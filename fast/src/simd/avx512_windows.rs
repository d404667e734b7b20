//! Extraction of windows of up to 11 x 11 from the strips with AVX-512.
//!
//! The rows of a window are reduced to 16 bits each, then joined into pairs and into groups of four. These parts, up to
//! six, are moved to their positions in the words of the agent (the record). If records are contiguous, the whole
//! record is then shifted to the bit where the previous one ends. Scalar code sets the bits of goals.

use std::arch::x86_64::{
    __m512i, _mm_cvtsi32_si128, _mm_cvtsi64_si128, _mm256_loadu_si256, _mm512_and_si512,
    _mm512_castsi256_si512, _mm512_inserti64x4, _mm512_loadu_epi64, _mm512_loadu_si512, _mm512_madd_epi16,
    _mm512_mask_storeu_epi64, _mm512_maskz_alignr_epi64, _mm512_maskz_permutexvar_epi64,
    _mm512_permutex2var_epi16, _mm512_permutexvar_epi64, _mm512_rolv_epi64, _mm512_set1_epi64,
    _mm512_setzero_si512, _mm512_sll_epi64, _mm512_srl_epi64, _mm512_storeu_si512, _mm512_ternarylogic_epi64,
    _mm512_zextsi128_si512,
};
use std::ops::Range;
use std::sync::atomic::AtomicU64;

use super::avx512_layout::{LANES, Layout};
use super::positions::{GROUP, WindowPositions};
use super::{MAX_WORDS, WindowSource};
use crate::grid::MAX_ROWS;

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
        match (source.radius, apart) {
            (1, false) => pack_contiguous::<3>(source, agents, lead, words),
            (2, false) => pack_contiguous::<5>(source, agents, lead, words),
            (3, false) => pack_contiguous::<7>(source, agents, lead, words),
            (4, false) => pack_contiguous::<9>(source, agents, lead, words),
            (5, false) => pack_contiguous::<11>(source, agents, lead, words),
            (1, true) => pack_apart::<3, 1>(source, agents, words),
            (2, true) => pack_apart::<5, 2>(source, agents, words),
            (3, true) => pack_apart::<7, 3>(source, agents, words),
            (4, true) => pack_apart::<9, 4>(source, agents, words),
            (5, true) => pack_apart::<11, 6>(source, agents, words),
            _ => return false,
        }
    }
    true
}

/// Writes each agent's bits directly after those of the previous agent.
#[target_feature(enable = "avx512f,avx512bw")]
fn pack_contiguous<const SIDE: usize>(
    source: &WindowSource<'_>,
    agents: Range<usize>,
    lead: usize,
    words: &mut [u64],
) {
    let mut bit = lead;
    words[bit / 64] = 0;
    for begin in agents.clone().step_by(GROUP) {
        let end = agents.end.min(begin + GROUP);
        let positions = WindowPositions::of::<SIDE>(source, begin..end);
        let first_bit = bit;
        // The word in which the bits of the previous agent end.
        let mut carry = _mm512_zextsi128_si512(_mm_cvtsi64_si128(words[bit / 64] as i64));
        for index in 0..end - begin {
            let record = record::<SIDE, false>(source, &positions, index);
            let (first, shift) = (bit / 64, bit % 64);
            let left = _mm512_sll_epi64(record, _mm_cvtsi32_si128(shift as i32));
            // Bits that are shifted out of a word continue in the next word.
            let below = _mm512_maskz_alignr_epi64::<7>(0xfe, record, record);
            let right = _mm512_srl_epi64(below, _mm_cvtsi32_si128(64 - shift as i32));
            let shifted = _mm512_ternarylogic_epi64::<OR>(left, right, carry);
            let out: &mut [u64] = &mut words[first..first + MAX_WORDS];
            // SAFETY: `out` holds as many words as a vector.
            unsafe { _mm512_storeu_si512(out.as_mut_ptr().cast(), shifted) };
            bit += 3 * SIDE * SIDE;
            let last = _mm512_set1_epi64((bit / 64 - first) as i64);
            carry = _mm512_maskz_permutexvar_epi64(1, last, shifted);
        }
        for (goal, record) in positions.goal[..end - begin].iter().zip((first_bit..).step_by(3 * SIDE * SIDE))
        {
            let goal = record + *goal as usize;
            words[goal / 64] |= 1 << (goal % 64);
        }
    }
}

/// Writes each agent's bits into separate words.
#[target_feature(enable = "avx512f,avx512bw")]
fn pack_apart<const SIDE: usize, const WORDS: usize>(
    source: &WindowSource<'_>,
    agents: Range<usize>,
    words: &mut [u64],
) {
    let outs = words.as_chunks_mut::<WORDS>().0.chunks_mut(GROUP);
    for (begin, outs) in agents.clone().step_by(GROUP).zip(outs) {
        let positions = WindowPositions::of::<SIDE>(source, begin..agents.end.min(begin + GROUP));
        for (index, out) in outs.iter_mut().enumerate() {
            let record = record::<SIDE, true>(source, &positions, index);
            // SAFETY: the mask excludes everything after `out`.
            unsafe { _mm512_mask_storeu_epi64(out.as_mut_ptr().cast(), (1 << WORDS) - 1, record) };
        }
        for (goal, out) in positions.goal.iter().zip(outs) {
            let goal = *goal as usize;
            out[goal / 64] |= 1 << (goal % 64);
        }
    }
}

/// `a | b | c`.
const OR: i32 = 0xfe;
/// `a | b & c`.
const OR_AND: i32 = 0xf8;
/// `a ? b : c`, bit by bit.
const CHOOSE: i32 = 0xca;

/// Returns the bits of an agent's obstacle and agent windows. The callers set the bit of the goal.
///
/// `APART` is not read: it gives each caller a separate copy of the function, which is then inlined.
#[target_feature(enable = "avx512f,avx512bw")]
#[inline]
fn record<const SIDE: usize, const APART: bool>(
    source: &WindowSource<'_>,
    positions: &WindowPositions,
    index: usize,
) -> __m512i {
    let first = positions.first[index] as usize;
    let obstacles = &source.obstacles.words()[first..first + MAX_ROWS];
    let occupied = &source.occupied.words()[first..first + MAX_ROWS];
    let parts = parts::<SIDE>(obstacles, occupied, positions.shift[index]);
    let mut record = _mm512_setzero_si512();
    let layout = const { &Layout::of(SIDE) };
    for term in &layout.terms[..layout.num_terms] {
        let moved =
            _mm512_rolv_epi64(_mm512_permutexvar_epi64(vector(&term.lane), parts), vector(&term.rotation));
        record = _mm512_ternarylogic_epi64::<OR_AND>(record, moved, vector(&term.mask));
    }
    record
}

/// Returns the rows of both windows in groups of four.
///
/// The lanes hold rows 0 to 3 and 4 to 7 of the obstacles, the same rows of the agents, then the last rows of the
/// obstacles and of the agents. The upper bits of a lane are arbitrary.
#[target_feature(enable = "avx512f,avx512bw")]
#[inline]
fn parts<const SIDE: usize>(obstacles: &[AtomicU64], occupied: &[AtomicU64], shift: u32) -> __m512i {
    let shift = _mm_cvtsi32_si128(shift as i32);
    let (obstacles, occupied) = (obstacles.as_ptr().cast::<i64>(), occupied.as_ptr().cast::<i64>());
    // SAFETY: the caller passes MAX_ROWS words, a vector and a half. No thread writes them, since a step borrows the
    // engine mutably.
    let (first, second) = unsafe { (_mm512_loadu_epi64(obstacles), _mm512_loadu_epi64(occupied)) };
    let (first, second) = (_mm512_srl_epi64(first, shift), _mm512_srl_epi64(second, shift));
    let layout = const { &Layout::of(SIDE) };
    let mut rows = _mm512_permutex2var_epi16(first, words(&layout.first_rows), second);
    if SIDE > LANES {
        // SAFETY: as above.
        let (first, second) = unsafe {
            let (first, second) = (obstacles.add(LANES).cast(), occupied.add(LANES).cast());
            (_mm256_loadu_si256(first), _mm256_loadu_si256(second))
        };
        let last = _mm512_inserti64x4::<1>(_mm512_castsi256_si512(first), second);
        rows = _mm512_permutex2var_epi16(rows, words(&layout.last_rows), _mm512_srl_epi64(last, shift));
    }
    let rows = _mm512_and_si512(rows, words(&layout.row_mask));
    let pairs = _mm512_madd_epi16(rows, words(&layout.pair));
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
