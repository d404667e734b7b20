//! The binary heap of libstdc++, because the order of equal elements decides which path Follower takes.
//!
//! Source: GCC 13, `bits/stl_heap.h`

/// An element of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Entry {
    pub place: u32,
    /// Cost from the start.
    pub g: f32,
    /// `g` plus the heuristic.
    pub f: f32,
}

impl Entry {
    /// Returns whether this element comes after another one. Values of `f` that differ by less than 1e-5 count as
    /// equal, too.
    ///
    /// Of two elements, each may come after the other, so the order depends on the steps of the heap.
    fn is_after(self, other: Self) -> bool {
        self.f > other.f || (f64::from((self.f - other.f).abs()) < 1e-5 && self.g > other.g)
    }
}

/// A heap whose first element comes after no other.
#[derive(Clone, Debug, Default)]
pub(crate) struct Heap(Vec<Entry>);

impl Heap {
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Adds an element.
    pub fn push(&mut self, entry: Entry) {
        self.0.push(entry);
        self.rise(self.0.len() - 1, entry);
    }

    /// Removes the first element.
    pub fn pop(&mut self) -> Option<Entry> {
        let last = self.0.pop()?;
        let Some(&first) = self.0.first() else { return Some(last) };
        let (len, mut hole) = (self.0.len(), 0);
        // The hole sinks to a leaf without regard to `last`, which then rises.
        while 2 * hole + 2 < len {
            let (left, right) = (2 * hole + 1, 2 * hole + 2);
            let child = if self.0[right].is_after(self.0[left]) { left } else { right };
            self.0[hole] = self.0[child];
            hole = child;
        }
        if 2 * hole + 2 == len {
            self.0[hole] = self.0[2 * hole + 1];
            hole = 2 * hole + 1;
        }
        self.rise(hole, last);
        Some(first)
    }

    /// Moves an element up from a hole while its parent comes after it.
    fn rise(&mut self, mut hole: usize, entry: Entry) {
        while hole > 0 {
            let parent = (hole - 1) / 2;
            if !self.0[parent].is_after(entry) {
                break;
            }
            self.0[hole] = self.0[parent];
            hole = parent;
        }
        self.0[hole] = entry;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(place: u32, g: f32, f: f32) -> Entry {
        Entry { place, g, f }
    }

    fn order(entries: &[Entry]) -> Vec<u32> {
        let mut heap = Heap::default();
        for &entry in entries {
            heap.push(entry);
        }
        std::iter::from_fn(|| heap.pop()).map(|entry| entry.place).collect()
    }

    #[test]
    fn the_smallest_f_then_the_smallest_g_is_first() {
        assert_eq!(order(&[entry(0, 1.0, 9.0), entry(1, 1.0, 4.0), entry(2, 1.0, 7.0)]), [1, 2, 0]);
        assert_eq!(order(&[entry(0, 3.0, 9.0), entry(1, 1.0, 9.0), entry(2, 2.0, 9.0)]), [1, 2, 0]);
        // 1e-6 is not enough to come first with the larger g.
        assert_eq!(order(&[entry(0, 3.0, 1.0), entry(1, 1.0, 1.0 + 1e-6)]), [1, 0]);
    }

    /// Worked out by hand from the steps of `push_heap` and `pop_heap`.
    #[test]
    fn equal_elements_leave_in_the_order_of_libstdcpp() {
        let equal: Vec<Entry> = (0..7).map(|place| entry(place, 1.0, 1.0)).collect();
        // Pop 0: the hole takes 2 (right), then 5, its only child; 6 fills that place: [2, 1, 5, 3, 4, 6].
        // Pop 2: the hole takes 5 (right), whose only child 6 was removed as the last: [5, 1, 6, 3, 4].
        // Pop 5: takes 6, a leaf; 4 fills it: [6, 1, 4, 3]. Pop 6: takes 4, a leaf; 3 fills it: [4, 1, 3].
        // Pop 4: takes 1, the only child; 3 fills its place: [1, 3].
        assert_eq!(order(&equal), [0, 2, 5, 6, 4, 1, 3]);
    }

    #[test]
    fn empty_and_single_heaps() {
        assert_eq!(Heap::default().pop(), None);
        assert_eq!(order(&[entry(5, 0.0, 0.0)]), [5]);
    }
}
