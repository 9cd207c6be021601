//! Scratch is a worker's own, always filled as asked, and too little of it is an error with a size.
//!
//! In:    stages and chunks that ask for memory.
//! Out:   assertions.
//! Keeps: nothing.
//! Not here: that it allocates nothing (`allocation.rs`).

use crate::{COUNTS, run_one, workers};
use overfly_jobs::{Graph, ScratchFull, Span, Team};
use std::sync::atomic::{AtomicU64, Ordering};

#[test]
fn each_chunk_has_the_whole_block_to_itself() {
    for count in COUNTS {
        let mut graph = Graph::<AtomicU64>::new();
        graph.scratch_bytes(8000);
        graph.each(
            Span("sum"),
            &[],
            |_| 500,
            |sum, chunk, scratch| {
                let bytes = scratch.slice(3, 7_u8);
                let numbers = scratch.slice(900, chunk as u64);
                assert_eq!(bytes, [7; 3]);
                assert!(numbers.iter().all(|number| *number == chunk as u64));
                numbers.fill(u64::MAX);
                sum.fetch_add(1, Ordering::Relaxed);
            },
        );
        let sum = AtomicU64::new(0);
        graph.run(&sum, &workers(count)).unwrap();
        assert_eq!(sum.into_inner(), 500);
    }
}

#[test]
fn too_much_is_refused_with_its_size_and_takes_nothing() {
    let mut graph = Graph::<()>::new();
    graph.scratch_bytes(64);
    graph.stage(Span("greedy"), &[], |(), team| {
        team.scratch(|scratch| {
            let refusal = scratch.try_slice(9, 0_u64).unwrap_err();
            assert_eq!(
                refusal,
                ScratchFull { asked_bytes: 72, left_bytes: 64, capacity_bytes: 64 }
            );
            assert_eq!(scratch.slice(8, 1_u64), [1; 8]);
            assert_eq!(scratch.left_bytes(), 0);
            assert!(scratch.try_slice(usize::MAX, 0_u64).is_err());
            scratch.slice(1, 0_u8);
        });
    });
    let panic = graph.run(&(), &workers(0)).unwrap_err();
    assert_eq!(panic.message, "1 bytes of scratch were asked for, 0 of 64 are left");
}

#[test]
fn scratch_inside_scratch_is_empty_and_without_a_size_there_is_none() {
    Team::alone().scratch(|scratch| assert_eq!(scratch.left_bytes(), 0));
    run_one(&(), &workers(1), |(), team| team.scratch(|own| assert_eq!(own.left_bytes(), 0)));
    let mut graph = Graph::<()>::new();
    graph.scratch_bytes(10);
    graph.stage(Span("nested"), &[], |(), team| {
        team.scratch(|outer| {
            assert_eq!(outer.left_bytes(), 16, "rounded up to what every value can start at");
            team.scratch(|inner| assert_eq!(inner.left_bytes(), 0));
        });
    });
    graph.run(&(), &workers(1)).unwrap();
}
