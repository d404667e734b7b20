//! Conversion of bits to values with AVX2, 32 bytes at a time.

use std::arch::x86_64::{
    __m256i, _mm256_and_ps, _mm256_and_si256, _mm256_castsi256_ps, _mm256_cmpeq_epi8, _mm256_cmpeq_epi32,
    _mm256_set1_epi8, _mm256_set1_epi32, _mm256_set1_epi64x, _mm256_set1_ps, _mm256_setr_epi8,
    _mm256_setr_epi32, _mm256_shuffle_epi8, _mm256_slli_epi32, _mm256_storeu_ps, _mm256_storeu_si256,
};

use super::scalar;

const F32_PER_VECTOR: usize = 8;
const U8_PER_VECTOR: usize = 32;

pub fn spread_f32(words: &[u64], lead: usize, out: &mut [f32]) {
    let table = &scalar::FLOATS;
    let (head, body) = split(lead, out, F32_PER_VECTOR);
    scalar::spread(words, lead, head, table);
    let first = (lead + head.len()) / F32_PER_VECTOR;
    let num_vectors = body.len() / F32_PER_VECTOR;
    let (body, tail) = body.split_at_mut(num_vectors * F32_PER_VECTOR);
    // SAFETY: this path is only used if the machine has AVX2 (`SimdPath::check`). `body` holds `num_vectors` vectors,
    // and `check_enough` has checked that `words` hold a bit for each value.
    unsafe { spread_f32_vectors(words.as_ptr().cast::<u8>().add(first), num_vectors, body.as_mut_ptr()) };
    let (words, lead) = words_from(words, lead, head.len() + body.len());
    scalar::spread(words, lead, tail, table);
}

pub fn spread_u8(words: &[u64], lead: usize, out: &mut [u8]) {
    let table = &scalar::BYTES;
    let (head, body) = split(lead, out, U8_PER_VECTOR);
    scalar::spread(words, lead, head, table);
    let first = (lead + head.len()) / U8_PER_VECTOR;
    let num_vectors = body.len() / U8_PER_VECTOR;
    let (body, tail) = body.split_at_mut(num_vectors * U8_PER_VECTOR);
    // SAFETY: as in `spread_f32`.
    unsafe { spread_u8_vectors(words.as_ptr().cast::<u32>().add(first), num_vectors, body.as_mut_ptr()) };
    let (words, lead) = words_from(words, lead, head.len() + body.len());
    scalar::spread(words, lead, tail, table);
}

/// Splits a buffer into the values before the first whole vector of bits, and the rest.
fn split<V>(lead: usize, out: &mut [V], per_vector: usize) -> (&mut [V], &mut [V]) {
    let num_before = lead.next_multiple_of(per_vector) - lead;
    out.split_at_mut(num_before.min(out.len()))
}

/// Returns the words that begin with the one that holds the bit of value `index`, and the position of that bit in it.
fn words_from(words: &[u64], lead: usize, index: usize) -> (&[u64], usize) {
    let bit = lead + index;
    (&words[(bit / 64).min(words.len())..], bit % 64)
}

/// Converts `num_vectors` bytes of bits to vectors of `f32`.
///
/// # Safety
/// The machine has AVX2; `bytes` holds `num_vectors` bytes, and `out` holds `num_vectors` vectors.
#[target_feature(enable = "avx2")]
unsafe fn spread_f32_vectors(bytes: *const u8, num_vectors: usize, out: *mut f32) {
    // Four bytes at a time, since loading them takes most of the time.
    const TOGETHER: usize = 4;
    let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    let bits =
        [bits, _mm256_slli_epi32::<8>(bits), _mm256_slli_epi32::<16>(bits), _mm256_slli_epi32::<24>(bits)];
    let num_together = num_vectors - num_vectors % TOGETHER;
    for index in (0..num_together).step_by(TOGETHER) {
        // SAFETY: `index` and the three after it are below `num_vectors`.
        unsafe {
            let word = _mm256_set1_epi32(bytes.add(index).cast::<i32>().read_unaligned());
            for (offset, bits) in bits.into_iter().enumerate() {
                store_f32_vector(word, bits, out.add(F32_PER_VECTOR * (index + offset)));
            }
        }
    }
    for index in num_together..num_vectors {
        // SAFETY: `index` is below `num_vectors`.
        unsafe {
            let byte = _mm256_set1_epi32(i32::from(*bytes.add(index)));
            store_f32_vector(byte, bits[0], out.add(F32_PER_VECTOR * index));
        }
    }
}

/// Stores 1 for each set bit, and 0 for each unset bit.
///
/// # Safety
/// The machine has AVX2; `out` holds a vector.
#[target_feature(enable = "avx2")]
#[inline]
unsafe fn store_f32_vector(word: __m256i, bits: __m256i, out: *mut f32) {
    let is_set = _mm256_cmpeq_epi32(_mm256_and_si256(word, bits), bits);
    let values = _mm256_and_ps(_mm256_castsi256_ps(is_set), _mm256_set1_ps(1.0));
    // SAFETY: the caller guarantees that `out` holds a vector.
    unsafe { _mm256_storeu_ps(out, values) };
}

/// Converts `num_vectors` words of bits to vectors of `u8`.
///
/// # Safety
/// The machine has AVX2; `words` holds `num_vectors` words, and `out` holds `num_vectors` vectors.
#[target_feature(enable = "avx2")]
unsafe fn spread_u8_vectors(words: *const u32, num_vectors: usize, out: *mut u8) {
    let bits = _mm256_set1_epi64x(0x8040_2010_0804_0201_u64 as i64);
    let byte_of = byte_of_each();
    let one = _mm256_set1_epi8(1);
    for index in 0..num_vectors {
        // SAFETY: `index` is below `num_vectors`.
        unsafe {
            let word = _mm256_shuffle_epi8(_mm256_set1_epi32(*words.add(index) as i32), byte_of);
            let is_set = _mm256_cmpeq_epi8(_mm256_and_si256(word, bits), bits);
            _mm256_storeu_si256(out.add(U8_PER_VECTOR * index).cast(), _mm256_and_si256(is_set, one));
        }
    }
}

/// Returns for each of 32 values which of four bytes holds its bit.
#[target_feature(enable = "avx2")]
fn byte_of_each() -> __m256i {
    _mm256_setr_epi8(
        0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 3, 3,
    )
}
