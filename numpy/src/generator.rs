//! The stream of random numbers, and draws of doubles.

use rand_core::Rng;
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use crate::{NumpyError, SeedSequence};

/// A stream of random numbers with NumPy's methods for drawing them.
///
/// Two generators are equal if all their further draws are equal.
///
/// Source: NumPy 1.26, `default_rng` and `Generator` on `PCG64`.
///
/// Rule: seed/streams
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Generator {
    pcg: Pcg64,
    /// The upper half that the next 32-bit draw uses; 64-bit draws ignore it.
    upper_half: Option<u32>,
}

impl Generator {
    /// Creates the stream of a seed that fits in 64 bits.
    ///
    /// Source: NumPy 1.26, `default_rng(seed)`.
    pub fn seeded(seed: u64) -> Self {
        Self::from_sequence(&SeedSequence::from_u64(seed))
    }

    /// Creates the stream of a seed sequence, whose seed may have any size.
    ///
    /// Source: NumPy 1.26, `default_rng(seed_sequence)`.
    pub fn from_sequence(sequence: &SeedSequence) -> Self {
        let [high, low, stream_high, stream_low] = sequence.generate_state_u64().map(u128::from);
        Self::from_pcg64(Pcg64::new(high << 64 | low, stream_high << 64 | stream_low))
    }

    /// Creates the stream that continues a given state.
    ///
    /// Source: NumPy 1.26, `Generator(bit_generator)`.
    pub fn from_pcg64(pcg: Pcg64) -> Self {
        Self { pcg, upper_half: None }
    }

    /// Draws 32 bits: the stored upper half if there is one, otherwise the lower half of the next 64 bits.
    #[inline]
    pub fn next_u32(&mut self) -> u32 {
        if let Some(half) = self.upper_half.take() {
            return half;
        }
        let whole = self.next_u64();
        self.upper_half = Some((whole >> 32) as u32);
        whole as u32
    }

    /// Draws 64 bits, without using or discarding a stored upper half.
    #[inline]
    pub fn next_u64(&mut self) -> u64 {
        self.pcg.next_u64()
    }

    /// Draws a double from 0 up to but not including 1, a multiple of 2⁻⁵³, with one 64-bit draw.
    ///
    /// Source: NumPy 1.26, `Generator.random`.
    #[inline]
    pub fn random(&mut self) -> f64 {
        const SPACING: f64 = 1.0 / (1_u64 << f64::MANTISSA_DIGITS) as f64;
        (self.next_u64() >> (u64::BITS - f64::MANTISSA_DIGITS)) as f64 * SPACING
    }

    /// Draws a double from `lo` to `hi`, with one 64-bit draw even if the ends are equal.
    ///
    /// # Errors
    /// [`NumpyError::BadRange`] if `hi - lo` is negative, infinite or not a number.
    ///
    /// Source: NumPy 1.26, `Generator.uniform`.
    #[inline]
    pub fn uniform(&mut self, lo: f64, hi: f64) -> Result<f64, NumpyError> {
        let width = hi - lo;
        // NumPy checks the sign bit, so it rejects the width -0 of the range from 0 to -0.
        if !width.is_finite() || width.is_sign_negative() {
            return Err(NumpyError::BadRange { lo, hi });
        }
        Ok(lo + width * self.random())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stored_half_survives_64_bit_draws() {
        let mut mixed = Generator::seeded(3);
        let mut plain = mixed.clone();
        let first = plain.next_u64();
        assert_eq!(mixed.next_u32(), first as u32);
        assert_eq!(mixed.next_u64(), plain.next_u64());
        assert_eq!(mixed.next_u32(), (first >> 32) as u32);
        assert_eq!(mixed, plain);
    }

    #[test]
    fn a_rejected_range_makes_no_draw() {
        let mut generator = Generator::seeded(3);
        let before = generator.clone();
        for (lo, hi) in [(1.0, 0.0), (0.0, -0.0), (f64::NAN, 1.0), (-f64::MAX, f64::MAX)] {
            assert!(generator.uniform(lo, hi).is_err());
        }
        assert_eq!(generator, before);
    }
}
