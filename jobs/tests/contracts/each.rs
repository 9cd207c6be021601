//! A parallel-for as a node: every chunk once, between the stages before and after.
//!
//! In:    graphs with `each` and `pinned` nodes, 0 to 7 workers.
//! Out:   assertions.
//! Keeps: nothing.
//! Not here: loops inside a stage (`loops`).

use crate::{COUNTS, workers};
use overfly_jobs::{Graph, Scratch, Span, StagePanic, Team};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};
use std::thread;

type Counts = Vec<AtomicU32>;

fn counts(len: usize) -> Counts {
    (0..len).map(|_| AtomicU32::new(0)).collect()
}

fn raise(counts: &Counts, chunk: usize, _: &mut Scratch<'_>) {
    counts[chunk].fetch_add(1, Ordering::Relaxed);
}

#[test]
fn every_chunk_comes_once_per_run_between_its_neighbours() {
    for count in COUNTS {
        let workers = workers(count);
        for chunks in [0, 1, 2, 3, 64, 10_000] {
            let mut graph = Graph::<Counts>::new();
            let first = graph.each(Span("first"), &[], Vec::len, raise);
            let check = graph.stage(Span("check"), &[first], |counts, _| {
                let odd = |count: &AtomicU32| count.load(Ordering::Relaxed) % 2 == 1;
                assert!(counts.iter().all(odd), "all of the first, none of the second");
            });
            graph.each(Span("second"), &[check], Vec::len, raise);
            let counts = counts(chunks);
            for run in 1..=10 {
                graph.run(&counts, &workers).unwrap();
                assert!(counts.iter().all(|count| count.load(Ordering::Relaxed) == 2 * run));
                assert_eq!(graph.spans().stages().count(), 3);
            }
        }
    }
}

#[test]
fn the_number_of_chunks_may_change_from_run_to_run() {
    let workers = workers(2);
    let mut graph = Graph::<(AtomicUsize, Counts)>::new();
    graph.each(
        Span("some"),
        &[],
        |(len, _)| len.load(Ordering::Relaxed),
        |(_, counts), chunk, scratch| raise(counts, chunk, scratch),
    );
    for len in [5, 0, 700, 1, 64] {
        let context = (AtomicUsize::new(len), counts(700));
        graph.run(&context, &workers).unwrap();
        let calls = context.1.iter().map(|count| count.load(Ordering::Relaxed));
        assert!(calls.enumerate().all(|(chunk, calls)| calls == u32::from(chunk < len)));
    }
}

#[test]
fn independent_loops_run_side_by_side_and_join() {
    for count in COUNTS {
        let workers = workers(count);
        let mut graph = Graph::<Counts>::new();
        let sides = [(); 5].map(|()| graph.each(Span("side"), &[], Vec::len, raise));
        graph.stage(Span("end"), &sides, |counts, _| {
            assert!(counts.iter().all(|count| count.load(Ordering::Relaxed) == 5));
        });
        for _ in 0..50 {
            graph.run(&counts(100), &workers).unwrap();
        }
    }
}

#[test]
fn a_panic_in_a_chunk_or_in_the_count_skips_what_follows_only() {
    for count in COUNTS {
        let workers = workers(count);
        let mut graph = Graph::<(AtomicU32, AtomicU32)>::new();
        let bad = graph.each(
            Span("bad"),
            &[],
            |(fault, _)| if fault.load(Ordering::Relaxed) == 1 { panic!("count") } else { 100 },
            |(fault, _), chunk, _| {
                assert!(fault.load(Ordering::Relaxed) != 2 || chunk != 50, "chunk {chunk}");
            },
        );
        graph.stage(Span("after"), &[bad], |(_, ran), _| _ = ran.fetch_add(1, Ordering::Relaxed));
        graph.stage(Span("beside"), &[], |(_, ran), _| _ = ran.fetch_add(10, Ordering::Relaxed));
        for run in 0..30 {
            let context = (AtomicU32::new(run % 3), AtomicU32::new(0));
            let panic =
                |message: &str| Err(StagePanic { span: Span("bad"), message: message.to_owned() });
            let expected = [(Ok(()), 11), (panic("count"), 10), (panic("chunk 50"), 10)];
            let (result, ran) = &expected[run as usize % 3];
            assert_eq!(graph.run(&context, &workers), *result);
            assert_eq!(context.1.into_inner(), *ran);
        }
    }
}

#[test]
fn more_chunks_than_can_be_counted_are_a_panic_of_the_stage() {
    let mut graph = Graph::<()>::new();
    graph.each(Span("vast"), &[], |()| 1 << 28, |(), _, _| unreachable!());
    let panic = graph.run(&(), &workers(1)).unwrap_err();
    assert_eq!(panic.message, "268435456 chunks are more than 268435455");
}

fn count_on_caller((caller, ran): &(thread::ThreadId, Mutex<u32>), _: &Team<'_>) {
    assert_eq!(thread::current().id(), *caller);
    *ran.lock().unwrap() += 1;
}

#[test]
fn pinned_stages_run_on_the_caller_only() {
    for count in COUNTS {
        let workers = workers(count);
        let mut graph = Graph::<(thread::ThreadId, Mutex<u32>)>::new();
        let mut last = Vec::new();
        for _ in 0..4 {
            let wide = [(); 6].map(|()| graph.stage(Span("wide"), &last, |_, _| ()));
            let pins = wide.map(|wide| graph.pinned(Span("pin"), &[wide], count_on_caller));
            last = pins.to_vec();
        }
        for _ in 0..100 {
            let context = (thread::current().id(), Mutex::new(0));
            graph.run(&context, &workers).unwrap();
            assert_eq!(context.1.into_inner().unwrap(), 24);
        }
    }
}
