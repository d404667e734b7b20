//! Integers from a range, by multiply-shift with rejection.

use crate::{Generator, NumpyError};

impl Generator {
    /// Draws an integer that is at least `lo` and below `hi`.
    ///
    /// If only one integer is possible, no number is drawn. If up to 2³² integers are possible, 32-bit numbers are
    /// drawn; otherwise, 64-bit numbers.
    ///
    /// # Errors
    /// [`NumpyError::EmptyRange`] if `hi` is not above `lo`.
    ///
    /// Source: NumPy 1.26, `Generator.integers` with dtype `int64`.
    #[inline]
    pub fn integers(&mut self, lo: i64, hi: i64) -> Result<i64, NumpyError> {
        if hi <= lo {
            return Err(NumpyError::EmptyRange { lo, hi });
        }
        let largest = lo.abs_diff(hi) - 1;
        Ok(lo.wrapping_add_unsigned(self.up_to(largest)))
    }

    /// Draws `n` integers like [`Generator::integers`]. If `n` is 0, every range is accepted.
    ///
    /// # Errors
    /// [`NumpyError::EmptyRange`] if `hi` is not above `lo` and `n` is not 0.
    ///
    /// Source: NumPy 1.26, `Generator.integers` with `size=n`.
    pub fn integers_array(&mut self, lo: i64, hi: i64, n: usize) -> Result<Vec<i64>, NumpyError> {
        (0..n).map(|_| self.integers(lo, hi)).collect()
    }

    /// Draws an integer from 0 to `largest`, both included.
    #[inline]
    pub(super) fn up_to(&mut self, largest: u64) -> u64 {
        match u32::try_from(largest) {
            Ok(0) => 0,
            Ok(u32::MAX) => self.next_u32().into(),
            Ok(largest) => self.up_to_by_32_bits(largest).into(),
            Err(_) if largest == u64::MAX => self.next_u64(),
            Err(_) => self.up_to_by_64_bits(largest),
        }
    }

    /// Returns the upper half of `draw * count`. Rejects draws with a small lower half, which would favour some
    /// results.
    #[inline]
    fn up_to_by_32_bits(&mut self, largest: u32) -> u32 {
        let count = largest + 1;
        let mut product = u64::from(self.next_u32()) * u64::from(count);
        // The division is slow, and most draws are known to be fair without it.
        if (product as u32) < count {
            let unfair = (u32::MAX - largest) % count;
            while (product as u32) < unfair {
                product = u64::from(self.next_u32()) * u64::from(count);
            }
        }
        (product >> 32) as u32
    }

    #[inline]
    fn up_to_by_64_bits(&mut self, largest: u64) -> u64 {
        let count = largest + 1;
        let mut product = u128::from(self.next_u64()) * u128::from(count);
        if (product as u64) < count {
            let unfair = (u64::MAX - largest) % count;
            while (product as u64) < unfair {
                product = u128::from(self.next_u64()) * u128::from(count);
            }
        }
        (product >> 64) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_possible_integer_makes_no_draw() {
        let mut generator = Generator::seeded(5);
        let before = generator.clone();
        assert_eq!(generator.integers(i64::MAX - 1, i64::MAX), Ok(i64::MAX - 1));
        assert_eq!(generator.integers(-3, -2), Ok(-3));
        assert_eq!(generator, before);
    }

    #[test]
    fn an_empty_range_is_rejected_unless_no_integers_are_requested() {
        let mut generator = Generator::seeded(5);
        let before = generator.clone();
        assert_eq!(generator.integers(2, 2), Err(NumpyError::EmptyRange { lo: 2, hi: 2 }));
        assert_eq!(generator.integers_array(2, 1, 3), Err(NumpyError::EmptyRange { lo: 2, hi: 1 }));
        assert_eq!(generator.integers_array(2, 1, 0), Ok(vec![]));
        assert_eq!(generator, before);
    }

    #[test]
    fn full_ranges_return_raw_draws() {
        let mut generator = Generator::seeded(5);
        let mut plain = generator.clone();
        assert_eq!(generator.up_to(u64::from(u32::MAX)), u64::from(plain.next_u32()));
        assert_eq!(generator.up_to(u64::MAX), plain.next_u64());
        assert_eq!(generator, plain);
    }
}
