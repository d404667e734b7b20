//! The kernels with AVX-512.

use std::arch::x86_64::{
    __m512, _mm512_add_ps, _mm512_fmadd_ps, _mm512_loadu_ps, _mm512_max_ps, _mm512_set1_ps,
    _mm512_setzero_ps, _mm512_storeu_ps,
};

use super::agents::{self, MultiplyAgents};
use super::avx2::Avx2;
use super::kernels::{self, Convolve};
use super::vector::Vector;

#[derive(Clone, Copy)]
struct Avx512(__m512);

// SAFETY of all blocks: the functions below enable AVX-512 F, and only they use this type. Callers pass valid pointers.
#[allow(clippy::inline_always, reason = "so that they are compiled with the features of their caller")]
#[allow(clippy::undocumented_unsafe_blocks, reason = "see the comment above")]
impl Vector for Avx512 {
    const COUNT: usize = 16;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        Self(unsafe { _mm512_set1_ps(value) })
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        Self(unsafe { _mm512_loadu_ps(from) })
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe { _mm512_storeu_ps(to, self.0) }
    }

    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        Self(unsafe { _mm512_add_ps(self.0, other.0) })
    }

    #[inline(always)]
    unsafe fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(unsafe { _mm512_fmadd_ps(self.0, factor.0, addend.0) })
    }

    #[inline(always)]
    unsafe fn relu(self) -> Self {
        // For two zeros, or with NaN, the instruction returns its second operand.
        Self(unsafe { _mm512_max_ps(_mm512_setzero_ps(), self.0) })
    }
}

/// # Safety
/// The machine supports AVX-512 F, AVX2 and FMA, and the job was checked.
#[target_feature(enable = "avx512f,avx2,fma")]
pub unsafe fn convolve(job: &mut Convolve<'_>) {
    // SAFETY: as above.
    unsafe { kernels::convolve::<Avx512, 1, Avx2>(job) }
}

/// # Safety
/// The machine supports AVX-512 F, and the job was checked.
#[target_feature(enable = "avx512f")]
pub unsafe fn convolve_agents(job: &mut Convolve<'_>) {
    // SAFETY: as above.
    unsafe { agents::convolve::<Avx512, 1, 8>(job) }
}

/// # Safety
/// The machine supports AVX-512 F, and the job was checked.
#[target_feature(enable = "avx512f")]
pub unsafe fn multiply_agents(job: &mut MultiplyAgents<'_>) {
    // SAFETY: as above.
    unsafe { agents::multiply::<Avx512, 1, 4>(job) }
}
