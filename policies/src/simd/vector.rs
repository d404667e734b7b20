//! Vectors of floats: one trait, implemented without intrinsics, with AVX2 and with AVX-512.
//!
//! Each operation is one that IEEE 754 defines exactly, so every implementation returns the same bits.

/// A vector of `COUNT` floats.
///
/// # Safety
/// An implementation with intrinsics may only be used where its instruction set is enabled and available. Pointers must
/// be valid for `COUNT` floats.
pub trait Vector: Copy {
    const COUNT: usize;

    unsafe fn splat(value: f32) -> Self;
    unsafe fn load(from: *const f32) -> Self;
    unsafe fn store(self, to: *mut f32);
    unsafe fn add(self, other: Self) -> Self;
    /// Returns `self * factor + addend`, rounded once.
    unsafe fn mul_add(self, factor: Self, addend: Self) -> Self;
    /// Returns 0 for each value below 0, and every other value as it is, NaN included.
    unsafe fn relu(self) -> Self;
}

/// Eight floats without intrinsics.
#[derive(Clone, Copy)]
pub struct Portable([f32; 8]);

/// Returns `a * b + c`, rounded once.
fn mul_add(a: f32, b: f32, c: f32) -> f32 {
    // Without a fused multiply-add instruction, `f32::mul_add` calls the system's C library, and some C libraries round
    // twice.
    if cfg!(any(target_feature = "fma", target_arch = "aarch64")) {
        a.mul_add(b, c)
    } else {
        libm::fmaf(a, b, c)
    }
}

impl Vector for Portable {
    const COUNT: usize = 8;

    unsafe fn splat(value: f32) -> Self {
        Self([value; 8])
    }

    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller passes a pointer to 8 floats; an array has the alignment of its elements.
        Self(unsafe { from.cast::<[f32; 8]>().read() })
    }

    unsafe fn store(self, to: *mut f32) {
        // SAFETY: as in `load`.
        unsafe { to.cast::<[f32; 8]>().write(self.0) }
    }

    unsafe fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|lane| self.0[lane] + other.0[lane]))
    }

    unsafe fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(std::array::from_fn(|lane| mul_add(self.0[lane], factor.0[lane], addend.0[lane])))
    }

    unsafe fn relu(self) -> Self {
        Self(self.0.map(super::relu))
    }
}
