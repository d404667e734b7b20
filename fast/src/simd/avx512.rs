//! Windows of up to 11 x 11 cut out eight rows at a time, and bits to values, a line of memory at a time.

use std::arch::x86_64::{
    _mm_cvtsi32_si128, _mm_cvtsi128_si64, _mm_extract_epi64, _mm_sfence, _mm512_cvtepi64_epi16,
    _mm512_mask_storeu_epi8, _mm512_mask_storeu_ps, _mm512_maskz_loadu_epi64, _mm512_maskz_mov_epi8,
    _mm512_maskz_mov_ps, _mm512_set1_epi8, _mm512_set1_ps, _mm512_srl_epi64, _mm512_store_ps,
    _mm512_store_si512, _mm512_stream_ps, _mm512_stream_si512, _pext_u64,
};
use std::ops::Range;

use crate::grid::Strips;

use super::{MOST_WORDS, Scene, per_line};

const F32_PER_LINE: usize = per_line::<f32>();
const U8_PER_LINE: usize = per_line::<u8>();

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
#[target_feature(enable = "avx512f,avx512bw,avx512vl,bmi2")]
fn pack_on<const SIDE: usize>(scene: &Scene<'_>, agents: Range<usize>, lead: usize, words: &mut [u64]) {
    let area = SIDE * SIDE;
    let mut bit = lead;
    // The first word of an agent keeps what stands in it already.
    words[0] = 0;
    for agent in agents {
        let parts = windows::<SIDE>(scene, agent);
        let (first, shift) = (bit / 64, bit % 64);
        let carry = |part: u64| part >> 1 >> (63 - shift);
        let out = &mut words[first..first + MOST_WORDS];
        out[0] |= parts[0] << shift;
        out[1] = carry(parts[0]) | parts[1] << shift;
        out[2] = carry(parts[1]) | parts[2] << shift;
        out[3] = carry(parts[2]) | parts[3] << shift;
        out[4] = carry(parts[3]);
        out[5] = 0;
        out[6] = 0;
        let goal = shift + 2 * area + scene.goal_index(agent);
        out[(goal / 64).min(MOST_WORDS - 1)] |= 1 << (goal % 64);
        bit += 3 * area;
    }
}

/// Each agent's bits in words of its own.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,bmi2")]
fn pack_apart<const SIDE: usize, const WORDS: usize>(
    scene: &Scene<'_>,
    agents: Range<usize>,
    words: &mut [u64],
) {
    let area = SIDE * SIDE;
    for (agent, out) in agents.zip(words.as_chunks_mut::<WORDS>().0) {
        let parts = windows::<SIDE>(scene, agent);
        *out = std::array::from_fn(|index| if index < 4 { parts[index] } else { 0 });
        let goal = 2 * area + scene.goal_index(agent);
        out[goal / 64] |= 1 << (goal % 64);
    }
}

/// The bits of an agent's first two channels.
#[target_feature(enable = "avx512f,avx512bw,avx512vl,bmi2")]
#[inline]
fn windows<const SIDE: usize>(scene: &Scene<'_>, agent: usize) -> [u64; 4] {
    let area = SIDE * SIDE;
    let cell = scene.cells[agent];
    let (row, col) = (usize::from(cell.row), usize::from(cell.col));
    let obstacles = window::<SIDE>(scene.obstacles, row, col);
    let occupied = window::<SIDE>(scene.occupied, row, col);
    let low = obstacles | occupied << area;
    let high = occupied >> (128 - area);
    [low as u64, (low >> 64) as u64, high as u64, (high >> 64) as u64]
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
    unsafe {
        if beyond_cache {
            spread_f32_lines::<true>(words, lead, out);
        } else {
            spread_f32_lines::<false>(words, lead, out);
        }
    }
}

pub fn spread_u8(words: &[u64], lead: usize, out: &mut [u8], beyond_cache: bool) {
    // SAFETY: as in `spread_f32`.
    unsafe {
        if beyond_cache {
            spread_u8_lines::<true>(words, lead, out);
        } else {
            spread_u8_lines::<false>(words, lead, out);
        }
    }
}

/// # Safety
/// `words` hold `lead` bits and one for each value.
#[target_feature(enable = "avx512f,avx512bw")]
unsafe fn spread_f32_lines<const AROUND_CACHE: bool>(words: &[u64], lead: usize, out: &mut [f32]) {
    let one = _mm512_set1_ps(1.0);
    let masks = words.as_ptr().cast::<u16>();
    let lines = Lines::of(out, lead);
    for (line, inside) in lines.cut {
        // SAFETY: the line holds values of `out`, and the mask leaves out what lies before or after it.
        unsafe {
            let values = _mm512_maskz_mov_ps(*masks.add(line), one);
            _mm512_mask_storeu_ps(lines.start.wrapping_add(line * F32_PER_LINE), inside as u16, values);
        }
    }
    for line in lines.whole {
        // SAFETY: the whole line lies in `out` and, as `Lines` says, at its place in memory.
        unsafe {
            let values = _mm512_maskz_mov_ps(*masks.add(line), one);
            let place = lines.start.wrapping_add(line * F32_PER_LINE);
            if AROUND_CACHE { _mm512_stream_ps(place, values) } else { _mm512_store_ps(place, values) }
        }
    }
    if AROUND_CACHE {
        _mm_sfence();
    }
}

/// # Safety
/// `words` hold `lead` bits and one for each value.
#[target_feature(enable = "avx512f,avx512bw")]
unsafe fn spread_u8_lines<const AROUND_CACHE: bool>(words: &[u64], lead: usize, out: &mut [u8]) {
    let one = _mm512_set1_epi8(1);
    let masks = words.as_ptr();
    let lines = Lines::of(out, lead);
    for (line, inside) in lines.cut {
        // SAFETY: the line holds values of `out`, and the mask leaves out what lies before or after it.
        unsafe {
            let values = _mm512_maskz_mov_epi8(*masks.add(line), one);
            _mm512_mask_storeu_epi8(lines.start.wrapping_add(line * U8_PER_LINE).cast(), inside, values);
        }
    }
    for line in lines.whole {
        // SAFETY: the whole line lies in `out` and, as `Lines` says, at its place in memory.
        unsafe {
            let values = _mm512_maskz_mov_epi8(*masks.add(line), one);
            let place = lines.start.wrapping_add(line * U8_PER_LINE).cast();
            if AROUND_CACHE { _mm512_stream_si512(place, values) } else { _mm512_store_si512(place, values) }
        }
    }
    if AROUND_CACHE {
        _mm_sfence();
    }
}

/// The lines of memory that a buffer lies in.
struct Lines<V> {
    /// Where the line begins that holds bit 0; it may lie before the buffer.
    start: *mut V,
    /// The lines that the buffer fills.
    whole: Range<usize>,
    /// The first and the last line, with a mask of the values that lie in the buffer.
    cut: [(usize, u64); 2],
}

impl<V> Lines<V> {
    /// The lines of a buffer whose first value is at bit `lead`.
    fn of(out: &mut [V], lead: usize) -> Self {
        let per_line = per_line::<V>();
        let (start, end) = (out.as_mut_ptr().wrapping_sub(lead), lead + out.len());
        assert!(start.addr().is_multiple_of(64) && !out.is_empty(), "the lead leads to no line of memory");
        let (first, last) = (lead / per_line, (end - 1) / per_line);
        let inside = |line: usize| {
            let begin = lead.saturating_sub(line * per_line);
            let behind = per_line - (end - line * per_line).min(per_line);
            (u64::MAX << begin) & (u64::MAX >> (64 - per_line) >> behind)
        };
        let whole = lead.div_ceil(per_line)..end / per_line;
        Self { start, whole, cut: [(first, inside(first)), (last, inside(last))] }
    }
}
