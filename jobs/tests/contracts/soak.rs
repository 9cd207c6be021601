//! Many frames with random pauses, under a watchdog.
//!
//! In:    workers of all kinds, frames held and not held, sleeps around the length of the spin.
//! Out:   the number of frames; a frame that never ends is reported instead of waited for.
//! Keeps: nothing.
//! Not here: millions of frames (`examples/soak.rs`).

use crate::Random;
use overfly_jobs::{Graph, Span, WorkerOptions, Workers};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

const FRAMES: usize = 25_000;

/// Longer than any frame on any machine, shorter than patience.
const STUCK: Duration = Duration::from_secs(60);

fn graph() -> Graph<AtomicU64> {
    let mut graph = Graph::new();
    let first = graph.stage(Span("first"), &[], |sum: &AtomicU64, team| {
        team.for_each_index(5, |_| _ = sum.fetch_add(1, Ordering::Relaxed));
    });
    let each = graph.each(
        Span("each"),
        &[first],
        |_| 7,
        |sum, _, _| {
            sum.fetch_add(1, Ordering::Relaxed);
        },
    );
    let sides: Vec<_> = (0..4)
        .map(|_| {
            graph.stage(Span("side"), &[first], |sum, _| _ = sum.fetch_add(1, Ordering::Relaxed))
        })
        .collect();
    let pinned = graph.pinned(Span("pinned"), &sides, |sum, _| {
        sum.fetch_add(1, Ordering::Relaxed);
    });
    graph.stage(Span("last"), &[each, pinned], |sum, _| {
        assert_eq!(sum.fetch_add(1, Ordering::Relaxed), 5 + 7 + 4 + 1);
    });
    graph
}

fn pause(random: &mut Random) {
    match random.below(10) {
        0 => thread::sleep(Duration::from_micros(random.below(300))),
        1 => thread::yield_now(),
        2 | 3 => (0..random.below(6000)).for_each(|_| std::hint::spin_loop()),
        _ => {}
    }
}

fn frames(workers: &Workers, seed: u64, beat: impl Fn()) -> usize {
    let mut random = Random(seed);
    let mut graph = graph();
    (0..FRAMES)
        .map(|_| {
            let held = (random.below(2) == 0).then(|| workers.frame());
            pause(&mut random);
            let sum = AtomicU64::new(0);
            graph.run(&sum, workers).unwrap();
            assert_eq!(sum.into_inner(), 18);
            pause(&mut random);
            drop(held);
            beat();
        })
        .count()
}

fn soak(options: WorkerOptions, seed: u64) {
    let (beats, heard) = channel();
    let work = thread::spawn(move || {
        let workers = Workers::with(options).unwrap();
        frames(&workers, seed, || beats.send(()).unwrap())
    });
    let mut seen = 0;
    loop {
        match heard.recv_timeout(STUCK) {
            Ok(()) => seen += 1,
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => panic!("frame {seen} does not end"),
        }
    }
    assert_eq!((work.join().unwrap(), seen), (FRAMES, FRAMES));
}

#[test]
fn many_frames_of_one_worker() {
    soak(WorkerOptions { count: 1, ..WorkerOptions::default() }, 1);
}

#[test]
fn many_frames_of_workers_that_hardly_spin() {
    soak(WorkerOptions { count: 3, spin_us: 2, ..WorkerOptions::default() }, 2);
}

#[test]
fn many_frames_of_more_workers_than_cores() {
    soak(WorkerOptions { count: 6, spin_us: 20, ..WorkerOptions::default() }, 3);
}
