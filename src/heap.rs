//! Heap calls of a frame: the program's allocator, which counts for whoever asks.
//!
//! In:    a closure that runs a frame.
//! Out:   how often it had memory allocated, by the threads that take part in the frame.
//! Keeps: the count, and whether anybody asks; memory is the system's.
//! Not here: who asks (`cli::flown`), what may be spent (`overfly::replay::budget`).
//!
//! Loaders and all other threads are left out, so that a count does not hang on their timing.
//! Crates that count were looked at: they count one thread or all, and some move what grows.
#![allow(unsafe_code, reason = "allocators are unsafe, and this one passes every call on")]

use overfly::jobs::takes_part;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// The system's allocator with a look at who calls.
struct Heap;

#[global_allocator]
static HEAP: Heap = Heap;

/// Somebody asks: elsewhere a call costs one look at this.
static IS_ASKED: AtomicBool = AtomicBool::new(false);
static CALLS: AtomicU64 = AtomicU64::new(0);

thread_local! {
    /// This thread is the one that asks.
    static ASKS: Cell<bool> = const { Cell::new(false) };
}

/// What `frame` returns, and how often it allocated: calls for new memory and for more, by this
/// thread, and by those that take part in frames meanwhile. One thread at a time may ask.
pub fn counted<R>(frame: impl FnOnce() -> R) -> (R, u64) {
    let before = CALLS.load(Ordering::Relaxed);
    ASKS.set(true);
    IS_ASKED.store(true, Ordering::Relaxed);
    let result = frame();
    IS_ASKED.store(false, Ordering::Relaxed);
    ASKS.set(false);
    (result, CALLS.load(Ordering::Relaxed) - before)
}

fn note() {
    if IS_ASKED.load(Ordering::Relaxed) && (ASKS.get() || takes_part()) {
        CALLS.fetch_add(1, Ordering::Relaxed);
    }
}

// SAFETY: every call is passed on to the system's allocator unchanged; counting allocates nothing.
unsafe impl GlobalAlloc for Heap {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note();
        // SAFETY: the caller keeps this function's contract, which is the system's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        note();
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note();
        // SAFETY: as above.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly::jobs::{Graph, Span, Workers};
    use std::hint::black_box;
    use std::sync::Barrier;

    /// The least of many counts: other tests of this program may have workers of their own.
    fn least(mut frame: impl FnMut()) -> u64 {
        (0..100).map(|_| counted(&mut frame).1).min().expect("a hundred")
    }

    #[test]
    fn calls_of_caller_and_workers_count_and_those_of_others_do_not() {
        assert_eq!(counted(|| 7).0, 7);
        assert_eq!(least(|| ()), 0);
        assert_eq!(least(|| drop(black_box(vec![0_u8; 10]))), 1, "giving back is none");
        let grown = || {
            let mut bytes = Vec::<u8>::with_capacity(10);
            bytes.reserve_exact(1000);
            drop(black_box(bytes));
        };
        assert_eq!(least(grown), 2, "more memory is a call");

        for workers in [0, 1, 2, 4] {
            let workers = Workers::new(workers).unwrap();
            let mut graph = Graph::<()>::new();
            graph.each(
                Span("boxes"),
                &[],
                |()| 64,
                |(), chunk, _| {
                    drop(black_box(Box::new(chunk)));
                },
            );
            assert_eq!(least(|| graph.run(&(), &workers).unwrap()), 64, "a box a chunk");
        }

        let (meet, part) = (Barrier::new(2), Barrier::new(2));
        let others = || {
            meet.wait();
            drop(black_box(vec![1_u8; 4096]));
            part.wait();
        };
        let calls = std::thread::scope(|threads| {
            threads.spawn(|| (0..100).for_each(|_| others()));
            least(|| {
                meet.wait();
                part.wait();
            })
        });
        assert_eq!(calls, 0, "another thread's");
    }
}
