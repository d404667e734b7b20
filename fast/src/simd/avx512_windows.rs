//! Windows of up to 11 x 11, cut out of the strips.
//!
//! All of it happens in vectors. Rows of a window are brought to 16 bits each, then pairs and fours of them are pushed
//! together, and what is left, up to six parts, is put where it belongs in the words of the agent. The whole record is
//! then shifted to the bit where the one before ended.

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
use super::sights::{GROUP, Sights};
use super::{MOST_WORDS, WindowSource};
use crate::grid::MOST_ROWS;

/// Writes all three channels of some agents, or says that the windows are too large for this.
pub fn pack(
    scene: &WindowSource<'_>,
    agents: Range<usize>,
    lead: usize,
    apart: bool,
    words: &mut [u64],
) -> bool {
    // SAFETY: the path is only taken where its features are there (`SimdPath::check`).
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
fn pack_on<const SIDE: usize>(
    scene: &WindowSource<'_>,
    agents: Range<usize>,
    lead: usize,
    words: &mut [u64],
) {
    let mut bit = lead;
    words[bit / 64] = 0;
    for begin in agents.clone().step_by(GROUP) {
        let end = agents.end.min(begin + GROUP);
        let sights = Sights::of::<SIDE>(scene, begin..end);
        let first_bit = bit;
        // The word in which the agent before ended.
        let mut carry = _mm512_zextsi128_si512(_mm_cvtsi64_si128(words[bit / 64] as i64));
        for index in 0..end - begin {
            let record = record::<SIDE, false>(scene, &sights, index);
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
        for (goal, record) in sights.goal[..end - begin].iter().zip((first_bit..).step_by(3 * SIDE * SIDE)) {
            let goal = record + *goal as usize;
            words[goal / 64] |= 1 << (goal % 64);
        }
    }
}

/// Each agent's bits in words of its own.
#[target_feature(enable = "avx512f,avx512bw")]
fn pack_apart<const SIDE: usize, const WORDS: usize>(
    scene: &WindowSource<'_>,
    agents: Range<usize>,
    words: &mut [u64],
) {
    let outs = words.as_chunks_mut::<WORDS>().0.chunks_mut(GROUP);
    for (begin, outs) in agents.clone().step_by(GROUP).zip(outs) {
        let sights = Sights::of::<SIDE>(scene, begin..agents.end.min(begin + GROUP));
        for (index, out) in outs.iter_mut().enumerate() {
            let record = record::<SIDE, true>(scene, &sights, index);
            // SAFETY: the mask leaves out what lies after `out`.
            unsafe { _mm512_mask_storeu_epi64(out.as_mut_ptr().cast(), (1 << WORDS) - 1, record) };
        }
        for (goal, out) in sights.goal.iter().zip(outs) {
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

/// All bits of an agent. `APART` only makes each caller's copy its own, so that it is put in place there.
#[target_feature(enable = "avx512f,avx512bw")]
#[inline]
fn record<const SIDE: usize, const APART: bool>(
    scene: &WindowSource<'_>,
    sights: &Sights,
    index: usize,
) -> __m512i {
    let first = sights.first[index] as usize;
    let obstacles = &scene.obstacles.words()[first..first + MOST_ROWS];
    let occupied = &scene.occupied.words()[first..first + MOST_ROWS];
    let parts = parts::<SIDE>(obstacles, occupied, sights.shift[index]);
    let mut record = _mm512_setzero_si512();
    let layout = const { &Layout::of(SIDE) };
    for term in &layout.terms[..layout.num_terms] {
        let moved =
            _mm512_rolv_epi64(_mm512_permutexvar_epi64(vector(&term.lane), parts), vector(&term.turn));
        record = _mm512_ternarylogic_epi64::<OR_AND>(record, moved, vector(&term.mask));
    }
    record
}

/// The rows of both windows by fours: lane by lane rows 0 to 3 and 4 to 7 of the obstacles, the same of the agents, then
/// the last rows of the obstacles and of the agents. Above their bits lanes hold anything.
#[target_feature(enable = "avx512f,avx512bw")]
#[inline]
fn parts<const SIDE: usize>(obstacles: &[AtomicU64], occupied: &[AtomicU64], shift: u32) -> __m512i {
    let shift = _mm_cvtsi32_si128(shift as i32);
    let (obstacles, occupied) = (obstacles.as_ptr().cast::<i64>(), occupied.as_ptr().cast::<i64>());
    // SAFETY: the caller has cut out MOST_ROWS words, a vector and a half. No thread writes them, since a step borrows
    // the engine mutably.
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
    let rows = _mm512_and_si512(rows, words(&layout.is_wanted));
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
