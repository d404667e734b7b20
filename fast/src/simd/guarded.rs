//! Slices next to pages without access, for the tests of this crate and of `pogema-policies`.

use region::{Allocation, Protection};

/// Memory between two pages without access.
pub struct Guarded {
    memory: Allocation,
    num_bytes: usize,
}

/// Where a slice touches a guard page.
#[derive(Clone, Copy, Debug)]
pub enum Side {
    /// Its first byte follows a guard page.
    Start,
    /// Its last byte precedes a guard page.
    End,
}

impl Guarded {
    /// Allocates `num_pages` pages between two guard pages.
    pub fn new(num_pages: usize) -> Self {
        let page = region::page::size();
        let num_bytes = num_pages * page;
        let mut memory = region::alloc(num_bytes + 2 * page, Protection::READ_WRITE).unwrap();
        for guard in [0, page + num_bytes] {
            // SAFETY: both pages lie inside the allocation, and no slice contains any of their bytes.
            unsafe { region::protect(memory.as_mut_ptr::<u8>().add(guard), page, Protection::NONE).unwrap() };
        }
        Self { memory, num_bytes }
    }

    /// Returns a slice of equal numbers next to a guard page.
    pub fn slice<T: Copy>(&mut self, side: Side, len: usize, value: T) -> &mut [T] {
        assert!(len * size_of::<T>() <= self.num_bytes);
        let skipped = match side {
            Side::Start => 0,
            Side::End => self.num_bytes - len * size_of::<T>(),
        };
        // SAFETY: the bytes lie between the guard pages, belong to this slice alone, and hold numbers, for which every
        // bit pattern is valid. The start of a page is aligned for every number type, and so is an address that
        // precedes it by a multiple of the size of the type.
        let slice = unsafe {
            let first = self.memory.as_mut_ptr::<u8>().add(region::page::size() + skipped);
            std::slice::from_raw_parts_mut(first.cast::<T>(), len)
        };
        slice.fill(value);
        slice
    }
}
