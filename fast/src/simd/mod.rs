//! The one place for machine code: windows cut out of the strips, and bits spread to values.
//!
//! Every path does what `scalar` does, bit for bit; the tests run all that the machine has.

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
mod scalar;
#[cfg(target_arch = "x86_64")]
mod sights;

use std::fmt;
use std::ops::Range;

use pogema_core::{Cell, Error};

use crate::grid::Strips;

/// How observations are computed. What comes out is the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SimdPath {
    /// No intrinsics; on every machine.
    Scalar,
    /// AVX2.
    Avx2,
    /// AVX-512 F and BW.
    Avx512,
}

impl SimdPath {
    /// All paths, the plainest first.
    pub const ALL: [Self; 3] = [Self::Scalar, Self::Avx2, Self::Avx512];

    /// The environment variable that forces a path.
    pub const VARIABLE: &'static str = "POGEMA_SIMD";

    /// Whether this machine has it.
    pub fn is_available(self) -> bool {
        match self {
            Self::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512bw"),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
        }
    }

    /// The widest path that this machine has.
    pub fn best() -> Self {
        Self::ALL.into_iter().rev().find(|path| path.is_available()).unwrap_or(Self::Scalar)
    }

    /// The path that the variable `POGEMA_SIMD` names, else the widest.
    ///
    /// # Errors
    /// [`Error::Config`] if the variable holds anything but the name of a path that this machine has.
    pub fn from_environment() -> Result<Self, Error> {
        let Some(value) = std::env::var_os(Self::VARIABLE) else { return Ok(Self::best()) };
        let name = value.to_string_lossy();
        let path = Self::ALL.into_iter().find(|path| path.to_string() == name);
        let path =
            path.ok_or_else(|| Error::config(Self::VARIABLE, &name, "`scalar`, `avx2` or `avx512`"))?;
        path.check().map(|()| path)
    }

    pub(crate) fn check(self) -> Result<(), Error> {
        if self.is_available() {
            return Ok(());
        }
        Err(Error::config(Self::VARIABLE, self, format!("at most `{}` on this machine", Self::best())))
    }
}

impl fmt::Display for SimdPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Scalar => "scalar",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        })
    }
}

/// Which channels of a window are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Channels {
    /// Obstacles, agents, goal.
    All,
    /// Obstacles alone.
    Obstacles,
    /// Agents alone.
    Agents,
}

impl Channels {
    pub fn number(self) -> usize {
        if self == Self::All { 3 } else { 1 }
    }
}

/// What agents look at.
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

    /// The index of the goal, or of the rim towards it, within a window of a side.
    ///
    /// Rule: observe/default/goal
    #[allow(clippy::inline_always, reason = "so that each path compiles it with its own features")]
    #[inline(always)]
    pub fn goal_index(cell: Cell, goal: Cell, side: usize) -> usize {
        let radius = side as u16 / 2;
        // Without a sign, since places differ by more than one of 16 bits can say.
        let toward = |cell: u16, goal: u16| {
            radius + goal.saturating_sub(cell).min(radius) - cell.saturating_sub(goal).min(radius)
        };
        usize::from(toward(cell.row, goal.row)) * side + usize::from(toward(cell.col, goal.col))
    }
}

/// A type that observations are made of.
pub trait Value: Copy + Send + Sync + Default + PartialEq + fmt::Debug + sealed::Spread {}

impl Value for f32 {}
impl Value for u8 {}

pub(crate) mod sealed {
    use super::SimdPath;

    pub trait Spread: Sized {
        /// Makes a value of each bit, but not of the first `lead`, fewer than 64, of which the caller says that
        /// they bring `out` to a line of memory. `beyond_cache` if the values will not be read soon.
        fn spread(path: SimdPath, words: &[u64], lead: usize, out: &mut [Self], beyond_cache: bool);
    }
}

impl sealed::Spread for f32 {
    fn spread(path: SimdPath, words: &[u64], lead: usize, out: &mut [Self], beyond_cache: bool) {
        check_enough(words, lead + out.len());
        match path {
            SimdPath::Scalar => scalar::spread(words, lead, out, &scalar::FLOATS),
            #[cfg(target_arch = "x86_64")]
            SimdPath::Avx2 => avx2::spread_f32(words, lead, out),
            #[cfg(target_arch = "x86_64")]
            SimdPath::Avx512 => avx512::spread_f32(words, lead, out, beyond_cache),
            #[cfg(not(target_arch = "x86_64"))]
            SimdPath::Avx2 | SimdPath::Avx512 => unreachable!("a path is checked when an engine is made"),
        }
    }
}

impl sealed::Spread for u8 {
    fn spread(path: SimdPath, words: &[u64], lead: usize, out: &mut [Self], beyond_cache: bool) {
        check_enough(words, lead + out.len());
        match path {
            SimdPath::Scalar => scalar::spread(words, lead, out, &scalar::BYTES),
            #[cfg(target_arch = "x86_64")]
            SimdPath::Avx2 => avx2::spread_u8(words, lead, out),
            #[cfg(target_arch = "x86_64")]
            SimdPath::Avx512 => avx512::spread_u8(words, lead, out, beyond_cache),
            #[cfg(not(target_arch = "x86_64"))]
            SimdPath::Avx2 | SimdPath::Avx512 => unreachable!("a path is checked when an engine is made"),
        }
    }
}

fn check_enough(words: &[u64], num_bits: usize) {
    assert!(num_bits <= 64 * words.len(), "{num_bits} bits do not fit {} words", words.len());
}

/// Asks for a value that will be needed soon.
#[inline]
#[allow(unsafe_code, reason = "a hint to the processor")]
pub(crate) fn fetch<T>(what: &T) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a hint changes nothing, and every x86-64 has it.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(what).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = what;
}

/// Asks for a whole list.
pub(crate) fn fetch_all<T>(list: &[T]) {
    list.chunks(per_line::<T>()).for_each(|line| fetch(&line[0]));
}

/// Values of a type from one line of memory to the next.
pub(crate) const fn per_line<V>() -> usize {
    64 / size_of::<V>()
}

/// How many values `out` begins after a line of memory.
pub(crate) fn lead_of<V>(out: &[V]) -> usize {
    out.as_ptr().addr() / size_of::<V>() % per_line::<V>()
}

/// Words that a path may write from the one on in which an agent's bits begin.
pub(crate) const MOST_WORDS: usize = 8;

/// Writes the windows of some agents as bits, one after the other from bit `lead` on; if `apart`, each agent's
/// begin a new word.
///
/// Rule: observe/default, observe/default/window, observe/default/agents, observe/default/inactive
pub(crate) fn pack(
    path: SimdPath,
    scene: &WindowSource<'_>,
    agents: Range<usize>,
    channels: Channels,
    (lead, apart): (usize, bool),
    words: &mut [u64],
) {
    #[cfg(target_arch = "x86_64")]
    if channels == Channels::All {
        let is_done = match path {
            SimdPath::Scalar => false,
            SimdPath::Avx2 => avx2_windows::pack(scene, agents.clone(), lead, apart, words),
            SimdPath::Avx512 => avx512_windows::pack(scene, agents.clone(), lead, apart, words),
        };
        if is_done {
            return;
        }
    }
    let _ = path;
    scalar::pack(scene, agents, channels, (lead, apart), words);
}
