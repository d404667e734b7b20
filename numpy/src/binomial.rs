//! Single trials: `binomial(1, p)`.

use crate::{Generator, NumpyError};

/// Trials of one probability, with everything that depends only on it worked out once.
///
/// Source: NumPy 1.26, `Generator.binomial(1, p)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Binomial1(Success);

/// Which doubles `u` from 0 to 1 mean success.
///
/// With `q` the larger of `p` and `1 - p`, NumPy's trial has the likelier outcome if `u` is at most `exp(log(q))`.
/// That is `q` itself, since `q` is at least 0.5: rounding the logarithm moves it by less than half the distance
/// to the next double, and the exponential rounds back. Comparing with `q` keeps the mathematics library of the
/// machine out of the result. NumPy would draw again if `u - q` exceeded `(1 - q) * q / q`, but no `u` below 1
/// does that.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Success {
    /// None; nothing is even drawn.
    Never,
    /// Those above a threshold: success is not the likelier outcome.
    Above(f64),
    /// Those up to a threshold: success is the likelier outcome.
    UpTo(f64),
}

impl Binomial1 {
    /// Trials that succeed with probability `p`.
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
            // NumPy has 1 - (1 - p) here; both differences are exact for such p.
            Success::UpTo(p)
        }))
    }

    /// One trial; one 64-bit draw, but none if `p` is 0.
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
    /// One trial that succeeds with probability `p`; one 64-bit draw, but none if `p` is 0.
    ///
    /// # Errors
    /// [`NumpyError::BadProbability`] if `p` is below 0, above 1 or not a number.
    ///
    /// Source: NumPy 1.26, `Generator.binomial(1, p)`.
    #[inline]
    pub fn binomial1(&mut self, p: f64) -> Result<bool, NumpyError> {
        Ok(Binomial1::new(p)?.sample(self))
    }

    /// The same as `n` calls of [`Generator::binomial1`]; `put` receives the outcomes in order.
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
    fn only_certain_failure_is_not_drawn() {
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
    fn what_is_no_probability_is_refused() {
        for p in [-f64::MIN_POSITIVE, 1.0 + f64::EPSILON, f64::NAN, f64::INFINITY] {
            assert!(Binomial1::new(p).is_err());
        }
    }
}
