//! Random graphs give the same bits under every schedule, and survive panics and cancels in any.
//!
//! In:    generated graphs of stages, loops, loop nodes and pinned stages, with faults.
//! Out:   equal hashes, and the same stages skipped as a plain walk over the graph says.
//! Keeps: nothing.
//! Not here: schedules under a model checker (the crate's own `proof`).

use crate::Random;
use overfly_jobs::{Cancel, Graph, Span, StageId, Stopped, Team, WorkerOptions, Workers};
use proptest::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Stage,
    Loop,
    Each,
    Pinned,
}

#[derive(Clone, Debug)]
struct Node {
    kind: Kind,
    before: Vec<usize>,
    chunks: usize,
    panics: bool,
    cancels: bool,
}

struct Context {
    /// One row of cells per node.
    cells: Vec<Vec<AtomicU64>>,
    cancel: Cancel,
}

fn mix(a: u64, b: u64) -> u64 {
    (a ^ b.rotate_left(23)).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(31)
}

/// A cell of a node: from its place and one cell of each node before.
fn fill(context: &Context, nodes: &[Node], node: usize, chunk: usize) {
    // Not 0, which stands for a cell that was not filled.
    let mut value = mix(node as u64 + 1, chunk as u64);
    for &before in &nodes[node].before {
        let row = &context.cells[before];
        value = mix(value, row[(chunk * 7) % row.len()].load(Ordering::Relaxed));
    }
    context.cells[node][chunk].store(value, Ordering::Relaxed);
}

fn act(context: &Context, nodes: &[Node], node: usize, team: &Team) {
    if nodes[node].cancels {
        context.cancel.cancel();
    }
    assert!(!nodes[node].panics, "node {node}");
    if nodes[node].kind == Kind::Loop {
        team.for_each_index(nodes[node].chunks, |chunk| fill(context, nodes, node, chunk));
    } else {
        (0..nodes[node].chunks).for_each(|chunk| fill(context, nodes, node, chunk));
    }
}

fn act_on_chunk(context: &Context, nodes: &[Node], node: usize, chunk: usize) {
    if nodes[node].cancels {
        context.cancel.cancel();
    }
    assert!(!nodes[node].panics || chunk != nodes[node].chunks / 2, "node {node}");
    fill(context, nodes, node, chunk);
}

fn build(nodes: &[Node]) -> Graph<Context> {
    let mut graph = Graph::new();
    let mut ids: Vec<StageId> = Vec::new();
    for (node, shape) in nodes.iter().enumerate() {
        let after: Vec<_> = shape.before.iter().map(|&before| ids[before]).collect();
        let (nodes, chunks) = (nodes.to_vec(), shape.chunks);
        ids.push(match shape.kind {
            Kind::Each => graph.each(
                Span("each"),
                &after,
                move |_| chunks,
                move |context, chunk, _| act_on_chunk(context, &nodes, node, chunk),
            ),
            Kind::Pinned => graph.pinned(Span("pinned"), &after, move |context, team| {
                act(context, &nodes, node, team);
            }),
            _ => graph.stage(Span("stage"), &after, move |context, team| {
                act(context, &nodes, node, team);
            }),
        });
    }
    graph
}

fn context(nodes: &[Node]) -> Context {
    let row = |node: &Node| (0..node.chunks).map(|_| AtomicU64::new(0)).collect();
    Context { cells: nodes.iter().map(row).collect(), cancel: Cancel::new() }
}

fn hash(context: &Context) -> u64 {
    let cells = context.cells.iter().flatten();
    cells.fold(1, |hash, cell| mix(hash, cell.load(Ordering::Relaxed)))
}

/// Which nodes run to their end when nothing is cancelled.
fn passing(nodes: &[Node]) -> Vec<bool> {
    let mut passing: Vec<bool> = Vec::new();
    for node in nodes {
        passing.push(!node.panics && node.before.iter().all(|&before| passing[before]));
    }
    passing
}

fn random_nodes(random: &mut Random, faults: bool) -> Vec<Node> {
    let count = 1 + random.index(30);
    (0..count)
        .map(|node| Node {
            kind: [Kind::Stage, Kind::Loop, Kind::Each, Kind::Pinned][random.index(4)],
            before: (0..node).filter(|_| random.below(5) == 0).collect(),
            chunks: 1 + random.index(40),
            panics: faults && random.below(15) == 0,
            cancels: faults && random.below(60) == 0,
        })
        .collect()
}

fn chaotic(count: usize, seed: u64) -> Workers {
    let options = WorkerOptions { count, chaos: Some(seed), ..WorkerOptions::default() };
    Workers::with(options).unwrap()
}

#[test]
fn a_chaotic_schedule_gives_the_hash_of_the_plain_one() {
    let mut random = Random(5);
    let plain: Vec<_> = [0, 1, 3].map(crate::workers).into();
    let chaos = [(1, 1), (2, 2), (5, 3)].map(|(count, seed)| chaotic(count, seed));
    for _ in 0..60 {
        let nodes = random_nodes(&mut random, false);
        let mut graph = build(&nodes);
        let alone = context(&nodes);
        graph.run(&alone, &Workers::none()).unwrap();
        for workers in plain.iter().chain(&chaos) {
            for _ in 0..3 {
                let found = context(&nodes);
                graph.run(&found, workers).unwrap();
                assert_eq!(hash(&found), hash(&alone), "{nodes:?}");
            }
        }
    }
}

/// A run with faults: what it says agrees with what the nodes left behind.
fn check_faulty_run(nodes: &[Node], graph: &mut Graph<Context>, workers: &Workers) {
    let context = context(nodes);
    let result = graph.run_unless(&context, workers, &context.cancel);
    let passing = passing(nodes);
    let done =
        |node: usize| context.cells[node].iter().all(|cell| cell.load(Ordering::Relaxed) != 0);
    for (node, shape) in nodes.iter().enumerate() {
        assert!(!done(node) || passing[node], "{node} follows a panic");
        assert!(!done(node) || shape.before.iter().all(|&before| done(before)));
    }
    let all_done = (0..nodes.len()).all(|node| done(node) || !passing[node]);
    match result {
        Ok(()) => assert!(all_done && passing.iter().all(|passing| *passing)),
        Err(Stopped::Cancelled) => assert!(context.cancel.is_cancelled()),
        Err(Stopped::Panicked(panic)) => {
            let number: usize = panic.message.strip_prefix("node ").unwrap().parse().unwrap();
            assert!(nodes[number].panics);
        }
    }
    assert!(all_done || context.cancel.is_cancelled());
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 150,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// Workers are made and dropped in every case, so shutdowns meet every state, too.
    #[test]
    fn graphs_with_panics_and_cancels_end_as_they_should(
        seed in any::<u64>(), count in 0_usize..5, chaos in any::<Option<u64>>(), runs in 1..6,
    ) {
        let nodes = random_nodes(&mut Random(seed), true);
        let mut graph = build(&nodes);
        let options = WorkerOptions { count, chaos, ..WorkerOptions::default() };
        let workers = Workers::with(options).unwrap();
        for _ in 0..runs {
            check_faulty_run(&nodes, &mut graph, &workers);
        }
    }
}

#[test]
fn a_cancel_skips_what_is_not_begun_and_can_be_taken_back() {
    for count in crate::COUNTS {
        let workers = crate::workers(count);
        let mut graph = Graph::<(Cancel, AtomicU64)>::new();
        let first = graph.stage(Span("first"), &[], |(cancel, _), _| cancel.cancel());
        let each = graph.each(
            Span("each"),
            &[first],
            |_| 9,
            |(_, ran), _, _| {
                ran.fetch_add(1, Ordering::Relaxed);
            },
        );
        graph.stage(Span("last"), &[each], |(_, ran), _| _ = ran.fetch_add(1, Ordering::Relaxed));
        let context = (Cancel::new(), AtomicU64::new(0));
        for _ in 0..10 {
            let result = graph.run_unless(&context, &workers, &context.0);
            assert_eq!(result, Err(Stopped::Cancelled));
            assert_eq!(context.1.load(Ordering::Relaxed), 0);
            assert_eq!(graph.spans().stages().count(), 1);
            context.0.reset();
        }
        assert_eq!(graph.run(&context, &workers), Ok(()), "`run` does not know of the flag");
        assert_eq!(context.1.into_inner(), 10);
    }
}
