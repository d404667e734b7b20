//! Reproducible random choices.

use rand::RngExt;
use rand_pcg::Pcg64Mcg;

/// Draws a number below a bound.
pub(crate) fn below(random: &mut Pcg64Mcg, bound: usize) -> usize {
    random.random_range(0..bound as u64) as usize
}

/// Shuffles items by Fisher–Yates.
pub(crate) fn shuffle<T>(items: &mut [T], random: &mut Pcg64Mcg) {
    for end in (1..items.len()).rev() {
        items.swap(end, below(random, end + 1));
    }
}
