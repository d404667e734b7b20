//! All code with intrinsics: extraction of windows from the strips, and conversion of bits to values.
//!
//! Every path has the same results as `scalar`, bit for bit. The tests run all paths that the machine supports.

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "256-bit intrinsics")]
mod avx2;
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "256-bit intrinsics")]
mod avx2_windows;
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "512-bit intrinsics")]
mod avx512;
#[cfg(target_arch = "x86_64")]
mod avx512_layout;
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "512-bit intrinsics")]
mod avx512_windows;
// Miri supports no guard pages, and needs none.
#[cfg(test)]
#[cfg(not(miri))]
mod guard_pages;
#[cfg(test)]
#[cfg(not(miri))]
#[allow(unsafe_code, reason = "slices next to pages without access")]
mod guarded;
#[cfg(target_arch = "x86_64")]
mod positions;
mod scalar;

use std::fmt;
use std::ops::Range;

use pogema_core::{Cell, SimdPath};

use crate::grid::Strips;

/// The requested channels of a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Channels {
    /// Obstacles, agents, goal.
    All,
    /// Only obstacles.
    Obstacles,
    /// Only agents.
    Agents,
}

impl Channels {
    pub fn number(self) -> usize {
        if self == Self::All { 3 } else { 1 }
    }
}

/// The grids, cells and goals from which windows are extracted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WindowSource<'a> {
    pub obstacles: &'a Strips,
    pub occupied: &'a Strips,
    pub cells: &'a [Cell],
    pub goals: &'a [Cell],
    pub radius: usize,
}

impl WindowSource<'_> {
    pub fn side(&self) -> usize {
        2 * self.radius + 1
    }

    /// Returns the index of the goal in a window with a given side. A goal outside the window is clamped to its rim.
    ///
    /// Rule: observe/default/goal
    #[allow(clippy::inline_always, reason = "so that each path compiles it with its own features")]
    #[inline(always)]
    pub fn goal_index(cell: Cell, goal: Cell, side: usize) -> usize {
        let radius = side as u16 / 2;
        // Unsigned arithmetic, since differences of cells can exceed a signed number of 16 bits.
        let toward = |cell: u16, goal: u16| {
            radius + goal.saturating_sub(cell).min(radius) - cell.saturating_sub(goal).min(radius)
        };
        usize::from(toward(cell.row, goal.row)) * side + usize::from(toward(cell.col, goal.col))
    }
}

/// An element type of observations.
pub trait Value: Copy + Send + Sync + Default + PartialEq + fmt::Debug + sealed::Spread {}

impl Value for f32 {}
impl Value for u8 {}

pub(crate) mod sealed {
    use super::SimdPath;

    pub trait Spread: Sized {
        /// Converts each bit to a value, but skips the first `lead` bits.
        ///
        /// `lead` is below 64, and the caller chooses it so that `out` begins `lead` values after a cache line begins.
        /// With `streaming`, the AVX-512 path uses stores that bypass the cache, because the values will not be read
        /// soon. The other paths ignore `streaming`.
        fn spread(path: SimdPath, words: &[u64], lead: usize, out: &mut [Self], streaming: bool);
    }
}

impl sealed::Spread for f32 {
    fn spread(path: SimdPath, words: &[u64], lead: usize, out: &mut [Self], streaming: bool) {
        check_enough(words, lead + out.len());
        match path {
            SimdPath::Scalar => scalar::spread(words, lead, out, &scalar::FLOATS),
            #[cfg(target_arch = "x86_64")]
            SimdPath::Avx2 => avx2::spread_f32(words, lead, out),
            #[cfg(target_arch = "x86_64")]
            SimdPath::Avx512 => avx512::spread_f32(words, lead, out, streaming),
            #[cfg(not(target_arch = "x86_64"))]
            SimdPath::Avx2 | SimdPath::Avx512 => {
                unreachable!("the path is checked when an engine is created")
            }
        }
    }
}

impl sealed::Spread for u8 {
    fn spread(path: SimdPath, words: &[u64], lead: usize, out: &mut [Self], streaming: bool) {
        check_enough(words, lead + out.len());
        match path {
            SimdPath::Scalar => scalar::spread(words, lead, out, &scalar::BYTES),
            #[cfg(target_arch = "x86_64")]
            SimdPath::Avx2 => avx2::spread_u8(words, lead, out),
            #[cfg(target_arch = "x86_64")]
            SimdPath::Avx512 => avx512::spread_u8(words, lead, out, streaming),
            #[cfg(not(target_arch = "x86_64"))]
            SimdPath::Avx2 | SimdPath::Avx512 => {
                unreachable!("the path is checked when an engine is created")
            }
        }
    }
}

fn check_enough(words: &[u64], num_bits: usize) {
    assert!(num_bits <= 64 * words.len(), "{num_bits} bits do not fit {} words", words.len());
}

/// Prefetches a value that will be needed soon.
#[inline]
#[allow(unsafe_code, reason = "a hint to the processor")]
pub(crate) fn prefetch<T>(what: &T) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a prefetch has no effect on memory, and every x86-64 processor supports it.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(what).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = what;
}

/// Prefetches a whole list.
pub(crate) fn prefetch_all<T>(list: &[T]) {
    list.chunks(per_line::<T>()).for_each(|line| prefetch(&line[0]));
}

/// Returns the number of values of a type in a cache line.
pub(crate) const fn per_line<V>() -> usize {
    64 / size_of::<V>()
}

/// Returns the number of values between the start of a cache line and the start of `out`.
pub(crate) fn lead_of<V>(out: &[V]) -> usize {
    out.as_ptr().addr() / size_of::<V>() % per_line::<V>()
}

/// Number of words that a path may write for an agent, from the word in which the agent's bits begin.
pub(crate) const MAX_WORDS: usize = 8;

/// Writes the windows of some agents as bits, one after another from bit `lead` on. If `apart`, the bits of each agent
/// begin a new word.
///
/// Rule: observe/default, observe/default/window, observe/default/agents, observe/default/inactive
pub(crate) fn pack(
    path: SimdPath,
    source: &WindowSource<'_>,
    agents: Range<usize>,
    channels: Channels,
    (lead, apart): (usize, bool),
    words: &mut [u64],
) {
    #[cfg(target_arch = "x86_64")]
    if channels == Channels::All {
        let is_done = match path {
            SimdPath::Scalar => false,
            SimdPath::Avx2 => avx2_windows::pack(source, agents.clone(), lead, apart, words),
            SimdPath::Avx512 => avx512_windows::pack(source, agents.clone(), lead, apart, words),
        };
        if is_done {
            return;
        }
    }
    let _ = path;
    scalar::pack(source, agents, channels, (lead, apart), words);
}
