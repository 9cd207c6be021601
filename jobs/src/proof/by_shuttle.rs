//! Random schedules of larger graphs, the same ones every time.
//!
//! In:    seeded random graphs of up to 14 nodes with failures, on up to 4 threads.
//! Out:   assertions; shuttle reports deadlocks.
//! Keeps: nothing.
//! Not here: all schedules and weak memory (`by_loom`).

use super::{Shape, crew_of, lead};
use crate::crew::Crew;
use crate::plan::Kind;
use crate::sync::shim;
use shuttle::scheduler::{PctScheduler, RandomScheduler, Scheduler};
use shuttle::thread;
use shuttle::{Config, Runner};
use std::sync::Arc;

struct Shuttle;

impl Shuttle {
    /// Whoever sleeps is woken, in a loop after the first claim.
    const WORTH_WAKING_NS: u64 = 0;

    fn clock_ns() -> u64 {
        0
    }

    /// Polls a few times, with the others in between.
    fn spin(_: u64, done: impl Fn() -> bool) -> bool {
        (0..3).any(|_| {
            let over = done();
            if !over {
                thread::yield_now();
            }
            over
        })
    }
}

shim!(Shuttle, shuttle);

/// Repeatable numbers; Knuth's MMIX constants.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end
    }
}

fn random_shapes(random: &mut Random) -> Vec<Shape> {
    let count = 1 + random.below(14);
    (0..count)
        .map(|node| {
            let after = (0..node).filter(|_| random.below(4) == 0);
            let after: Vec<_> = after.map(|before| u32::try_from(before).unwrap()).collect();
            let kind = [Kind::Stage, Kind::Stage, Kind::Each, Kind::Pinned][random.below(4)];
            let chunks = if kind == Kind::Pinned { 0 } else { random.below(3) * random.below(4) };
            let fails = random.below(12) == 0 && (kind != Kind::Each || chunks > 0);
            Shape { kind, after, chunks, fails }
        })
        .collect()
}

/// One execution: some frames on own workers and guests.
fn frames(seed: u64) {
    let mut random = Random(seed);
    let (own, seats) = (1 + random.below(3), random.below(2));
    let crew: Arc<Crew<Shuttle>> = Arc::new(crew_of(own, seats));
    let workers: Vec<_> = (1..=own)
        .map(|lane| {
            let crew = Arc::clone(&crew);
            thread::spawn(move || crew.serve(lane))
        })
        .collect();
    for _ in 0..2 {
        let shapes = random_shapes(&mut random);
        crew.open_frame(random.below(2) == 0);
        let opening = crew.opening().unwrap();
        let guests: Vec<_> = (0..seats)
            .map(|_| {
                let crew = Arc::clone(&crew);
                thread::spawn(move || crew.visit(opening))
            })
            .collect();
        let cancels = (random.below(5) == 0).then(|| u32::try_from(random.below(14)).unwrap());
        lead(&crew, &shapes, 2, cancels);
        crew.close_frame();
        guests.into_iter().for_each(|guest| _ = guest.join().unwrap());
    }
    crew.stop();
    workers.into_iter().for_each(|worker| worker.join().unwrap());
}

fn check(scheduler: impl Scheduler + 'static, seed: u64) {
    let mut config = Config::new();
    config.stack_size = 0x2_0000;
    // Weak memory is for loom to try.
    config.silence_warnings = true;
    Runner::new(scheduler, config).run(move || frames(seed));
}

#[test]
fn random_graphs_under_random_schedules() {
    for seed in 0..60 {
        check(RandomScheduler::new_from_seed(seed, 40), seed);
    }
}

#[test]
fn random_graphs_under_schedules_with_few_changes_of_priority() {
    for seed in 100..160 {
        check(PctScheduler::new_from_seed(seed, 3, 40), seed);
    }
}
