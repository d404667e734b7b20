//! A binary heap whose ties fall as they do in Python.

/// A heap that sifts exactly as Python's `heapq` does.
///
/// [`std::collections::BinaryHeap`] will not do: POGEMA's A* compares nodes by a relation that is no order, and
/// then which node comes first depends on the very comparisons made.
///
/// Source: CPython 3.11, `heapq`
#[derive(Clone, Debug)]
pub struct Heap<T> {
    items: Vec<T>,
    is_less: fn(&T, &T) -> bool,
}

impl<T: Copy> Heap<T> {
    /// An empty heap with its comparison.
    pub fn new(is_less: fn(&T, &T) -> bool) -> Self {
        Self { items: Vec::new(), is_less }
    }

    /// Whether nothing is in it.
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// Puts an item in.
    pub fn push(&mut self, item: T) {
        self.items.push(item);
        self.rise(self.items.len() - 1);
    }

    /// Takes the first item out.
    pub fn pop(&mut self) -> Option<T> {
        let last = self.items.pop()?;
        let Some(first) = self.items.first_mut() else { return Some(last) };
        let taken = std::mem::replace(first, last);
        let leaf = self.sink_to_leaf();
        self.rise(leaf);
        Some(taken)
    }

    /// Moves the item at `at` up to where it belongs.
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

    /// Moves the first item all the way down along the smaller children, without looking at the item itself.
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
