//! A run allocates nothing once the graph and the workers have met.
//!
//! In:    graphs with loops, wide and narrow, with scratch and pinned stages, run until warm; frames
//!        held open or not, own threads or a host's.
//! Out:   an assertion that the allocator was not called.
//! Keeps: a count of calls, from all threads of this test's process.
//! Not here: anything else; the replaced allocator is why this is a binary of its own.

#[path = "../../tests/counting.rs"]
mod counting;

use counting::allocations;
use overfly_jobs::{Graph, Span, Task, Team, WorkerOptions, Workers};
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

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
    let end = graph.stage(Span("end"), &wide, work);
    let each = graph.each(
        Span("each"),
        &[end],
        |_| 640,
        |sum, chunk, scratch| {
            sum.fetch_add(scratch.slice(20, chunk as u64 % 2)[19], Ordering::Relaxed);
        },
    );
    graph.pinned(Span("pinned"), &[each], |_, team| {
        team.scratch(|scratch| assert_eq!(scratch.slice(20, 1_u64), [1; 20]));
    });
    graph.scratch_bytes(160);
    graph
}

/// Every kind of crew, with the time that its threads need to come up.
fn crews() -> Vec<Workers> {
    let mut crews: Vec<_> = [0, 1, 2, 4].map(|count| Workers::new(count).unwrap()).into();
    let options = WorkerOptions { count: 2, chaos: Some(1), ..WorkerOptions::default() };
    crews.push(Workers::with(options).unwrap());
    let enqueue = |task: Task| {
        task.run();
        7
    };
    crews.push(Workers::host(3, enqueue, |handle| assert_eq!(handle, 7)).unwrap());
    thread::sleep(Duration::from_millis(20));
    crews
}

/// 200 frames, every second with one held open over a pause.
fn frames(graph: &mut Graph<AtomicU64>, sum: &AtomicU64, workers: &Workers) {
    for run in 0..200 {
        let _frame = (run % 2 == 0).then(|| workers.frame());
        if run % 10 == 0 {
            thread::sleep(Duration::from_micros(200));
        }
        graph.run(sum, workers).unwrap();
    }
}

// One test in this binary: the count is of the whole process.
#[test]
fn a_warm_run_allocates_nothing() {
    for (index, workers) in crews().iter().enumerate() {
        for records in [true, false] {
            let mut graph = graph();
            graph.record_spans(records);
            let sum = AtomicU64::new(0);
            for _ in 0..20 {
                graph.run(&sum, workers).unwrap();
            }
            let before = allocations();
            frames(&mut graph, &sum, workers);
            let calls = allocations() - before;
            assert_eq!(calls, 0, "crew {index}, records {records}");
            assert_eq!(sum.into_inner(), 220 * (209 * 64 + 320));
        }
    }
}
