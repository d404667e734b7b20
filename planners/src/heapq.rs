//! A binary heap that orders equal items as Python and libstdc++ do.

/// The comparison of a [`HeapQ`], which need not be an order: each of two items may precede the other.
pub trait Precedes {
    /// Returns whether this item comes before another one.
    fn precedes(&self, other: &Self) -> bool;
}

/// A heap that takes the same steps as Python's `heapq` and as the heap of libstdc++.
///
/// [`std::collections::BinaryHeap`] does not suffice. The comparisons of POGEMA's A* and of Follower's planner are not
/// orders, so the first item depends on the sequence of comparisons.
///
/// Source: CPython 3.11, `heapq`; GCC 13, `bits/stl_heap.h`
#[derive(Clone, Debug)]
pub struct HeapQ<T>(Vec<T>);

impl<T> Default for HeapQ<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T: Copy + Precedes> HeapQ<T> {
    /// Returns whether the heap is empty.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Removes all items.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Adds an item.
    pub fn push(&mut self, item: T) {
        self.0.push(item);
        self.rise(self.0.len() - 1, item);
    }

    /// Removes and returns the first item.
    pub fn pop(&mut self) -> Option<T> {
        let last = self.0.pop()?;
        let Some(&first) = self.0.first() else { return Some(last) };
        let (len, mut hole) = (self.0.len(), 0);
        // The hole sinks to a leaf without regard to `last`, which then rises.
        while 2 * hole + 2 < len {
            let (left, right) = (2 * hole + 1, 2 * hole + 2);
            let child = if self.0[left].precedes(&self.0[right]) { left } else { right };
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

    /// Moves an item up from a hole while it precedes the hole's parent.
    fn rise(&mut self, mut hole: usize, item: T) {
        while hole > 0 {
            let parent = (hole - 1) / 2;
            if !item.precedes(&self.0[parent]) {
                break;
            }
            self.0[hole] = self.0[parent];
            hole = parent;
        }
        self.0[hole] = item;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Items of equal priority; the number tells them apart.
    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Item(u32);

    impl Precedes for Item {
        fn precedes(&self, _: &Self) -> bool {
            false
        }
    }

    fn order(num: u32) -> Vec<u32> {
        let mut heap = HeapQ::default();
        for item in 0..num {
            heap.push(Item(item));
        }
        std::iter::from_fn(|| heap.pop()).map(|item| item.0).collect()
    }

    /// The expected order, worked out by hand from the steps of `push_heap` and `pop_heap`.
    #[test]
    fn equal_items_leave_in_the_order_of_libstdcpp() {
        // Pop 0: the hole takes 2 (right), then 5, its only child; 6 fills that place: [2, 1, 5, 3, 4, 6].
        // Pop 2: the hole takes 5 (right), whose only child 6 was removed as the last: [5, 1, 6, 3, 4].
        // Pop 5: takes 6, a leaf; 4 fills it: [6, 1, 4, 3]. Pop 6: takes 4, a leaf; 3 fills it: [4, 1, 3].
        // Pop 4: takes 1, the only child; 3 fills its place: [1, 3].
        assert_eq!(order(7), [0, 2, 5, 6, 4, 1, 3]);
    }

    #[test]
    fn empty_and_single_heaps_are_popped() {
        assert!(order(0).is_empty());
        assert_eq!(order(1), [0]);
    }
}
