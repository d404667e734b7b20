//! Tests that no path reads or writes beyond its slices: values beside them stay as they are, and pages around them end
//! the process when touched.
//!
//! A sanitizer does not see the stores that bypass the cache, because they are assembly.

use pogema_core::SimdPath;

use super::guarded::{Guarded, Side};
use super::sealed::Spread;
use super::{Value, lead_of};

/// Numbers of values between a slice and its guard page. A stray store that ends before the page changes these values.
const DISTANCES: [usize; 9] = [0, 1, 2, 5, 8, 15, 16, 33, 63];

fn check<V: Value + Spread>(path: SimdPath, canary: V) {
    let (mut bits, mut values) = (Guarded::new(1), Guarded::new(2));
    for len in (1..300).chain([511, 512, 513, 1000]) {
        for (side, distance) in
            [Side::Start, Side::End].into_iter().flat_map(|side| DISTANCES.map(|at| (side, at)))
        {
            let all = values.slice(side, len + distance, canary);
            let (first, last) = match side {
                Side::Start => (distance, distance + len),
                Side::End => (0, len),
            };
            let lead = lead_of(&all[first..]);
            for words_side in [Side::Start, Side::End] {
                let words = bits.slice(words_side, (lead + len).div_ceil(64), 0_u64);
                for (index, word) in words.iter_mut().enumerate() {
                    *word = 0x9e37_79b9_7f4a_7c15_u64.rotate_left(index as u32 * 7);
                }
                let mut expected = vec![canary; all.len()];
                V::spread(SimdPath::Scalar, words, lead, &mut expected[first..last], false);
                for beyond_cache in [false, true] {
                    all.fill(canary);
                    V::spread(path, words, lead, &mut all[first..last], beyond_cache);
                    assert_eq!(
                        all, expected,
                        "{path}, {len} values at a distance of {distance} to the {side:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn spread_stays_inside_its_slices() {
    for path in SimdPath::available() {
        check::<f32>(path, 7.0);
        check::<u8>(path, 7);
    }
}
