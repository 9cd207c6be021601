//! What the crate promises to its users, one file per promise.
//!
//! In:    graphs and loops over generated data, 0 to 7 workers.
//! Out:   assertions.
//! Keeps: nothing between tests.
//! Not here: allocation (`allocation.rs`, which replaces the allocator), times.

mod chaos;
mod each;
mod layers;
mod loops;
mod order;
mod panics;
mod scratch;
mod soak;
mod spans;
mod wakes;

use overfly_jobs::{Graph, Span, Team, Workers, now_ns};
use std::sync::Barrier;

/// Worker counts that every promise is tried with: none, fewer and more than this machine's cores.
const COUNTS: [usize; 5] = [0, 1, 2, 4, 7];

fn workers(count: usize) -> Workers {
    Workers::new(count).unwrap()
}

/// Runs `stage` once, as the only stage of a graph.
fn run_one<C: Sync>(
    context: &C,
    workers: &Workers,
    stage: impl Fn(&C, &Team) + Send + Sync + 'static,
) {
    let mut graph = Graph::new();
    graph.stage(Span("only"), &[], stage);
    graph.run(context, workers).unwrap();
}

/// Repeatable numbers; Knuth's MMIX constants.
struct Random(u64);

impl Random {
    /// A number below `end`.
    fn below(&mut self, end: u64) -> u64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % end
    }

    fn index(&mut self, end: usize) -> usize {
        usize::try_from(self.below(end as u64)).unwrap()
    }
}

/// Returns once that many threads, the caller included, were in one run at the same time.
fn meet(workers: &Workers, threads: usize) {
    let mut graph = Graph::<Barrier>::new();
    for _ in 0..threads {
        graph.stage(Span("meet"), &[], |barrier, _| _ = barrier.wait());
    }
    graph.run(&Barrier::new(threads), workers).unwrap();
}

/// Works that long.
fn toil(us: u64) {
    let end_ns = now_ns() + us * 1000;
    while now_ns() < end_ns {
        std::hint::spin_loop();
    }
}
