//! Means and their confidence intervals.

use rand_core::Rng;
use rand_pcg::Pcg64;

/// Number of bootstrap samples.
///
/// Source: pogema-toolbox 0.1.1, `view_tabular.py`, `Aggregator.bootstrap`
pub const RESAMPLES: usize = 1000;

/// Seed of every sequence of draws; the number is arbitrary.
const SEED: u128 = 0x706f_6765_6d61;

/// How the interval around a mean is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spread {
    /// Between percentiles of the means of [`RESAMPLES`] samples drawn from the values with replacement.
    Bootstrap {
        /// Percentage of the means that lie within the interval.
        level: f64,
    },
    /// A multiple of the sample's standard deviation on each side.
    Deviation {
        /// The multiple.
        factor: f64,
    },
    /// No interval is computed.
    None,
}

/// A mean and its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// The lower and the upper end; `None` for a single value or with [`Spread::None`].
    pub interval: Option<(f64, f64)>,
    /// Number of values.
    pub count: usize,
}

impl Estimate {
    /// Computes the mean of values and its interval; returns `None` for no values.
    ///
    /// The draws of the bootstrap depend only on the values and on `number`.
    pub fn of(values: &[f64], spread: Spread, number: u64) -> Option<Self> {
        if values.is_empty() {
            return None;
        }
        let mean = mean(values);
        let interval = match spread {
            _ if values.len() == 1 => None,
            Spread::Bootstrap { level } => Some(bootstrap(values, level, number)),
            Spread::Deviation { factor } => {
                let half = deviation(values, mean) * factor;
                Some((mean - half, mean + half))
            }
            Spread::None => None,
        };
        Some(Self { mean, interval, count: values.len() })
    }

    /// Returns half the length of the interval.
    pub fn half(&self) -> Option<f64> {
        self.interval.map(|(low, high)| (high - low) / 2.0)
    }
}

/// Returns the mean of at least one value.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Returns the mean of values; `None` for no values.
pub(crate) fn mean_of(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| mean(values))
}

fn deviation(values: &[f64], mean: f64) -> f64 {
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (values.len() - 1) as f64).sqrt()
}

fn bootstrap(values: &[f64], level: f64, number: u64) -> (f64, f64) {
    if values.iter().all(|value| *value == values[0]) {
        return (values[0], values[0]);
    }
    let mut random = Pcg64::new(SEED, u128::from(number));
    let mut means: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let drawn = (0..values.len()).map(|_| values[below(&mut random, values.len())]);
            drawn.sum::<f64>() / values.len() as f64
        })
        .collect();
    means.sort_by(f64::total_cmp);
    let lower = (100.0 - level) / 2.0;
    (percentile(&means, lower), percentile(&means, 100.0 - lower))
}

/// Draws a number below a bound.
fn below(random: &mut Pcg64, bound: usize) -> usize {
    ((u128::from(random.next_u64()) * bound as u128) >> 64) as usize
}

/// Returns a percentile of sorted values, linearly interpolated.
///
/// Source: NumPy 1.26, `numpy.percentile`, method `linear`
pub fn percentile(sorted: &[f64], percent: f64) -> f64 {
    let place = (sorted.len() - 1) as f64 * (percent / 100.0).clamp(0.0, 1.0);
    let (low, share) = (place.floor() as usize, place.fract());
    let high = (low + 1).min(sorted.len() - 1);
    let step = sorted[high] - sorted[low];
    // Interpolates from the nearer end, as NumPy does.
    if share < 0.5 { sorted[low] + step * share } else { sorted[high] - step * (1.0 - share) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CI_95: Spread = Spread::Bootstrap { level: 95.0 };

    #[test]
    fn percentiles_match_numpy() {
        // numpy.percentile([1, 2, 4, 8], [0, 2.5, 50, 97.5, 100])
        let values = [1.0, 2.0, 4.0, 8.0];
        let found = [0.0, 2.5, 50.0, 97.5, 100.0].map(|percent| percentile(&values, percent));
        assert_eq!(found, [1.0, 1.075, 3.0, 7.699_999_999_999_999, 8.0]);
    }

    #[test]
    fn intervals_are_reproducible_and_close_to_the_normal_ones() {
        let values: Vec<f64> = (0..400).map(f64::from).collect();
        let estimate = Estimate::of(&values, CI_95, 7).unwrap();
        assert_eq!(Estimate::of(&values, CI_95, 7), Some(estimate));
        assert_ne!(Estimate::of(&values, CI_95, 8), Some(estimate));
        let expected = 1.96 * deviation(&values, 199.5) / 20.0;
        assert!((estimate.half().unwrap() / expected - 1.0).abs() < 0.1, "{estimate:?} {expected}");
    }

    #[test]
    fn a_single_value_has_no_interval_and_equal_values_have_a_zero_interval() {
        assert_eq!(Estimate::of(&[], CI_95, 0), None);
        assert_eq!(Estimate::of(&[3.0], CI_95, 0).unwrap().half(), None);
        assert_eq!(Estimate::of(&[3.0; 5], CI_95, 0).unwrap().half(), Some(0.0));
        let spread = Spread::Deviation { factor: 1.96 };
        let half = Estimate::of(&[1.0, 3.0], spread, 0).unwrap().half().unwrap();
        assert!((half - 1.96 * 2f64.sqrt()).abs() < 1e-12, "{half}");
    }
}
