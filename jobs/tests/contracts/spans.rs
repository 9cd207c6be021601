//! Every stage has a time, and the times agree with the order.
//!
//! In:    a small graph with loops.
//! Out:   assertions on the records, never on how long anything took.
//! Keeps: nothing.
//! Not here: order seen from inside the stages (`order`).

use crate::{COUNTS, workers};
use overfly_jobs::{Graph, Span, SpanRecord, Spans, WaitKind, now_ns};
use std::thread;
use std::time::Duration;

fn record(spans: &Spans, name: &'static str) -> SpanRecord {
    let mut found = spans.stages().filter(|record| record.span == Span(name));
    let record = *found.next().unwrap();
    assert_eq!(found.next(), None, "one record per stage");
    record
}

#[test]
fn records_are_complete_and_agree_with_the_edges() {
    let edges = [("a", "b"), ("a", "c"), ("b", "d"), ("c", "d")];
    for count in COUNTS {
        let workers = workers(count);
        let mut graph = Graph::<()>::new();
        let a = graph.stage(Span("a"), &[], |(), team| team.for_each_index(64, |_| ()));
        let b = graph.stage(Span("b"), &[a], |(), team| team.for_each_index(64, |_| ()));
        let c = graph.stage(Span("c"), &[a], |(), _| ());
        graph.stage(Span("d"), &[b, c], |(), _| ());
        assert_eq!(graph.spans().records().count(), 0);
        for _ in 0..100 {
            let before_ns = now_ns();
            graph.run(&(), &workers).unwrap();
            let after_ns = now_ns();
            let spans = graph.spans();
            assert_eq!(spans.stages().count(), 4);
            assert_eq!(spans.dropped(), 0);
            for record in spans.records() {
                assert!(usize::from(record.worker) <= count);
                assert!(before_ns <= record.begin_ns);
                assert!(record.begin_ns <= record.end_ns);
                assert!(record.end_ns <= after_ns);
            }
            for (before, after) in edges {
                assert!(record(spans, before).end_ns <= record(spans, after).begin_ns);
            }
        }
    }
}

#[test]
fn tickets_lie_inside_their_stage_and_are_one_per_worker_and_loop() {
    for count in COUNTS {
        let workers = workers(count);
        let mut graph = Graph::<()>::new();
        graph.stage(Span("loop"), &[], |(), team| team.for_each_index(200, |_| ()));
        for _ in 0..100 {
            graph.run(&(), &workers).unwrap();
            let stage = record(graph.spans(), "loop");
            let mut seen = Vec::new();
            for ticket in graph.spans().tickets() {
                assert_eq!(ticket.span, stage.span);
                assert!(stage.begin_ns <= ticket.begin_ns && ticket.end_ns <= stage.end_ns);
                assert!(!seen.contains(&ticket.worker));
                seen.push(ticket.worker);
            }
            assert!(!seen.is_empty());
            let wall_ns = graph.spans().stage_ns(Span("loop")).unwrap();
            assert_eq!(wall_ns, stage.end_ns - stage.begin_ns);
        }
    }
}

#[test]
fn tickets_that_do_not_fit_are_counted() {
    let workers = workers(0);
    let mut graph = Graph::<()>::new();
    graph.stage(Span("many"), &[], |(), team| {
        for _ in 0..1000 {
            team.for_each_index(1, |_| ());
        }
    });
    for _ in 0..2 {
        graph.run(&(), &workers).unwrap();
        let kept = u64::try_from(graph.spans().tickets().count()).unwrap();
        assert!(kept > 0);
        assert!(graph.spans().dropped() > 0);
        assert_eq!(kept + graph.spans().dropped(), 1000);
        assert_eq!(graph.spans().stages().count(), 1);
    }
}

#[test]
fn nodes_of_chunks_have_a_record_and_a_ticket_per_worker() {
    for count in COUNTS {
        let workers = workers(count);
        let mut graph = Graph::<()>::new();
        let before = graph.stage(Span("before"), &[], |(), _| ());
        let each = graph.each(Span("each"), &[before], |()| 500, |(), _, _| ());
        graph.each(Span("none"), &[each], |()| 0, |(), _, _| ());
        for _ in 0..100 {
            graph.run(&(), &workers).unwrap();
            let stage = record(graph.spans(), "each");
            assert!(record(graph.spans(), "before").end_ns <= stage.begin_ns);
            assert!(stage.end_ns <= record(graph.spans(), "none").begin_ns);
            let mut seen = Vec::new();
            for ticket in graph.spans().tickets() {
                assert_eq!(ticket.span, stage.span);
                assert!(stage.begin_ns <= ticket.begin_ns && ticket.end_ns <= stage.end_ns);
                assert!(!seen.contains(&ticket.worker));
                seen.push(ticket.worker);
            }
            assert!((1..=count + 1).contains(&seen.len()));
        }
    }
}

#[test]
fn waits_are_recorded_and_lie_beside_the_work() {
    let workers = workers(1);
    let mut graph = Graph::<()>::new();
    // The worker has nothing to do for longer than it spins: it spins or sleeps, and is missed.
    let alone = graph.stage(Span("alone"), &[], |(), _| thread::sleep(Duration::from_millis(2)));
    graph.each(Span("each"), &[alone], |()| 64, |(), _, _| ());
    for _ in 0..20 {
        let _frame = workers.frame();
        graph.run(&(), &workers).unwrap();
        let spans = graph.spans();
        for wait in spans.waits() {
            assert!(wait.begin_ns <= wait.end_ns);
            assert!(matches!(wait.kind, WaitKind::Spin | WaitKind::Park));
            let apart = |other: &SpanRecord| {
                other.worker != wait.worker
                    || other.end_ns <= wait.begin_ns
                    || wait.end_ns <= other.begin_ns
            };
            assert!(spans.tickets().all(apart));
            assert!(apart(&record(spans, "alone")));
        }
        let helper = 1 - record(spans, "alone").worker;
        assert!(spans.waits().any(|wait| wait.worker == helper && wait.end_ns > wait.begin_ns));
    }
}

#[test]
fn without_recording_there_are_no_spans() {
    let mut graph = Graph::<()>::new();
    let stage = graph.stage(Span("stage"), &[], |(), team| team.for_each_index(9, |_| ()));
    graph.each(Span("each"), &[stage], |()| 9, |(), _, _| ());
    for (records, expected) in [(true, 2), (false, 0), (true, 2)] {
        graph.record_spans(records);
        graph.run(&(), &workers(1)).unwrap();
        assert_eq!(graph.spans().stages().count(), expected);
        assert_eq!(graph.spans().tickets().count() > 0, records);
        assert_eq!(graph.spans().waits().count() > 0, records);
    }
}
