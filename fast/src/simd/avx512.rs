//! Conversion of bits to values with AVX-512, one cache line at a time.

use std::arch::x86_64::{
    _mm_sfence, _mm512_mask_storeu_epi8, _mm512_mask_storeu_ps, _mm512_maskz_mov_epi8, _mm512_maskz_mov_ps,
    _mm512_set1_epi8, _mm512_set1_ps, _mm512_store_ps, _mm512_store_si512, _mm512_stream_ps,
    _mm512_stream_si512,
};
use std::ops::Range;

use super::per_line;

const F32_PER_LINE: usize = per_line::<f32>();
const U8_PER_LINE: usize = per_line::<u8>();

pub fn spread_f32(words: &[u64], lead: usize, out: &mut [f32], streaming: bool) {
    // SAFETY: this path is only used if the machine has AVX-512 (`SimdPath::check`), and `check_enough` has checked
    // that `words` hold a bit for each value.
    unsafe {
        if streaming {
            spread_f32_lines::<true>(words, lead, out);
        } else {
            spread_f32_lines::<false>(words, lead, out);
        }
    }
}

pub fn spread_u8(words: &[u64], lead: usize, out: &mut [u8], streaming: bool) {
    // SAFETY: as in `spread_f32`.
    unsafe {
        if streaming {
            spread_u8_lines::<true>(words, lead, out);
        } else {
            spread_u8_lines::<false>(words, lead, out);
        }
    }
}

/// Converts bits to values of `f32`, one cache line at a time.
///
/// # Safety
/// The machine has AVX-512 F and BW; `words` hold `lead` bits and one bit for each value.
#[target_feature(enable = "avx512f,avx512bw")]
unsafe fn spread_f32_lines<const STREAMING: bool>(words: &[u64], lead: usize, out: &mut [f32]) {
    let one = _mm512_set1_ps(1.0);
    let masks = words.as_ptr().cast::<u16>();
    let lines = Lines::of(out, lead);
    for (line, inside) in lines.cut {
        // SAFETY: the line holds values of `out`, and the mask excludes everything before and after `out`.
        unsafe {
            let values = _mm512_maskz_mov_ps(*masks.add(line), one);
            _mm512_mask_storeu_ps(lines.start.wrapping_add(line * F32_PER_LINE), inside as u16, values);
        }
    }
    for line in lines.whole {
        // SAFETY: the whole line lies in `out`, and `Lines` guarantees that it is aligned.
        unsafe {
            let values = _mm512_maskz_mov_ps(*masks.add(line), one);
            let place = lines.start.wrapping_add(line * F32_PER_LINE);
            if STREAMING { _mm512_stream_ps(place, values) } else { _mm512_store_ps(place, values) }
        }
    }
    if STREAMING {
        _mm_sfence();
    }
}

/// Converts bits to values of `u8`, one cache line at a time.
///
/// # Safety
/// The machine has AVX-512 F and BW; `words` hold `lead` bits and one bit for each value.
#[target_feature(enable = "avx512f,avx512bw")]
unsafe fn spread_u8_lines<const STREAMING: bool>(words: &[u64], lead: usize, out: &mut [u8]) {
    let one = _mm512_set1_epi8(1);
    let masks = words.as_ptr();
    let lines = Lines::of(out, lead);
    for (line, inside) in lines.cut {
        // SAFETY: the line holds values of `out`, and the mask excludes everything before and after `out`.
        unsafe {
            let values = _mm512_maskz_mov_epi8(*masks.add(line), one);
            _mm512_mask_storeu_epi8(lines.start.wrapping_add(line * U8_PER_LINE).cast(), inside, values);
        }
    }
    for line in lines.whole {
        // SAFETY: the whole line lies in `out`, and `Lines` guarantees that it is aligned.
        unsafe {
            let values = _mm512_maskz_mov_epi8(*masks.add(line), one);
            let place = lines.start.wrapping_add(line * U8_PER_LINE).cast();
            if STREAMING { _mm512_stream_si512(place, values) } else { _mm512_store_si512(place, values) }
        }
    }
    if STREAMING {
        _mm_sfence();
    }
}

/// The cache lines of a buffer.
struct Lines<V> {
    /// The start of the line that holds bit 0; it may lie before the buffer.
    start: *mut V,
    /// The lines that the buffer fills completely.
    whole: Range<usize>,
    /// The first and the last line, with a mask of the values that lie in the buffer.
    cut: [(usize, u64); 2],
}

impl<V> Lines<V> {
    /// Returns the lines of a buffer whose first value is at bit `lead`.
    fn of(out: &mut [V], lead: usize) -> Self {
        let per_line = per_line::<V>();
        let (start, end) = (out.as_mut_ptr().wrapping_sub(lead), lead + out.len());
        assert!(
            start.addr().is_multiple_of(64) && !out.is_empty(),
            "the buffer is empty, or the lead does not align it"
        );
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
