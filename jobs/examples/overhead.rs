//! What the scheduler costs: medians for graphs that do nothing.
//!
//! In:    a number of workers as the only argument; 1 by default.
//! Out:   one line per shape, in microseconds per run.
//! Keeps: nothing.
//! Not here: assertions; times depend on the machine.

use overfly_jobs::{Graph, Span, Workers, now_ns};
use std::env;
use std::hint;
use std::thread;
use std::time::Duration;

fn main() {
    let count = env::args().nth(1).and_then(|count| count.parse().ok()).unwrap_or(1);
    let workers = Workers::new(count).expect("the number of workers is at most 64");
    println!("{count} workers and the caller");
    report("8 loops of 64 empty chunks", &mut loops(0), &workers, 0);
    report("8 loops of 64 chunks of 2 us", &mut loops(2_000), &workers, 0);
    report("the same after 5 ms of sleep", &mut loops(2_000), &workers, 5);
    report("a chain of 1000 empty stages", &mut chain(), &workers, 0);
    report("1000 empty stages side by side", &mut fan(), &workers, 0);
}

/// Prints the median and the 99th percentile of up to 2000 runs.
fn report(what: &str, graph: &mut Graph<()>, workers: &Workers, pause_ms: u64) {
    let mut times_ns: Vec<u64> = (0..if pause_ms == 0 { 2000 } else { 200 })
        .map(|_| {
            thread::sleep(Duration::from_millis(pause_ms));
            let begin_ns = now_ns();
            graph.run(&(), workers).expect("no stage panics");
            now_ns() - begin_ns
        })
        .collect();
    times_ns.sort_unstable();
    let at = |percent: usize| times_ns[times_ns.len() * percent / 100] as f64 / 1000.0;
    println!("{what:32} {:9.2} us median {:9.2} us p99", at(50), at(99));
}

/// Keeps the core busy that long; 0 does not even look at the clock.
fn burn(burn_ns: u64) {
    if hint::black_box(burn_ns) > 0 {
        let begin_ns = now_ns();
        while now_ns() - begin_ns < burn_ns {}
    }
}

fn loops(chunk_ns: u64) -> Graph<()> {
    let mut graph = Graph::new();
    let mut last = Vec::new();
    for _ in 0..8 {
        last = vec![graph.stage(Span("loop"), &last, move |(), team| {
            team.for_each_index(64, |_| burn(chunk_ns));
        })];
    }
    graph
}

fn chain() -> Graph<()> {
    let mut graph = Graph::new();
    let mut last = Vec::new();
    for _ in 0..1000 {
        last = vec![graph.stage(Span("chain"), &last, |(), _| ())];
    }
    graph
}

fn fan() -> Graph<()> {
    let mut graph = Graph::new();
    let root = graph.stage(Span("root"), &[], |(), _| ());
    for _ in 0..1000 {
        graph.stage(Span("fan"), &[root], |(), _| ());
    }
    graph
}
