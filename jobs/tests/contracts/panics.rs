//! A panic comes back as a result, skips what follows its stage and breaks nothing.
//!
//! In:    graphs whose stages or chunks panic on demand.
//! Out:   assertions.
//! Keeps: nothing.
//! Not here: order without panics (`order`).

use crate::{COUNTS, workers};
use overfly_jobs::{Graph, Span, StagePanic};
use std::panic::panic_any;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

#[derive(Default)]
struct Context {
    faulty: AtomicBool,
    ran: AtomicU32,
}

impl Context {
    fn count(&self) {
        self.ran.fetch_add(1, Ordering::Relaxed);
    }

    fn faulty(&self) -> bool {
        self.faulty.load(Ordering::Relaxed)
    }
}

fn panic_of(span: &'static str, message: &str) -> Result<(), StagePanic> {
    Err(StagePanic { span: Span(span), message: message.to_owned() })
}

#[test]
fn a_panic_in_a_stage_skips_its_dependants_only_and_the_graph_stays_usable() {
    for count in COUNTS {
        let workers = workers(count);
        let mut graph = Graph::<Context>::new();
        let bad = graph.stage(Span("bad"), &[], |context, _| {
            assert!(!context.faulty(), "height {} is no number", 7);
        });
        let other = graph.stage(Span("other"), &[], |context, _| context.count());
        let child = graph.stage(Span("child"), &[bad, other], |context, _| context.count());
        graph.stage(Span("grandchild"), &[child], |context, _| context.count());
        graph.stage(Span("beside"), &[other], |context, _| context.count());
        let mut context = Context::default();
        for _ in 0..20 {
            *context.faulty.get_mut() = true;
            *context.ran.get_mut() = 0;
            let result = graph.run(&context, &workers);
            assert_eq!(result, panic_of("bad", "height 7 is no number"));
            assert_eq!(*context.ran.get_mut(), 2, "the other and the one beside");
            assert_eq!(graph.spans().stages().count(), 3);
            assert_eq!(graph.spans().stage_ns(Span("child")), None);

            *context.faulty.get_mut() = false;
            *context.ran.get_mut() = 0;
            assert_eq!(graph.run(&context, &workers), Ok(()));
            assert_eq!(*context.ran.get_mut(), 4);
        }
    }
}

#[test]
fn a_panic_in_a_chunk_ends_its_loop_and_its_stage() {
    for count in COUNTS {
        let workers = workers(count);
        let mut graph = Graph::<Context>::new();
        let bad = graph.stage(Span("bad"), &[], |context, team| {
            let mut items = [0; 1000];
            team.for_each_chunk(&mut items, 10, |first, chunk| {
                assert!(!context.faulty() || first != 500, "chunk {first}");
                chunk.fill(1);
            });
            assert_eq!(items, [1; 1000]);
            context.count();
        });
        graph.stage(Span("child"), &[bad], |context, _| context.count());
        let mut context = Context::default();
        for _ in 0..20 {
            *context.faulty.get_mut() = true;
            *context.ran.get_mut() = 0;
            assert_eq!(graph.run(&context, &workers), panic_of("bad", "chunk 500"));
            assert_eq!(*context.ran.get_mut(), 0);

            *context.faulty.get_mut() = false;
            assert_eq!(graph.run(&context, &workers), Ok(()));
            assert_eq!(*context.ran.get_mut(), 2);
        }
    }
}

#[test]
fn a_panic_in_every_chunk_is_reported_once() {
    for count in COUNTS {
        let mut graph = Graph::<()>::new();
        graph.stage(Span("bad"), &[], |(), team| {
            team.for_each_index(100, |_| panic!("each"));
        });
        assert_eq!(graph.run(&(), &workers(count)), panic_of("bad", "each"));
    }
}

#[test]
fn a_stage_may_catch_the_panic_of_its_own_loop() {
    let mut graph = Graph::<()>::new();
    graph.stage(Span("careful"), &[], |(), team| {
        let attempt = std::panic::AssertUnwindSafe(|| team.for_each_index(9, |_| panic!("inner")));
        assert!(std::panic::catch_unwind(attempt).is_err());
        let sum = AtomicU32::new(0);
        team.for_each_index(9, |_| {
            sum.fetch_add(1, Ordering::Relaxed);
        });
        assert_eq!(sum.into_inner(), 9);
    });
    assert_eq!(graph.run(&(), &workers(2)), Ok(()));
}

#[test]
fn a_panic_without_text_is_reported_too() {
    let mut graph = Graph::<()>::new();
    graph.stage(Span("odd"), &[], |(), _| panic_any(5));
    let result = graph.run(&(), &workers(0));
    assert_eq!(result, panic_of("odd", "a panic without text"));
    assert_eq!(result.unwrap_err().to_string(), "stage odd panicked: a panic without text");
}
