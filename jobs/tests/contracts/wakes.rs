//! Workers come when called, sleep otherwise, end when dropped, and are never waited for in vain.
//!
//! In:    many short runs with pauses; blocked, busy and idle workers.
//! Out:   the tests end; a lost wake-up would hang them.
//! Keeps: nothing.
//! Not here: results (`loops`, `order`).

use crate::{COUNTS, Random, run_one, toil, workers};
use overfly_jobs::{Graph, Span, StartError, Team, WorkerOptions, Workers};
use std::sync::Barrier;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;
use std::time::Duration;

fn add_eight(sum: &AtomicU32, team: &Team) {
    team.for_each_index(8, |_| _ = sum.fetch_add(1, Ordering::Relaxed));
}

#[test]
fn twenty_thousand_short_runs_with_pauses_lose_no_wake_up() {
    let mut random = Random(11);
    for count in [1, 2, 4] {
        let workers = workers(count);
        let mut graph = Graph::<AtomicU32>::new();
        let first = graph.stage(Span("first"), &[], add_eight);
        let left = graph.stage(Span("left"), &[first], add_eight);
        let right = graph.stage(Span("right"), &[first], add_eight);
        graph.stage(Span("last"), &[left, right], add_eight);
        for _ in 0..7000 {
            let sum = AtomicU32::new(0);
            graph.run(&sum, &workers).unwrap();
            assert_eq!(sum.into_inner(), 32);
            // From not at all to longer than the spin, to meet every state on the way to sleep.
            match random.below(8) {
                0 => thread::sleep(Duration::from_micros(random.below(80))),
                1 | 2 => (0..random.below(4000)).for_each(|_| std::hint::spin_loop()),
                _ => {}
            }
        }
    }
}

#[test]
fn sleeping_workers_are_woken_for_stages() {
    // The barrier lets nobody pass until every worker is there: serial execution would hang.
    let workers = workers(3);
    let meet = Barrier::new(4);
    let mut graph = Graph::<Barrier>::new();
    for span in [Span("a"), Span("b"), Span("c"), Span("d")] {
        graph.stage(span, &[], |meet, _| {
            meet.wait();
            // So long that the next run remembers it as worth a wake-up.
            toil(100);
        });
    }
    for _ in 0..50 {
        graph.run(&meet, &workers).unwrap();
        // Longer than the spin: the next run finds all asleep.
        thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn sleeping_workers_are_woken_for_long_chunks() {
    let workers = workers(3);
    let note = |helped: &AtomicU32, caller| {
        toil(100);
        helped.fetch_add(u32::from(thread::current().id() != caller), Ordering::Relaxed);
    };
    let caller = thread::current().id();
    let mut graph = Graph::<(AtomicU32, AtomicU32)>::new();
    let split = graph.stage(Span("loop"), &[], move |helped, team| {
        team.for_each_index(16, |_| note(&helped.0, caller));
    });
    graph.each(Span("each"), &[split], |_| 16, move |helped, _, _| note(&helped.1, caller));
    let helped = (AtomicU32::new(0), AtomicU32::new(0));
    for _ in 0..50 {
        graph.run(&helped, &workers).unwrap();
        thread::sleep(Duration::from_millis(1));
    }
    assert!(helped.0.into_inner() > 0 && helped.1.into_inner() > 0);
}

#[test]
fn a_caller_that_sleeps_is_woken_by_the_last_stage() {
    let workers = workers(1);
    let mut graph = Graph::<Barrier>::new();
    for span in [Span("one"), Span("two")] {
        graph.stage(span, &[], |meet, _| {
            // The thread that leads goes on to find nothing while the other stays.
            if meet.wait().is_leader() {
                thread::sleep(Duration::from_millis(2));
            }
        });
    }
    for _ in 0..50 {
        graph.run(&Barrier::new(2), &workers).unwrap();
    }
}

#[test]
fn an_owner_that_sleeps_is_woken_by_the_last_chunk() {
    // Chunks that wait for each other need a worker woken before the first: chaos always wakes.
    let options = WorkerOptions { count: 1, chaos: Some(3), ..WorkerOptions::default() };
    let workers = Workers::with(options).unwrap();
    let mut graph = Graph::<Barrier>::new();
    graph.stage(Span("tail"), &[], |meet, team| {
        let stage_thread = thread::current().id();
        team.for_each_index(2, |_| {
            meet.wait();
            if thread::current().id() != stage_thread {
                thread::sleep(Duration::from_millis(2));
            }
        });
    });
    for _ in 0..50 {
        graph.run(&Barrier::new(2), &workers).unwrap();
    }
}

#[test]
fn a_run_ends_while_every_worker_is_busy_with_another() {
    let workers = workers(2);
    let (entered, leave) = (Barrier::new(2), Barrier::new(2));
    thread::scope(|scope| {
        scope.spawn(|| {
            run_one(&(&entered, &leave), &workers, |(entered, leave), _| {
                entered.wait();
                leave.wait();
            });
        });
        entered.wait();
        let sum = AtomicU32::new(0);
        run_one(&sum, &workers, |sum, team| {
            assert_eq!(team.workers(), 0);
            team.for_each_index(100, |_| _ = sum.fetch_add(1, Ordering::Relaxed));
        });
        assert_eq!(sum.into_inner(), 100);
        leave.wait();
    });
}

#[test]
fn a_stage_may_run_another_graph_on_the_same_workers() {
    for count in COUNTS {
        let context = (workers(count), AtomicU32::new(0));
        run_one(&context, &context.0, |(workers, sum), _| {
            run_one(sum, workers, |sum, team| {
                team.for_each_index(10, |_| _ = sum.fetch_add(1, Ordering::Relaxed));
            });
        });
        assert_eq!(context.1.into_inner(), 10);
    }
}

#[test]
fn workers_end_when_dropped_fresh_idle_or_just_used() {
    for count in COUNTS {
        for pause_us in [None, Some(0), Some(500)] {
            let workers = workers(count);
            if let Some(pause_us) = pause_us {
                run_one(&(), &workers, |(), team| team.for_each_index(64, |_| ()));
                thread::sleep(Duration::from_micros(pause_us));
            }
            drop(workers);
        }
    }
}

#[test]
fn more_than_sixty_four_workers_are_refused() {
    let refusal = Workers::new(65).err().unwrap();
    assert!(matches!(refusal, StartError::TooMany { asked: 65 }));
    assert_eq!(refusal.to_string(), "65 workers were asked for, at most 64 are possible");
    assert_eq!(workers(64).count(), 64);
}
