//! The protocols under model checkers: graphs whose nodes check what they may rely on.
//!
//! In:    shapes of graphs: kinds, edges, chunks, which nodes fail.
//! Out:   assertions in every schedule that a checker tries.
//! Keeps: nothing between schedules.
//! Not here: real threads (`tests/contracts`).

mod by_loom;
mod by_shuttle;

use crate::crew::{Crew, CrewSize};
use crate::plan::{Kind, Plan};
use crate::sync::{Shim, Word};
use crate::walk::{Hand, Walk, Work};
use std::ops::Range;
use std::sync::atomic::Ordering::Relaxed;

/// A node of a modelled graph.
#[derive(Clone)]
struct Shape {
    kind: Kind,
    after: Vec<u32>,
    /// Chunks of an `Each`; of a stage, the indices of its own loop.
    chunks: usize,
    fails: bool,
}

impl Shape {
    fn stage(after: &[u32]) -> Shape {
        Shape { kind: Kind::Stage, after: after.to_vec(), chunks: 0, fails: false }
    }

    fn pinned(after: &[u32]) -> Shape {
        Shape { kind: Kind::Pinned, ..Shape::stage(after) }
    }

    fn each(after: &[u32], chunks: usize) -> Shape {
        Shape { kind: Kind::Each, chunks, ..Shape::stage(after) }
    }

    fn looping(after: &[u32], chunks: usize) -> Shape {
        Shape { chunks, ..Shape::stage(after) }
    }

    fn failing(self) -> Shape {
        Shape { fails: true, ..self }
    }
}

/// What the nodes of one run did. All accesses are relaxed: a model checker shows a node the old
/// values unless the protocols order them.
struct Trace<'a, S: Shim> {
    shapes: &'a [Shape],
    crew: Option<&'a Crew<S>>,
    /// 1 when a node is done.
    done: Vec<S::Word>,
    /// Calls of each chunk of each node.
    hits: Vec<Vec<S::Word>>,
    cancelled: S::Word,
    /// Which node cancels the run.
    cancels: Option<u32>,
}

impl<'a, S: Shim> Trace<'a, S> {
    fn new(shapes: &'a [Shape], crew: Option<&'a Crew<S>>, cancels: Option<u32>) -> Self {
        let words = |count: usize| (0..count).map(|_| S::Word::new(0)).collect::<Vec<_>>();
        Trace {
            shapes,
            crew,
            done: words(shapes.len()),
            hits: shapes.iter().map(|shape| words(shape.chunks)).collect(),
            cancelled: S::Word::new(0),
            cancels,
        }
    }

    fn is_done(&self, node: u32) -> bool {
        self.done[node as usize].load(Relaxed) == 1
    }

    fn enter(&self, node: u32) {
        let shape = &self.shapes[node as usize];
        assert!(shape.after.iter().all(|&before| self.is_done(before)), "{node} is too early");
        assert!(!self.is_done(node), "{node} runs twice");
    }

    fn leave(&self, node: u32) {
        for hits in &self.hits[node as usize] {
            assert_eq!(hits.load(Relaxed), 1, "a chunk of {node}");
        }
        self.done[node as usize].store(1, Relaxed);
        if self.cancels == Some(node) {
            self.cancelled.store(1, Relaxed);
        }
    }

    fn hit(&self, node: u32, chunk: usize) {
        let shape = &self.shapes[node as usize];
        assert!(shape.after.iter().all(|&before| self.is_done(before)), "chunk of {node} is early");
        let hits = &self.hits[node as usize][chunk];
        assert_eq!(hits.fetch_add(1, Relaxed), 0, "chunk {chunk} of {node} runs twice");
    }

    /// A loop inside a stage, as `Team` makes it, one index per ticket.
    fn own_loop(&self, node: u32, lane: usize) {
        let next = S::Word::new(0);
        let claim = || usize::try_from(next.fetch_add(1, Relaxed)).ok();
        let drain = || {
            let chunks = std::iter::from_fn(claim);
            let own = chunks.take_while(|chunk| *chunk < self.shapes[node as usize].chunks);
            own.for_each(|chunk| self.hit(node, chunk));
        };
        match self.crew.map(|crew| (crew, crew.claim_loop(lane))) {
            Some((crew, Some(claim))) => claim.open(&|_| drain(), 1, || {
                crew.announce(1);
                drain();
            }),
            _ => drain(),
        }
    }

    /// After the run: done are exactly the nodes without a failure before them.
    fn check(&self) {
        let mut passed = Vec::new();
        for (node, shape) in (0..).zip(self.shapes) {
            let fine = !shape.fails && shape.after.iter().all(|&before| passed[before as usize]);
            passed.push(fine);
            if self.cancels.is_none() {
                assert_eq!(self.is_done(node), fine, "node {node} at the end");
            }
        }
    }
}

impl<S: Shim> Work for Trace<'_, S> {
    fn is_cancelled(&self) -> bool {
        self.cancels.is_some() && self.cancelled.load(Relaxed) == 1
    }

    fn stages(
        &self,
        first: u32,
        hand: &mut Hand,
        mut follow: impl FnMut(u32) -> Option<u32>,
    ) -> (u32, bool) {
        let mut node = first;
        loop {
            let shape = &self.shapes[node as usize];
            assert!(shape.kind != Kind::Pinned || hand.lane == 0, "{node} is pinned");
            self.enter(node);
            if shape.fails {
                return (node, false);
            }
            if shape.chunks > 0 {
                self.own_loop(node, hand.lane);
            }
            self.leave(node);
            match follow(node) {
                Some(next) => node = next,
                None => return (node, true),
            }
        }
    }

    fn count(&self, node: u32, _: &mut Hand) -> Option<usize> {
        self.enter(node);
        Some(self.shapes[node as usize].chunks)
    }

    fn chunks(
        &self,
        node: u32,
        _: &mut Hand,
        claim: &mut dyn FnMut() -> Option<Range<usize>>,
    ) -> bool {
        let shape = &self.shapes[node as usize];
        let mut chunks = std::iter::from_fn(claim).flatten();
        chunks.all(|chunk| {
            self.hit(node, chunk);
            !(shape.fails && chunk == 0)
        })
    }

    fn chunks_end(&self, node: u32, _: &mut Hand) {
        if !self.shapes[node as usize].fails {
            self.leave(node);
        }
    }

    fn idle(&self, _: &mut Hand) {}

    fn busy(&self, _: &mut Hand, _: bool) {}
}

fn plan_of<S: Shim>(shapes: &[Shape]) -> Plan<S> {
    let kinds: Vec<_> = shapes.iter().map(|shape| shape.kind).collect();
    let edges: Vec<_> = (0..)
        .zip(shapes)
        .flat_map(|(node, shape)| shape.after.iter().map(move |&before| (before, node)))
        .collect();
    Plan::new(&kinds, &edges)
}

fn crew_of<S: Shim>(own: usize, seats: usize) -> Crew<S> {
    Crew::new(&CrewSize { own, seats, spin_ns: 1, spinners: 64 }, None)
}

/// Runs the graph `runs` times as its caller.
fn lead<S: Shim>(crew: &Crew<S>, shapes: &[Shape], runs: usize, cancels: Option<u32>) {
    let plan = plan_of::<S>(shapes);
    for _ in 0..runs {
        let claim = crew.claim_run().expect("nobody else runs anything");
        let trace = Trace::new(shapes, Some(crew), cancels);
        let walk = Walk::new(&plan, &trace, Some(crew));
        claim.open(&|lane| walk.help(lane), 8, || walk.lead());
        trace.check();
    }
}
