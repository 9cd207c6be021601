//! An allocator that counts, for tests of what allocates nothing.
//!
//! In:    calls for memory, of all threads of the test's process.
//! Out:   how many there were so far, for new memory and for more, and for how many bytes.
//! Keeps: the counts; memory is the system's.
//! Not here: counts of one thread (`ground_queries`), of a frame (`src/heap.rs`).
//!
//! A test that has this is a binary of its own, with one test in it. Crates include it by its path.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

struct Counting;

#[global_allocator]
static COUNTING: Counting = Counting;

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);
static BYTES: AtomicU64 = AtomicU64::new(0);

/// Allocations of the process so far.
#[allow(dead_code, reason = "some want the bytes too")]
pub fn allocations() -> u64 {
    so_far()[0]
}

/// Allocations of the process so far, and the bytes that they asked for.
pub fn so_far() -> [u64; 2] {
    [&ALLOCATIONS, &BYTES].map(|count| count.load(Ordering::Relaxed))
}

fn count(bytes: usize) {
    ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
    BYTES.fetch_add(bytes as u64, Ordering::Relaxed);
}

// SAFETY: every call is passed on to the system allocator unchanged; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: the caller keeps this function's contract, which is the system allocator's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size);
        // SAFETY: as above.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}
