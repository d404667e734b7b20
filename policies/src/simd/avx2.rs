//! The kernels with AVX2 and FMA.

use std::arch::x86_64::{
    __m256, _mm256_add_ps, _mm256_fmadd_ps, _mm256_loadu_ps, _mm256_max_ps, _mm256_set1_ps,
    _mm256_setzero_ps, _mm256_storeu_ps,
};

use super::agents::{self, MultiplyAgents};
use super::kernels::{self, Convolve, Multiply};
use super::vector::Vector;

#[derive(Clone, Copy)]
pub struct Avx2(__m256);

// SAFETY of all blocks: the functions below and those for AVX-512 enable AVX2 and FMA, and only they use this type.
// Callers pass valid pointers.
#[allow(clippy::inline_always, reason = "so that they are compiled with the features of their caller")]
#[allow(clippy::undocumented_unsafe_blocks, reason = "see the comment above")]
impl Vector for Avx2 {
    const COUNT: usize = 8;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        Self(unsafe { _mm256_set1_ps(value) })
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        Self(unsafe { _mm256_loadu_ps(from) })
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe { _mm256_storeu_ps(to, self.0) }
    }

    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        Self(unsafe { _mm256_add_ps(self.0, other.0) })
    }

    #[inline(always)]
    unsafe fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(unsafe { _mm256_fmadd_ps(self.0, factor.0, addend.0) })
    }

    #[inline(always)]
    unsafe fn relu(self) -> Self {
        // For two zeros, or with NaN, the instruction returns its second operand.
        Self(unsafe { _mm256_max_ps(_mm256_setzero_ps(), self.0) })
    }
}

/// # Safety
/// The machine supports AVX2 and FMA, and the job was checked.
#[target_feature(enable = "avx2,fma")]
pub unsafe fn convolve(job: &mut Convolve<'_>) {
    // SAFETY: as above.
    unsafe { kernels::convolve::<Avx2, 2, Avx2>(job) }
}

/// # Safety
/// The machine supports AVX2 and FMA, and the job was checked.
#[target_feature(enable = "avx2,fma")]
pub unsafe fn multiply(job: &mut Multiply<'_>) {
    // SAFETY: as above.
    unsafe { kernels::multiply::<Avx2>(job) }
}

/// # Safety
/// The machine supports AVX2 and FMA, and the job was checked.
#[target_feature(enable = "avx2,fma")]
pub unsafe fn convolve_agents(job: &mut Convolve<'_>) {
    // SAFETY: as above.
    unsafe { agents::convolve::<Avx2, 2, 4>(job) }
}

/// # Safety
/// The machine supports AVX2 and FMA, and the job was checked.
#[target_feature(enable = "avx2,fma")]
pub unsafe fn convolve_half(job: &mut Convolve<'_>) {
    // SAFETY: as above.
    unsafe { agents::convolve::<Avx2, 1, 8>(job) }
}

/// # Safety
/// The machine supports AVX2 and FMA, and the job was checked.
#[target_feature(enable = "avx2,fma")]
pub unsafe fn multiply_agents(job: &mut MultiplyAgents<'_>) {
    // SAFETY: as above.
    unsafe { agents::multiply::<Avx2, 2, 1>(job) }
}

/// # Safety
/// The machine supports AVX2 and FMA, and the job was checked.
#[target_feature(enable = "avx2,fma")]
pub unsafe fn multiply_half(job: &mut MultiplyAgents<'_>) {
    // SAFETY: as above.
    unsafe { agents::multiply::<Avx2, 1, 2>(job) }
}
