//! Windows of up to 11 x 11 cut out eight rows at a time, and bits to values, a line of memory at a time.

use std::arch::x86_64::{
    _mm_cvtsi32_si128, _mm_cvtsi128_si64, _mm_extract_epi64, _mm_sfence, _mm512_cvtepi64_epi16,
    _mm512_mask_storeu_epi8, _mm512_mask_storeu_ps, _mm512_maskz_loadu_epi64, _mm512_maskz_mov_epi8,
    _mm512_maskz_mov_ps, _mm512_set1_epi8, _mm512_set1_ps, _mm512_srl_epi64, _mm512_store_ps,
    _mm512_store_si512, _mm512_stream_ps, _mm512_stream_si512, _pext_u64,
};
use std::ops::Range;

use crate::grid::Strips;

use super::Scene;

const F32_PER_VECTOR: usize = 16;
const U8_PER_VECTOR: usize = 64;

/// Writes all three channels of some agents, or says that the windows are too large for this.
pub fn pack(scene: &Scene<'_>, agents: Range<usize>, lead: usize, apart: bool, words: &mut [u64]) -> bool {
    // SAFETY: the path is only taken where its features are there (`Path::check`).
    unsafe {
        match scene.radius {
            1 => pack_side::<3>(scene, agents, lead, apart, words),
            2 => pack_side::<5>(scene, agents, lead, apart, words),
            3 => pack_side::<7>(scene, agents, lead, apart, words),
            4 => pack_side::<9>(scene, agents, lead, apart, words),
            5 => pack_side::<11>(scene, agents, lead, apart, words),
            _ => return false,
        }
    }
    true
}

/// Words that the bits of one agent can touch, if they may begin at any bit of the first one.
const fn most_words(side: usize, apart: bool) -> usize {
    let before = if apart { 0 } else { 63 };
    (3 * side * side + before).div_ceil(64)
}

#[target_feature(enable = "avx512f,avx512bw,avx512vl,bmi2")]
fn pack_side<const SIDE: usize>(
    scene: &Scene<'_>,
    agents: Range<usize>,
    lead: usize,
    apart: bool,
    words: &mut [u64],
) {
    let area = SIDE * SIDE;
    let mut bit = lead;
    // A word keeps what stands in it, so the first one has to be empty.
    words[0] = 0;
    for agent in agents {
        let cell = scene.cells[agent];
        let (row, col) = (usize::from(cell.row), usize::from(cell.col));
        let obstacles = window::<SIDE>(scene.obstacles, row, col);
        let occupied = window::<SIDE>(scene.occupied, row, col);
        let low = obstacles | occupied << area;
        let high = occupied >> (128 - area);
        let parts = [low as u64, (low >> 64) as u64, high as u64, (high >> 64) as u64];
        let (first, shift) = (bit / 64, bit % 64);
        let out = &mut words[first..first + most_words(SIDE, apart)];
        let mut carry = out[0];
        for (index, word) in out.iter_mut().enumerate() {
            let part = if index < 4 { parts[index] } else { 0 };
            *word = part << shift | carry;
            carry = part >> 1 >> (63 - shift);
        }
        let goal = bit + 2 * area + scene.goal_index(agent);
        words[goal / 64] |= 1 << (goal % 64);
        bit += 3 * area;
        if apart {
            bit = bit.next_multiple_of(64);
            if let Some(next) = words.get_mut(bit / 64) {
                *next = 0;
            }
        }
    }
}

/// The bits of a window, row by row.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,bmi2")]
#[inline]
fn window<const SIDE: usize>(strips: &Strips, row: usize, col: usize) -> u128 {
    let (words, shift) = strips.window(row, col);
    let words = &words[..SIDE];
    let shift = _mm_cvtsi32_si128(shift as i32);
    // Four rows in a word, 16 bits each, of which the first SIDE are wanted.
    let wanted = 0x0001_0001_0001_0001 * ((1u64 << SIDE) - 1);
    let mut bits = 0u128;
    for first in (0..SIDE).step_by(8) {
        let num_rows = if SIDE - first < 8 { SIDE - first } else { 8 };
        let is_row = ((1u32 << num_rows) - 1) as u8;
        // SAFETY: the mask lets only rows below SIDE be read, and `words` holds SIDE. No thread writes them, since
        // a step borrows the engine mutably.
        let rows = unsafe { _mm512_maskz_loadu_epi64(is_row, words.as_ptr().add(first).cast()) };
        let rows = _mm512_cvtepi64_epi16(_mm512_srl_epi64(rows, shift));
        let four = _pext_u64(_mm_cvtsi128_si64(rows) as u64, wanted);
        bits |= u128::from(four) << (first * SIDE);
        if num_rows > 4 {
            let four = _pext_u64(_mm_extract_epi64::<1>(rows) as u64, wanted);
            bits |= u128::from(four) << ((first + 4) * SIDE);
        }
    }
    bits
}

pub fn spread_f32(words: &[u64], lead: usize, out: &mut [f32], beyond_cache: bool) {
    // SAFETY: the path is only taken where AVX-512 is there (`Path::check`), and `check_enough` has seen that
    // `words` hold a bit for each value.
    unsafe { spread_f32_lines(words, lead, out, beyond_cache) }
}

pub fn spread_u8(words: &[u64], lead: usize, out: &mut [u8], beyond_cache: bool) {
    // SAFETY: as in `spread_f32`.
    unsafe { spread_u8_lines(words, lead, out, beyond_cache) }
}

/// # Safety
/// `words` hold `lead` bits and one for each value.
#[target_feature(enable = "avx512f,avx512bw")]
unsafe fn spread_f32_lines(words: &[u64], lead: usize, out: &mut [f32], beyond_cache: bool) {
    let lead_lines = lead / F32_PER_VECTOR;
    let lead = lead % F32_PER_VECTOR;
    let one = _mm512_set1_ps(1.0);
    let end = lead + out.len();
    // SAFETY: there are `end` bits after the lines that are left out.
    let masks = unsafe { words.as_ptr().cast::<u16>().add(lead_lines) };
    // May point before `out`: whatever lies there is masked.
    let lines = out.as_mut_ptr().wrapping_sub(lead);
    let num_lines = end.div_ceil(F32_PER_VECTOR);
    let may_align = lines.addr().is_multiple_of(64);
    for line in 0..num_lines {
        let first = line * F32_PER_VECTOR;
        // SAFETY: `line` is below `num_lines`; the mask leaves out what lies before or after `out`.
        unsafe {
            let values = _mm512_maskz_mov_ps(*masks.add(line), one);
            let place = lines.wrapping_add(first);
            if may_align && first >= lead && first + F32_PER_VECTOR <= end {
                if beyond_cache {
                    _mm512_stream_ps(place, values);
                } else {
                    _mm512_store_ps(place, values);
                }
            } else {
                let mut inside = u16::MAX;
                if first < lead {
                    inside <<= lead - first;
                }
                if end - first < F32_PER_VECTOR {
                    inside &= (1 << (end - first)) - 1;
                }
                _mm512_mask_storeu_ps(place, inside, values);
            }
        }
    }
    if beyond_cache {
        _mm_sfence();
    }
}

/// # Safety
/// `words` hold `lead` bits and one for each value.
#[target_feature(enable = "avx512f,avx512bw")]
unsafe fn spread_u8_lines(words: &[u64], lead: usize, out: &mut [u8], beyond_cache: bool) {
    let one = _mm512_set1_epi8(1);
    let end = lead + out.len();
    // May point before `out`: whatever lies there is masked.
    let lines = out.as_mut_ptr().wrapping_sub(lead);
    let may_align = lines.addr().is_multiple_of(64);
    for (line, &mask) in words[..end.div_ceil(U8_PER_VECTOR)].iter().enumerate() {
        let first = line * U8_PER_VECTOR;
        // SAFETY: the mask leaves out what lies before or after `out`.
        unsafe {
            let values = _mm512_maskz_mov_epi8(mask, one);
            let place = lines.wrapping_add(first);
            if may_align && first >= lead && first + U8_PER_VECTOR <= end {
                if beyond_cache {
                    _mm512_stream_si512(place.cast(), values);
                } else {
                    _mm512_store_si512(place.cast(), values);
                }
            } else {
                let mut inside = u64::MAX;
                if first < lead {
                    inside <<= lead - first;
                }
                if end - first < U8_PER_VECTOR {
                    inside &= (1 << (end - first)) - 1;
                }
                _mm512_mask_storeu_epi8(place.cast(), inside, values);
            }
        }
    }
    if beyond_cache {
        _mm_sfence();
    }
}
