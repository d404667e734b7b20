//! The elements of the heap of Follower's search.

use pogema_planners::Precedes;

/// An element of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Entry {
    pub place: u32,
    /// Cost from the start.
    pub g: f32,
    /// `g` plus the heuristic.
    pub f: f32,
}

impl Precedes for Entry {
    /// An element with a smaller `f` comes first. If the values of `f` differ by less than 1e-5, one with a smaller `g`
    /// comes first, too.
    ///
    /// Of two elements, each may come before the other, so their order depends on the steps of the heap.
    fn precedes(&self, other: &Self) -> bool {
        other.f > self.f || (f64::from((other.f - self.f).abs()) < 1e-5 && other.g > self.g)
    }
}

#[cfg(test)]
mod tests {
    use pogema_planners::HeapQ;

    use super::*;

    fn entry(place: u32, g: f32, f: f32) -> Entry {
        Entry { place, g, f }
    }

    fn order(entries: &[Entry]) -> Vec<u32> {
        let mut heap = HeapQ::default();
        for &entry in entries {
            heap.push(entry);
        }
        std::iter::from_fn(|| heap.pop()).map(|entry| entry.place).collect()
    }

    #[test]
    fn the_smallest_f_then_the_smallest_g_is_first() {
        assert_eq!(order(&[entry(0, 1.0, 9.0), entry(1, 1.0, 4.0), entry(2, 1.0, 7.0)]), [1, 2, 0]);
        assert_eq!(order(&[entry(0, 3.0, 9.0), entry(1, 1.0, 9.0), entry(2, 2.0, 9.0)]), [1, 2, 0]);
        // A difference in f of 1e-6 counts as equal, so the smaller g comes first.
        assert_eq!(order(&[entry(0, 3.0, 1.0), entry(1, 1.0, 1.0 + 1e-6)]), [1, 0]);
    }
}
