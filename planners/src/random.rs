//! Random choices, by one generator and without the bias of a remainder.

use rand_core::Rng;
use rand_pcg::Pcg64Mcg;

/// A number below a bound.
pub(crate) fn below(random: &mut Pcg64Mcg, bound: usize) -> usize {
    ((u128::from(random.next_u64()) * bound as u128) >> 64) as usize
}

/// Puts items in a random order.
pub(crate) fn shuffle<T>(items: &mut [T], random: &mut Pcg64Mcg) {
    for end in (1..items.len()).rev() {
        items.swap(end, below(random, end + 1));
    }
}
