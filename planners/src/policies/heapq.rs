//! A binary heap that breaks ties like Python's `heapq`.

/// A heap that sifts exactly like Python's `heapq`.
///
/// [`std::collections::BinaryHeap`] does not suffice. The comparison of POGEMA's A* is not an order, so the first node
/// depends on the sequence of comparisons.
///
/// Source: CPython 3.11, `heapq`
#[derive(Clone, Debug)]
pub(super) struct HeapQ<T> {
    items: Vec<T>,
    is_less: fn(&T, &T) -> bool,
}

impl<T: Copy> HeapQ<T> {
    /// Creates an empty heap with a comparison.
    pub fn new(is_less: fn(&T, &T) -> bool) -> Self {
        Self { items: Vec::new(), is_less }
    }

    /// Returns whether the heap is empty.
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// Adds an item.
    pub fn push(&mut self, item: T) {
        self.items.push(item);
        self.rise(self.items.len() - 1);
    }

    /// Removes the first item.
    pub fn pop(&mut self) -> Option<T> {
        let last = self.items.pop()?;
        let Some(first) = self.items.first_mut() else { return Some(last) };
        let taken = std::mem::replace(first, last);
        let leaf = self.sink_to_leaf();
        self.rise(leaf);
        Some(taken)
    }

    /// Moves an item up until its parent is not greater.
    fn rise(&mut self, mut at: usize) {
        while at > 0 {
            let parent = (at - 1) / 2;
            if !(self.is_less)(&self.items[at], &self.items[parent]) {
                break;
            }
            self.items.swap(at, parent);
            at = parent;
        }
    }

    /// Moves the first item down to a leaf along the smaller children, without comparing the item itself.
    fn sink_to_leaf(&mut self) -> usize {
        let mut at = 0;
        loop {
            let (left, right) = (2 * at + 1, 2 * at + 2);
            if left >= self.items.len() {
                return at;
            }
            let goes_right =
                right < self.items.len() && !(self.is_less)(&self.items[left], &self.items[right]);
            let child = if goes_right { right } else { left };
            self.items.swap(at, child);
            at = child;
        }
    }
}
