//! A run allocates nothing once the graph and the workers have met.
//!
//! In:    graphs with loops, wide and narrow, run until warm.
//! Out:   an assertion that the allocator was not called.
//! Keeps: a count of calls, from all threads of this test's process.
//! Not here: anything else; the replaced allocator is why this is a binary of its own.

use overfly_jobs::{Graph, Span, Team, Workers};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

struct Counting;

static CALLS: AtomicU64 = AtomicU64::new(0);

// SAFETY: every method passes its arguments on to `System`, whose contract is the same.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        CALLS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller keeps `alloc`'s contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn realloc(&self, old: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        CALLS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller keeps `realloc`'s contract.
        unsafe { System.realloc(old, layout, new_size) }
    }

    unsafe fn dealloc(&self, old: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps `dealloc`'s contract.
        unsafe { System.dealloc(old, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn work(sum: &AtomicU64, team: &Team) {
    team.for_each_index(64, |_| _ = sum.fetch_add(1, Ordering::Relaxed));
    team.for_each_chunk(&mut [0_u8; 100], 9, |_, chunk| chunk.fill(1));
}

/// A chain of loops that fans out to more stages than a small queue would hold.
fn graph() -> Graph<AtomicU64> {
    let mut graph = Graph::new();
    let mut last = Vec::new();
    for _ in 0..8 {
        last = vec![graph.stage(Span("chain"), &last, work)];
    }
    let wide: Vec<_> = (0..200).map(|_| graph.stage(Span("wide"), &last, work)).collect();
    graph.stage(Span("end"), &wide, work);
    graph
}

// One test in this binary: the count is of the whole process.
#[test]
fn a_warm_run_allocates_nothing() {
    for count in [0, 1, 2, 4] {
        let workers = Workers::new(count).unwrap();
        let mut graph = graph();
        let sum = AtomicU64::new(0);
        for _ in 0..20 {
            graph.run(&sum, &workers).unwrap();
        }
        // A thread allocates while it starts; give all of them the time.
        thread::sleep(Duration::from_millis(20));
        let before = CALLS.load(Ordering::Relaxed);
        for run in 0..200 {
            graph.run(&sum, &workers).unwrap();
            if run % 10 == 0 {
                thread::sleep(Duration::from_micros(200));
            }
        }
        let calls = CALLS.load(Ordering::Relaxed) - before;
        assert_eq!(calls, 0, "{count} workers");
        assert_eq!(sum.into_inner(), 220 * 209 * 64);
    }
}
