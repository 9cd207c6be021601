//! Stages run once per run and after the stages they follow.
//!
//! In:    diamonds and random graphs, run again and again.
//! Out:   assertions.
//! Keeps: nothing.
//! Not here: what happens after a panic (`panics`).

use crate::{COUNTS, Random, workers};
use overfly_jobs::{Graph, Span, StageId, Team};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

#[test]
fn a_diamond_runs_top_sides_bottom() {
    for count in COUNTS {
        let workers = workers(count);
        let mut graph = Graph::<Mutex<Vec<char>>>::new();
        let top = graph.stage(Span("top"), &[], |log, _| log.lock().unwrap().push('t'));
        let left = graph.stage(Span("left"), &[top], |log, _| log.lock().unwrap().push('s'));
        let right = graph.stage(Span("right"), &[top], |log, _| log.lock().unwrap().push('s'));
        graph.stage(Span("bottom"), &[left, right], |log, _| log.lock().unwrap().push('b'));
        for _ in 0..300 {
            let log = Mutex::new(Vec::new());
            graph.run(&log, &workers).unwrap();
            assert_eq!(log.into_inner().unwrap(), ['t', 's', 's', 'b']);
        }
    }
}

/// What the stages of a random graph leave behind.
struct Traces {
    done: Vec<AtomicBool>,
    /// Calls of each chunk of each stage.
    hits: Vec<Vec<AtomicU32>>,
}

/// A graph of up to 24 stages, each with a loop, that check on entry that those before are done.
fn random_graph(random: &mut Random) -> (Graph<Traces>, Traces) {
    let mut graph = Graph::<Traces>::new();
    let mut traces = Traces { done: Vec::new(), hits: Vec::new() };
    let mut ids: Vec<StageId> = Vec::new();
    for stage in 0..random.index(25) {
        let before: Vec<usize> = (0..stage).filter(|_| random.below(6) == 0).collect();
        let after: Vec<StageId> = before.iter().map(|&before| ids[before]).collect();
        let chunks = random.index(70);
        traces.done.push(AtomicBool::new(false));
        traces.hits.push((0..chunks).map(|_| AtomicU32::new(0)).collect());
        ids.push(graph.stage(Span("random"), &after, move |traces, team| {
            assert!(before.iter().all(|&before| traces.done[before].load(Ordering::Relaxed)));
            team.for_each_index(chunks, |chunk| {
                traces.hits[stage][chunk].fetch_add(1, Ordering::Relaxed);
            });
            assert!(!traces.done[stage].swap(true, Ordering::Relaxed));
        }));
    }
    (graph, traces)
}

#[test]
fn two_thousand_runs_of_random_graphs_run_every_chunk_once_and_in_order() {
    let mut random = Random(7);
    let crews = COUNTS.map(workers);
    for _ in 0..100 {
        let (mut graph, mut traces) = random_graph(&mut random);
        for run in 1..=20 {
            graph.run(&traces, &crews[random.index(crews.len())]).unwrap();
            assert!(traces.done.iter_mut().all(|done| std::mem::take(done.get_mut())));
            assert!(traces.hits.iter_mut().flatten().all(|hits| *hits.get_mut() == run));
        }
    }
}

fn add_one(sum: &AtomicU32, _: &Team) {
    sum.fetch_add(1, Ordering::Relaxed);
}

#[test]
fn wide_graphs_are_no_harder_than_narrow_ones() {
    for count in COUNTS {
        let workers = workers(count);
        let mut graph = Graph::<AtomicU32>::new();
        let root = graph.stage(Span("root"), &[], |_, _| ());
        let wide: Vec<_> = (0..500).map(|_| graph.stage(Span("wide"), &[root], add_one)).collect();
        graph.stage(Span("end"), &wide, |sum, _| assert_eq!(sum.load(Ordering::Relaxed), 500));
        for _ in 0..20 {
            graph.run(&AtomicU32::new(0), &workers).unwrap();
        }
    }
}

#[test]
fn stages_added_between_runs_take_part() {
    let workers = workers(1);
    let sum = AtomicU32::new(0);
    let mut graph = Graph::<AtomicU32>::default();
    graph.run(&sum, &workers).unwrap();
    let first = graph.stage(Span("first"), &[], |sum, _| sum.store(1, Ordering::Relaxed));
    graph.run(&sum, &workers).unwrap();
    graph.stage(Span("second"), &[first], |sum, _| {
        assert_eq!(sum.swap(2, Ordering::Relaxed), 1);
    });
    graph.run(&sum, &workers).unwrap();
    assert_eq!(sum.into_inner(), 2);
}

#[test]
fn the_same_predecessor_may_be_named_twice() {
    let mut graph = Graph::<()>::new();
    let first = graph.stage(Span("first"), &[], |(), _| ());
    graph.stage(Span("second"), &[first, first], |(), _| ());
    for _ in 0..3 {
        graph.run(&(), &workers(1)).unwrap();
        assert_eq!(graph.spans().stages().count(), 2);
    }
}

#[test]
#[should_panic(expected = "must follow stages added before it")]
fn a_later_stage_cannot_be_followed() {
    let mut larger = Graph::<()>::new();
    larger.stage(Span("first"), &[], |(), _| ());
    let second = larger.stage(Span("second"), &[], |(), _| ());
    Graph::<()>::new().stage(Span("early"), &[second], |(), _| ());
}
