//! An allocator that counts, so that "no allocation in a window" is a number and no promise.
//!
//! ```text
//! #[global_allocator]
//! static ALLOCATOR: CountingAllocator = CountingAllocator;
//! ```

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    // Initialised at compile time and never dropped, so that reading it allocates nothing.
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, with a count per thread.
pub struct CountingAllocator;

/// Allocations and reallocations of this thread so far; stays 0 unless [`CountingAllocator`] is installed.
pub fn allocations() -> u64 {
    COUNT.with(Cell::get)
}

/// Do work between windows, of which nothing is counted.
pub fn uncounted<T>(work: impl FnOnce() -> T) -> T {
    let before = allocations();
    let done = work();
    COUNT.with(|count| count.set(before));
    done
}

fn count() {
    COUNT.with(|c| c.set(c.get() + 1));
}

// SAFETY: every call is handed on to `System` as it came; counting touches no memory of the heap.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise, handed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise, handed on.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: the caller's promise, handed on.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise, handed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts for every test of this crate.
    #[global_allocator]
    static ALLOCATOR: CountingAllocator = CountingAllocator;

    #[test]
    fn allocations_are_counted_for_this_thread_alone() {
        let before = allocations();
        std::hint::black_box(vec![1_u8; 100]);
        assert_eq!(allocations(), before + 1);
        let there = std::thread::spawn(|| std::hint::black_box(vec![1_u8; 100]).len());
        assert_eq!(there.join().expect("a thread"), 100);
        let mut list: Vec<u8> = std::hint::black_box(Vec::with_capacity(1));
        let before = allocations();
        list.extend([1, 2, 3]);
        assert_eq!(allocations(), before + 1, "a reallocation counts");
    }
}
