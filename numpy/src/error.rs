//! The errors of this crate: rejected arguments and missing entropy.

/// The reason why a draw is rejected, or why no seed could be made. A rejected draw leaves the generator unchanged.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NumpyError {
    /// No integer lies in the half-open range.
    #[error("no integer is at least `{lo}` and below `{hi}`")]
    EmptyRange {
        /// The lower end.
        lo: i64,
        /// The upper end, which is not part of the range.
        hi: i64,
    },
    /// The ends of a range of doubles are in the wrong order, not numbers, or too far apart.
    #[error("range is `{lo}` to `{hi}`, expected the lower end first and a finite width")]
    BadRange {
        /// The lower end.
        lo: f64,
        /// The upper end.
        hi: f64,
    },
    /// There is nothing to choose from.
    #[error("cannot choose from `0` items")]
    EmptyChoice,
    /// A weight is negative or not a number.
    #[error("weight at index `{index}` is `{weight}`, expected 0 or more")]
    BadWeight {
        /// The weight's index.
        index: usize,
        /// The weight.
        weight: f64,
    },
    /// The weights do not sum to one.
    #[error("weights sum to `{sum}`, expected 1")]
    BadWeightSum {
        /// The sum.
        sum: f64,
    },
    /// A probability is below zero, above one or not a number.
    #[error("probability is `{p}`, expected 0 to 1")]
    BadProbability {
        /// The probability.
        p: f64,
    },
    /// The operating system supplied no entropy.
    #[error("no entropy from the operating system: `{0}`")]
    NoEntropy(#[source] getrandom::Error),
}

#[cfg(test)]
mod tests {
    use std::error::Error as _;

    use super::*;

    #[test]
    fn each_message_names_its_values_in_one_line() {
        let expected = [
            (NumpyError::EmptyRange { lo: 3, hi: 2 }, &["`3`", "`2`"][..]),
            (NumpyError::BadRange { lo: 0.5, hi: 0.25 }, &["`0.5`", "`0.25`"]),
            (NumpyError::EmptyChoice, &["`0` items"]),
            (NumpyError::BadWeight { index: 4, weight: -1.0 }, &["`-1`", "`4`"]),
            (NumpyError::BadWeightSum { sum: 2.0 }, &["`2`"]),
            (NumpyError::BadProbability { p: 1.5 }, &["`1.5`"]),
            (NumpyError::NoEntropy(getrandom::Error::UNSUPPORTED), &["operating system"]),
        ];
        for (error, parts) in expected {
            let line = error.to_string();
            assert!(parts.iter().all(|part| line.contains(part)) && !line.contains('\n'), "{line}");
            assert_eq!(error.source().is_some(), matches!(error, NumpyError::NoEntropy(_)));
        }
    }
}
