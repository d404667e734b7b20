//! NumPy 1.26's random numbers, bit for bit.
//!
//! POGEMA draws its maps, starts and goals from `numpy.random.default_rng(seed)`. Whoever wants the same
//! instance from the same seed must draw the same numbers, in the same order, from the same stream:
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
//! | Here | What NumPy has there |
//! | --- | --- |
//! | [`SeedSequence`] | `SeedSequence`: a seed of any size becomes the state of a generator |
//! | [`Generator`] | `default_rng`: PCG64 and the 32-bit half that it keeps for later |
//! | [`Generator::integers`], [`Generator::choice_index`] | multiply-shift with rejection (Lemire) |
//! | [`Generator::shuffle`] | mask with rejection, for lists and for arrays |
//! | [`Generator::choice_weighted`] | one double, looked up in the running sums of the weights |
//! | [`Generator::binomial1`], [`Binomial1`] | one double against one threshold |
//!
//! Two things make streams drift apart, and every method states its share in them: how many draws a call
//! makes (a range of one integer and `p = 0` make none), and whether they are of 32 or of 64 bits. The first
//! 32-bit draw takes a 64-bit number and keeps its upper half for the next 32-bit draw, however many 64-bit
//! draws come between them.
//!
//! Doubles are only added, subtracted, multiplied, divided and compared, so a result depends neither on the
//! processor nor on a C library. What NumPy raises for is a [`NumpyError`] here, and draws nothing.

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
