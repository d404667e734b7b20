//! Random choice of one item, with and without weights.

use crate::{Generator, NumpyError};

/// Largest accepted distance between the sum of the weights and 1: the square root of the double's epsilon, 2⁻²⁶.
const SUM_TOLERANCE: f64 = 1.0 / (1_u64 << 26) as f64;

impl Generator {
    /// Draws the index of one of `n` equally likely items, with the draws of [`Generator::integers`] from 0 to `n`. A
    /// single item takes no draw.
    ///
    /// # Errors
    /// [`NumpyError::EmptyChoice`] if `n` is 0.
    ///
    /// Source: NumPy 1.26, `Generator.choice(items, 1)`.
    #[inline]
    pub fn choice_index(&mut self, n: usize) -> Result<usize, NumpyError> {
        let largest = n.checked_sub(1).ok_or(NumpyError::EmptyChoice)?;
        Ok(self.up_to(largest as u64) as usize)
    }

    /// Draws the index of one item with the probabilities given by `weights`, with one 64-bit draw.
    ///
    /// # Errors
    /// [`NumpyError::EmptyChoice`], [`NumpyError::BadWeight`] or [`NumpyError::BadWeightSum`].
    ///
    /// Source: NumPy 1.26, `Generator.choice(k, p=weights)`.
    pub fn choice_weighted(&mut self, weights: &[f64]) -> Result<usize, NumpyError> {
        check_weights(weights)?;
        // Added from left to right, as in a running sum: another order would round differently.
        let total = weights.iter().fold(0.0, |sum, weight| sum + weight);
        let draw = self.random();
        let mut sum = 0.0;
        let index = weights.iter().position(|weight| {
            sum += weight;
            sum / total > draw
        });
        // INVARIANT: the last quotient is 1, which is above every draw.
        Ok(index.unwrap_or_default())
    }
}

fn check_weights(weights: &[f64]) -> Result<(), NumpyError> {
    if weights.is_empty() {
        return Err(NumpyError::EmptyChoice);
    }
    if let Some((index, &weight)) = weights.iter().enumerate().find(|(_, w)| w.is_nan() || **w < 0.0) {
        return Err(NumpyError::BadWeight { index, weight });
    }
    let sum = compensated_sum(weights);
    // Infinite weights may make the sum NaN, for which the comparison is false.
    if (sum - 1.0).abs() <= SUM_TOLERANCE { Ok(()) } else { Err(NumpyError::BadWeightSum { sum }) }
}

/// Returns the sum that NumPy checks, computed by Kahan summation.
fn compensated_sum(values: &[f64]) -> f64 {
    let mut sum = 0.0;
    let mut error = 0.0;
    for value in values {
        let term = value - error;
        let next = sum + term;
        error = (next - sum) - term;
        sum = next;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rejected_weights_make_no_draw() {
        let mut generator = Generator::seeded(9);
        let before = generator.clone();
        assert_eq!(generator.choice_index(0), Err(NumpyError::EmptyChoice));
        assert_eq!(generator.choice_weighted(&[]), Err(NumpyError::EmptyChoice));
        let negative = generator.choice_weighted(&[1.0, -1e-9]);
        assert_eq!(negative, Err(NumpyError::BadWeight { index: 1, weight: -1e-9 }));
        assert!(generator.choice_weighted(&[f64::NAN, 1.0]).is_err());
        assert!(generator.choice_weighted(&[f64::INFINITY, 0.0]).is_err());
        assert!(generator.choice_weighted(&[0.5, 0.5 + 1.5e-8]).is_err());
        assert_eq!(generator, before);
    }

    #[test]
    fn sums_within_the_tolerance_are_accepted() {
        let mut generator = Generator::seeded(9);
        assert!(generator.choice_weighted(&[0.5, 0.5 + 1.4e-8]).is_ok());
        assert!(generator.choice_weighted(&[-0.0, 1.0 - SUM_TOLERANCE]).is_ok());
    }
}
