//! NumPy 1.26's random numbers, bit for bit.
//!
//! POGEMA draws its maps, starts and goals from `numpy.random.default_rng(seed)`. To generate the same instance from
//! the same seed, draw the same numbers, in the same order, from the same stream:
//!
//! ```
//! use pogema_numpy::{Generator, NumpyError};
//!
//! let mut generator = Generator::seeded(42);
//! let mut order: Vec<usize> = (0..10).collect();
//! generator.shuffle(&mut order);
//! assert_eq!(order, [5, 6, 0, 7, 3, 2, 4, 9, 1, 8]);
//!
//! let wall = generator.binomial1(0.3)?;
//! let pick = generator.integers(0, 5)?;
//! # let _ = (wall, pick);
//! # Ok::<(), NumpyError>(())
//! ```
//!
//! | Here | In NumPy |
//! | --- | --- |
//! | [`SeedSequence`] | `SeedSequence`: converts a seed of any size to the state of a generator |
//! | [`Generator`] | `default_rng`: PCG64 and a stored 32-bit half |
//! | [`Generator::integers`], [`Generator::choice_index`] | multiply-shift with rejection (Lemire) |
//! | [`Generator::shuffle`] | mask with rejection, for lists and for arrays |
//! | [`Generator::choice_weighted`] | one double, looked up in the running sums of the weights |
//! | [`Generator::binomial1`], [`Binomial1`] | one double, compared with one threshold |
//!
//! Two streams diverge if their calls make different numbers of draws, or draws of 32 instead of 64 bits. The docs of
//! each method therefore state the number and the size of its draws. For example, a range of one integer and `p = 0`
//! make no draw. If no half is stored, a 32-bit draw takes a 64-bit number, returns its lower half and
//! stores its upper half for the next 32-bit draw, regardless of the 64-bit draws between them.
//!
//! Doubles are only added, subtracted, multiplied, divided and compared, so a result depends neither on the
//! processor nor on a C library. If NumPy raises an exception, the methods return a [`NumpyError`] and make no draw.

#![forbid(unsafe_code)]

mod binomial;
mod choice;
mod error;
mod generator;
mod integers;
mod seed_sequence;
mod shuffle;

pub use binomial::Binomial1;
pub use error::NumpyError;
pub use generator::Generator;
pub use seed_sequence::SeedSequence;

/// The README, whose example the tests compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
