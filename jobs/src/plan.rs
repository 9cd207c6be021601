//! A graph compiled to flat arrays, with the counters of its runs.
//!
//! In:    the kinds of the nodes and the edges between them.
//! Out:   per node its successors, those that wait for it alone first, and what they wait for.
//! Keeps: counters that end a run as they began it.
//! Not here: who runs what (`walk`), closures and names (`graph`).

use crate::ready::Ready;
use crate::sync::{Shim, Word};
use crate::tickets::Tickets;
use std::sync::atomic::Ordering;

/// No such index.
pub(crate) const NONE: u32 = u32::MAX;

/// What running a node means.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    /// One call, on any worker.
    Stage,
    /// One call, on the caller.
    Pinned,
    /// A call per chunk, on all workers.
    Each,
    /// The end of the run.
    End,
}

/// One thing that a worker can start; in [`Ready`] as `node * 4 + kind`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Job {
    /// The node.
    Begin(u32),
    /// Chunks of the node, begun by somebody else.
    Chunks(u32),
    /// The successors that waited for this node alone, but for the first.
    Followers(u32),
    /// The node, by the caller only.
    Pinned(u32),
}

impl Job {
    /// The jobs, in each word of [`Ready`], that all workers may do.
    pub(crate) const ANYBODY: u64 = 0x7777_7777_7777_7777;
    /// Those that only the caller may do.
    pub(crate) const CALLER: u64 = !Self::ANYBODY;

    pub(crate) fn number(self) -> usize {
        let (node, kind) = match self {
            Job::Begin(node) => (node, 0),
            Job::Chunks(node) => (node, 1),
            Job::Followers(node) => (node, 2),
            Job::Pinned(node) => (node, 3),
        };
        node as usize * 4 + kind
    }

    pub(crate) fn of(number: usize) -> Job {
        let node = u32::try_from(number / 4).expect("made from 32 bits");
        match number % 4 {
            0 => Job::Begin(node),
            1 => Job::Chunks(node),
            2 => Job::Followers(node),
            _ => Job::Pinned(node),
        }
    }
}

/// A node, with its successors as a range of [`Plan::successors`].
#[derive(Clone, Copy)]
pub(crate) struct Node {
    /// The successors that wait for this node alone begin here,
    pub(crate) lone: u32,
    /// those that wait for others too here,
    pub(crate) joint: u32,
    /// and here they end.
    pub(crate) end: u32,
    pub(crate) kind: Kind,
    /// The only successor, if it waits for others too; else [`NONE`].
    pub(crate) tail: u32,
    /// The only successor, if it is a stage that waits for this node alone; else [`NONE`].
    pub(crate) heir: u32,
    /// Index in [`Plan::tickets`] for the chunks, or [`NONE`].
    pub(crate) chunks: u32,
    /// Index in [`Plan::tickets`] for the followers, or [`NONE`] if there are fewer than two.
    pub(crate) followers: u32,
    /// Every follower is a stage with a tail: running one makes no other work for this worker, so
    /// many may be claimed at once.
    pub(crate) fan: bool,
}

impl Node {
    /// Number of successors after the first that wait for this node alone.
    pub(crate) fn follower_count(&self) -> usize {
        (self.joint - self.lone).saturating_sub(1) as usize
    }
}

/// A compiled graph.
///
/// Two nodes are added: `end` after all that nobody follows, so that the end of a run is counted
/// like everything else, and `source` before all that wait for none.
pub(crate) struct Plan<S: Shim> {
    pub(crate) nodes: Box<[Node]>,
    pub(crate) successors: Box<[u32]>,
    pub(crate) tickets: Box<[Tickets<S>]>,
    pub(crate) ready: Ready<S>,
    /// Some node is [`Kind::Pinned`].
    pub(crate) has_pinned: bool,
    waits: Box<[u64]>,
    /// How many each still waits for; whoever counts to 0 sets it back to `waits`.
    left: Box<[S::Word]>,
    /// 1: a predecessor failed or was skipped. Whoever skips the node sets it back. While a node
    /// runs: it failed itself.
    doomed: Box<[S::Word]>,
    /// How long nodes last; behind those of all nodes, how long each one's followers do.
    costs: Box<[S::Word]>,
}

/// What a node lasts that was never timed. Long enough to wake somebody for it.
const UNTIMED: u64 = u64::MAX;

impl<S: Shim> Plan<S> {
    /// Compiles nodes and edges (before, after); an edge may be there twice.
    pub(crate) fn new(kinds: &[Kind], edges: &[(u32, u32)]) -> Plan<S> {
        let end = u32::try_from(kinds.len()).expect("fewer than 2^32 nodes");
        let source = end + 1;
        let mut edges = edges.to_vec();
        edges.sort_unstable();
        edges.dedup();
        let (leads, follows) = ends_of(&edges, kinds.len());
        edges.extend((0..end).filter(|&node| !leads[node as usize]).map(|node| (node, end)));
        edges.extend((0..end).filter(|&node| !follows[node as usize]).map(|node| (source, node)));
        let mut waits = vec![0_u64; source as usize + 1];
        edges.iter().for_each(|&(_, after)| waits[after as usize] += 1);
        edges.sort_unstable_by_key(|&(before, after)| (before, waits[after as usize] > 1, after));
        let mut kinds = kinds.to_vec();
        kinds.extend([Kind::End, Kind::Stage]);
        let mut nodes = flat_nodes(&kinds, &edges, &waits);
        let successors: Box<[u32]> = edges.into_iter().map(|(_, after)| after).collect();
        let tickets = assign_tickets(&mut nodes, &successors);
        Plan {
            ready: Ready::new(nodes.len() * 4),
            has_pinned: kinds.contains(&Kind::Pinned),
            nodes: nodes.into(),
            successors,
            tickets: (0..tickets).map(|_| Tickets::new()).collect(),
            left: waits.iter().map(|&waits| S::Word::new(waits)).collect(),
            doomed: waits.iter().map(|_| S::Word::new(0)).collect(),
            costs: (0..waits.len() * 2).map(|_| S::Word::new(UNTIMED)).collect(),
            waits: waits.into(),
        }
    }

    /// The node before all others.
    pub(crate) fn source(&self) -> u32 {
        u32::try_from(self.nodes.len() - 1).expect("fewer than 2^32 nodes")
    }

    /// A graph without nodes of its own.
    pub(crate) fn is_empty(&self) -> bool {
        self.nodes.len() == 2
    }

    /// The successor of that index.
    #[inline]
    pub(crate) fn successor(&self, index: u32) -> u32 {
        self.successors[index as usize]
    }

    /// Counts `times` predecessors of `node` as done; `true` if they were the last.
    #[inline]
    pub(crate) fn release(&self, node: u32, times: u64) -> bool {
        let node = node as usize;
        // AcqRel: the last to count sees what all predecessors wrote.
        let last = self.left[node].fetch_sub(times, Ordering::AcqRel) == times;
        if last {
            self.left[node].store(self.waits[node], Ordering::Relaxed);
        }
        last
    }

    /// Marks the node as one to be skipped, or as failed.
    pub(crate) fn doom(&self, node: u32) {
        self.doomed[node as usize].store(1, Ordering::Relaxed);
    }

    /// How long a job lasts, as far as is known: of `Followers`, each of them.
    pub(crate) fn cost_ns(&self, job: Job) -> u64 {
        self.cost(job).load(Ordering::Relaxed)
    }

    /// Remembers how long a job lasted: the longest of late, so that one short run proves little.
    pub(crate) fn learn(&self, job: Job, took_ns: u64) {
        let cost = self.cost(job);
        let kept = match cost.load(Ordering::Relaxed) {
            UNTIMED => 0,
            old_ns => old_ns - old_ns / 4,
        };
        // Not one exchange: a measurement may get lost.
        cost.store(took_ns.max(kept), Ordering::Relaxed);
    }

    fn cost(&self, job: Job) -> &S::Word {
        match job {
            Job::Followers(node) => &self.costs[self.nodes.len() + node as usize],
            Job::Begin(node) | Job::Chunks(node) | Job::Pinned(node) => &self.costs[node as usize],
        }
    }

    /// Takes the mark off; `true` if there was one.
    pub(crate) fn absolve(&self, node: u32) -> bool {
        let doomed = self.doomed[node as usize].load(Ordering::Relaxed) != 0;
        if doomed {
            self.doomed[node as usize].store(0, Ordering::Relaxed);
        }
        doomed
    }
}

/// Which nodes come before some other, and which come after.
fn ends_of(edges: &[(u32, u32)], count: usize) -> (Vec<bool>, Vec<bool>) {
    let (mut leads, mut follows) = (vec![false; count], vec![false; count]);
    for &(before, after) in edges {
        leads[before as usize] = true;
        follows[after as usize] = true;
    }
    (leads, follows)
}

/// The nodes with the ranges of their successors in `edges`, which are sorted.
fn flat_nodes(kinds: &[Kind], edges: &[(u32, u32)], waits: &[u64]) -> Vec<Node> {
    let index = |at: usize| u32::try_from(at).expect("fewer than 2^32 edges");
    let mut at = 0;
    let mut nodes = Vec::with_capacity(kinds.len());
    for (number, &kind) in kinds.iter().enumerate() {
        let own = edges[at..].iter().take_while(|(before, _)| *before as usize == number).count();
        let after = &edges[at..at + own];
        let lone = after.iter().take_while(|(_, after)| waits[*after as usize] == 1).count();
        let (tail, heir) = match after {
            [(_, only)] if lone == 0 => (*only, NONE),
            [(_, only)] if kinds[*only as usize] == Kind::Stage => (NONE, *only),
            _ => (NONE, NONE),
        };
        nodes.push(Node {
            lone: index(at),
            joint: index(at + lone),
            end: index(at + own),
            kind,
            tail,
            heir,
            chunks: NONE,
            followers: NONE,
            fan: false,
        });
        at += own;
    }
    nodes
}

/// Gives each node the tickets it needs; returns how many there are.
fn assign_tickets(nodes: &mut [Node], successors: &[u32]) -> u32 {
    let mut next = 0;
    let mut take = || {
        next += 1;
        next - 1
    };
    for number in 0..nodes.len() {
        let node = nodes[number];
        if node.kind == Kind::Each {
            nodes[number].chunks = take();
        }
        if node.follower_count() > 1 {
            nodes[number].followers = take();
            let lone = &successors[node.lone as usize..node.joint as usize];
            let leaf = |node: &Node| node.kind == Kind::Stage && node.tail != NONE;
            nodes[number].fan = lone.iter().all(|&after| leaf(&nodes[after as usize]));
        }
    }
    next
}
