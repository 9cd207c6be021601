//! Every schedule, up to a number of preemptions, and every allowed memory order of small runs.
//!
//! In:    graphs of 3 to 5 nodes on 2 or 3 threads.
//! Out:   assertions; loom reports deadlocks, which is what a lost wake-up is here.
//! Keeps: nothing.
//! Not here: larger graphs (`by_shuttle`).

use super::{Shape, crew_of, lead};
use crate::crew::Crew;
use crate::sync::shim;
use crate::tickets::{Share, Tickets};
use loom::thread;
use std::sync::Arc;

struct Loom;

impl Loom {
    /// Whoever sleeps is woken, in a loop after the first claim.
    const WORTH_WAKING_NS: u64 = 0;

    fn clock_ns() -> u64 {
        0
    }

    /// Does not spin: what a spin finds later, a worker that goes to sleep finds as well.
    fn spin(_: u64, done: impl Fn() -> bool) -> bool {
        done()
    }
}

shim!(Loom, loom);

fn explore(preemptions: usize, model: impl Fn() + Send + Sync + 'static) {
    let mut builder = loom::model::Builder::new();
    builder.preemption_bound = Some(preemptions);
    builder.max_branches = 20_000;
    builder.check(model);
}

/// Runs the graph with workers that come once, at any time or too late.
fn help_once(workers: usize, shapes: &[Shape], runs: usize, cancels: Option<u32>) {
    let crew: Arc<Crew<Loom>> = Arc::new(crew_of(workers, 0));
    let threads: Vec<_> = (1..=workers)
        .map(|lane| {
            let crew = Arc::clone(&crew);
            thread::spawn(move || crew.join_run(lane))
        })
        .collect();
    lead(&crew, shapes, runs, cancels);
    threads.into_iter().for_each(|thread| _ = thread.join().unwrap());
}

/// A frame with a run, on a worker that lives on and then ends.
fn serve(shapes: &[Shape], wake: bool) {
    let crew: Arc<Crew<Loom>> = Arc::new(crew_of(1, 0));
    let worker = {
        let crew = Arc::clone(&crew);
        thread::spawn(move || crew.serve(1))
    };
    crew.open_frame(wake);
    lead(&crew, shapes, 1, None);
    crew.close_frame();
    crew.stop();
    worker.join().unwrap();
}

fn explore_graph(preemptions: usize, workers: usize, runs: usize, shapes: &[Shape]) {
    let shapes = shapes.to_vec();
    explore(preemptions, move || help_once(workers, &shapes, runs, None));
}

#[test]
fn each_item_goes_to_one_worker_and_the_last_to_leave_sees_all() {
    explore(3, || {
        let tickets: Arc<Tickets<Loom>> = Arc::new(Tickets::new());
        let hits = Arc::new([(); 3].map(|()| loom::sync::atomic::AtomicU64::new(0)));
        let share = Share { parts: 2, most: 1 };
        let relaxed = std::sync::atomic::Ordering::Relaxed;
        let drain =
            move |tickets: &Tickets<Loom>, mut batch, hits: &[loom::sync::atomic::AtomicU64]| {
                while let Some(next) = batch {
                    let crate::tickets::Batch { items, .. } = &next;
                    items.clone().for_each(|item| assert_eq!(hits[item].fetch_add(1, relaxed), 0));
                    batch = tickets.claim(&next, share);
                }
                let last = tickets.leave();
                assert!(!last || hits.iter().all(|hits| hits.load(relaxed) == 1));
                last
            };
        let first = tickets.open(3, share);
        let others: Vec<_> = (0..2)
            .map(|_| {
                let (tickets, hits) = (Arc::clone(&tickets), Arc::clone(&hits));
                thread::spawn(move || {
                    let batch = tickets.enter(share);
                    batch.is_some() && drain(&tickets, batch, &*hits)
                })
            })
            .collect();
        let own = drain(&tickets, Some(first), &*hits);
        let lasts = others.into_iter().map(|other| other.join().unwrap()).filter(|last| *last);
        assert_eq!(lasts.count() + usize::from(own), 1);
    });
}

#[test]
fn a_diamond_and_its_second_run() {
    let diamond =
        [Shape::stage(&[]), Shape::stage(&[0]), Shape::stage(&[0]), Shape::stage(&[1, 2])];
    explore_graph(3, 1, 2, &diamond);
    explore_graph(2, 2, 1, &diamond);
}

#[test]
fn a_fan_whose_followers_are_counted_in_one_go() {
    let mut fan = vec![Shape::stage(&[])];
    fan.extend((0..3).map(|_| Shape::stage(&[0])));
    fan.push(Shape::stage(&[1, 2, 3]));
    explore_graph(3, 1, 1, &fan);
    explore_graph(1, 2, 1, &fan);
}

#[test]
fn chunks_then_chunks() {
    explore_graph(2, 1, 1, &[Shape::each(&[], 2), Shape::each(&[0], 3)]);
    explore_graph(2, 1, 2, &[Shape::each(&[], 2)]);
    explore_graph(1, 2, 1, &[Shape::each(&[], 3), Shape::each(&[0], 2)]);
}

#[test]
fn chunks_beside_a_stage() {
    let shapes = [Shape::each(&[], 2), Shape::stage(&[]), Shape::stage(&[0, 1])];
    explore_graph(3, 1, 1, &shapes);
}

#[test]
fn a_loop_inside_a_stage() {
    explore_graph(3, 1, 1, &[Shape::looping(&[], 2), Shape::stage(&[0])]);
}

#[test]
fn a_pinned_stage_waits_for_the_caller() {
    let shapes = [Shape::stage(&[]), Shape::stage(&[]), Shape::pinned(&[1]), Shape::stage(&[2])];
    explore_graph(3, 1, 1, &shapes);
}

#[test]
fn failures_skip_what_follows() {
    let shapes =
        [Shape::stage(&[]).failing(), Shape::stage(&[]), Shape::stage(&[0, 1]), Shape::stage(&[2])];
    explore_graph(2, 1, 2, &shapes);
    explore_graph(2, 1, 2, &[Shape::each(&[], 2).failing(), Shape::stage(&[0])]);
}

#[test]
fn a_cancelled_run_ends() {
    let shapes =
        [Shape::stage(&[]), Shape::stage(&[]), Shape::stage(&[0, 1]), Shape::each(&[2], 2)];
    explore(3, move || help_once(1, &shapes, 1, Some(1)));
}

#[test]
fn a_worker_that_sleeps_is_woken_by_a_run_and_by_the_end() {
    explore(2, || serve(&[Shape::stage(&[])], false));
    let shapes = [Shape::stage(&[]), Shape::stage(&[]), Shape::stage(&[0, 1])];
    explore(1, move || serve(&shapes, false));
}

#[test]
fn a_worker_woken_by_a_frame_sleeps_again() {
    explore(1, move || serve(&[Shape::each(&[], 2)], true));
}

/// A frame with a run on `count` lent threads and one seat.
fn lend(count: usize) {
    let crew: Arc<Crew<Loom>> = Arc::new(crew_of(0, 1));
    crew.open_frame(false);
    let opening = crew.opening().unwrap();
    let guests: Vec<_> = (0..count)
        .map(|_| {
            let crew = Arc::clone(&crew);
            thread::spawn(move || crew.visit(opening))
        })
        .collect();
    lead(&crew, &[Shape::each(&[], 2)], 1, None);
    crew.close_frame();
    guests.into_iter().for_each(|guest| _ = guest.join().unwrap());
    assert!(!crew.visit(opening), "a task that comes late finds its frame closed");
}

#[test]
fn a_lent_thread_leaves_when_its_frame_closes() {
    explore(2, || lend(1));
}

#[test]
fn two_lent_threads_never_share_a_seat() {
    explore(1, || lend(2));
}

#[test]
fn frames_of_two_openers_overlap() {
    explore(2, || {
        let crew: Arc<Crew<Loom>> = Arc::new(crew_of(0, 1));
        let open = |crew: &Crew<Loom>| {
            let (first, opening) = (crew.open_frame(true), crew.opening());
            assert!(opening.is_some(), "open for whoever opened it");
            usize::from(first) + 2 * usize::from(crew.close_frame())
        };
        let other = {
            let crew = Arc::clone(&crew);
            thread::spawn(move || open(&crew))
        };
        let both = open(&crew) + other.join().unwrap();
        assert!(both == 3 || both == 6, "as many first as last: {both}");
        assert_eq!(crew.opening(), None);
    });
}
