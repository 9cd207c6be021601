//! Frames without end in sight: a lost wake-up would stop the count.
//!
//! In:    the number of frames (a million by default) and of workers (3) as arguments.
//! Out:   a line every ten seconds and at the end; exit code 1 if none ends in between.
//! Keeps: nothing.
//! Not here: how long frames take (`benches/jobs`); a short soak is among the tests.

use overfly_jobs::{Graph, Span, WorkerOptions, Workers, now_ns};
use std::env;
use std::hint;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

fn main() -> ExitCode {
    let argument = |index: usize, default: u64| {
        env::args().nth(index).and_then(|text| text.parse().ok()).unwrap_or(default)
    };
    let (frames, workers) = (argument(1, 1_000_000), argument(2, 3));
    let count = usize::try_from(workers).expect("a small number");
    let done = Arc::new(AtomicU64::new(0));
    let soak = {
        let done = Arc::clone(&done);
        thread::spawn(move || soak(frames, count, &done))
    };
    let mut last = u64::MAX;
    while !soak.is_finished() {
        let now = done.load(Ordering::Relaxed);
        if now == last {
            println!("frame {now} has not ended for ten seconds");
            return ExitCode::FAILURE;
        }
        println!("{now} frames");
        last = now;
        wait(|| soak.is_finished());
    }
    soak.join().expect("no frame panics");
    println!("{} frames, all ended", done.load(Ordering::Relaxed));
    ExitCode::SUCCESS
}

/// Ten seconds, or until it is over.
fn wait(over: impl Fn() -> bool) {
    for _ in 0..100 {
        if over() {
            return;
        }
        thread::sleep(Duration::from_millis(100));
    }
}

/// Repeatable numbers: Marsaglia's xorshift64.
fn next(state: &mut u64) -> u64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    *state
}

fn pause(state: &mut u64) {
    match next(state) % 32 {
        0 => thread::sleep(Duration::from_micros(next(state) % 300)),
        1..6 => (0..next(state) % 4000).for_each(|_| hint::spin_loop()),
        6 => thread::yield_now(),
        _ => {}
    }
}

fn soak(frames: u64, count: usize, done: &AtomicU64) {
    // A short spin, so that most waits end asleep.
    let options = WorkerOptions { count, spin_us: 5, ..WorkerOptions::default() };
    let workers = Workers::with(options).expect("a few threads can be started");
    let mut graph = Graph::<AtomicU64>::new();
    graph.record_spans(false);
    let first = graph.stage(Span("first"), &[], |sum, team| {
        team.for_each_index(5, |_| _ = sum.fetch_add(1, Ordering::Relaxed));
    });
    let each = graph.each(
        Span("each"),
        &[first],
        |_| 9,
        |sum, _, _| {
            sum.fetch_add(1, Ordering::Relaxed);
        },
    );
    let side =
        graph.stage(Span("side"), &[first], |sum, _| _ = sum.fetch_add(1, Ordering::Relaxed));
    graph.pinned(Span("last"), &[each, side], |sum, _| {
        assert_eq!(sum.fetch_add(1, Ordering::Relaxed), 15);
    });
    let mut state = now_ns() | 1;
    for _ in 0..frames {
        let frame = next(&mut state).is_multiple_of(2).then(|| workers.frame());
        pause(&mut state);
        let sum = AtomicU64::new(0);
        graph.run(&sum, &workers).expect("no stage panics");
        assert_eq!(sum.into_inner(), 16);
        pause(&mut state);
        drop(frame);
        done.fetch_add(1, Ordering::Relaxed);
    }
}
