//! Bernoulli trials: `binomial(1, p)`.

use crate::{Generator, NumpyError};

/// Trials with one probability, whose threshold is computed only once.
///
/// Source: NumPy 1.26, `Generator.binomial(1, p)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Binomial1(Success);

/// The doubles `u` from 0 to 1 that mean success.
///
/// Let `q` be the larger of `p` and `1 - p`. NumPy's trial has the likelier outcome if `u` is at most `exp(log(q))`.
/// This equals `q`, because `q` is at least 0.5: rounding the logarithm moves the exponential by less than half the
/// distance to the next double, so the exponential rounds back to `q`. Comparing with `q` makes the result independent
/// of the machine's mathematics library. NumPy would draw again if `u - q` exceeded `(1 - q) * q / q`, but this is
/// impossible for `u` below 1.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Success {
    /// No double; the trial makes no draw.
    Never,
    /// Doubles above a threshold: success is not the likelier outcome.
    Above(f64),
    /// Doubles up to a threshold: success is the likelier outcome.
    UpTo(f64),
}

impl Binomial1 {
    /// Creates trials that succeed with probability `p`.
    ///
    /// # Errors
    /// [`NumpyError::BadProbability`] if `p` is below 0, above 1 or not a number.
    pub fn new(p: f64) -> Result<Self, NumpyError> {
        if !(0.0..=1.0).contains(&p) {
            return Err(NumpyError::BadProbability { p });
        }
        Ok(Self(if p == 0.0 {
            Success::Never
        } else if p <= 0.5 {
            Success::Above(1.0 - p)
        } else {
            // NumPy computes 1 - (1 - p) here; both differences are exact for p above 0.5.
            Success::UpTo(p)
        }))
    }

    /// Runs one trial, with one 64-bit draw, or with none if `p` is 0.
    #[inline]
    pub fn sample(&self, generator: &mut Generator) -> bool {
        match self.0 {
            Success::Never => false,
            Success::Above(threshold) => generator.random() > threshold,
            Success::UpTo(threshold) => generator.random() <= threshold,
        }
    }
}

impl Generator {
    /// Runs one trial that succeeds with probability `p`, with one 64-bit draw, or with none if `p` is 0.
    ///
    /// # Errors
    /// [`NumpyError::BadProbability`] if `p` is below 0, above 1 or not a number.
    ///
    /// Source: NumPy 1.26, `Generator.binomial(1, p)`.
    #[inline]
    pub fn binomial1(&mut self, p: f64) -> Result<bool, NumpyError> {
        Ok(Binomial1::new(p)?.sample(self))
    }

    /// Runs `n` trials like [`Generator::binomial1`], and passes the outcomes to `put` in order.
    ///
    /// # Errors
    /// [`NumpyError::BadProbability`] if `p` is below 0, above 1 or not a number, even if `n` is 0.
    ///
    /// Source: NumPy 1.26, `Generator.binomial(1, p, size=n)`.
    #[inline]
    pub fn binomial1_array(&mut self, p: f64, n: usize, mut put: impl FnMut(bool)) -> Result<(), NumpyError> {
        let trial = Binomial1::new(p)?;
        for _ in 0..n {
            put(trial.sample(self));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_probability_zero_makes_no_draw() {
        let mut generator = Generator::seeded(2);
        let mut plain = generator.clone();
        assert_eq!(generator.binomial1(0.0), Ok(false));
        assert_eq!(generator.binomial1(-0.0), Ok(false));
        assert_eq!(generator, plain);
        for (p, outcome) in [(1.0, true), (f64::MIN_POSITIVE, false)] {
            assert_eq!(generator.binomial1(p), Ok(outcome));
            plain.next_u64();
            assert_eq!(generator, plain);
        }
    }

    #[test]
    fn probabilities_out_of_range_are_rejected() {
        for p in [-f64::MIN_POSITIVE, 1.0 + f64::EPSILON, f64::NAN, f64::INFINITY] {
            assert!(Binomial1::new(p).is_err());
        }
    }
}
