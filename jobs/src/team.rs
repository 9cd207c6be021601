//! The parallel-for of a stage.
//!
//! In:    slices or an index range, a grain (elements per chunk), a body.
//! Out:   the body called once per chunk, on this and on other workers.
//! Keeps: nothing; a loop is over when the call returns.
//! Not here: which stage runs when (`graph`), splitting and joining (`scope`).

use crate::crew::Crew;
use crate::log::Log;
use crate::run::lane_number;
use crate::scope::{Chunks, Cursor, Progress};
use crate::scratch::{Blocks, Scratch};
use crate::spans::{Span, SpanRecord, now_ns};
use parking_lot::Mutex;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

/// The workers a stage may spread a loop over.
///
/// Chunks are the multiples of the grain, whatever the number of workers; the last may be short.
/// Their order and their thread are not defined. A loop inside a chunk of a loop runs on the
/// thread of that chunk. If a body panics, chunks not yet begun are left out and the panic goes on
/// from the call.
pub struct Team<'a> {
    site: Option<Site<'a>>,
}

/// What the stages of a run share.
pub(crate) struct Desk<'a> {
    /// `None` while the workers serve another run.
    pub(crate) crew: Option<&'a Crew>,
    /// `None` while times are not recorded.
    pub(crate) log: Option<&'a Log>,
    pub(crate) blocks: &'a Blocks,
}

/// Where a stage runs.
pub(crate) struct Site<'a> {
    pub(crate) desk: &'a Desk<'a>,
    /// The worker that runs the stage.
    pub(crate) lane: u16,
    pub(crate) span: Span,
}

impl Team<'static> {
    /// A team of the caller only, for tests and for hosts without workers.
    pub fn alone() -> Team<'static> {
        Team { site: None }
    }
}

impl<'a> Team<'a> {
    /// The team of a stage of a graph.
    pub(crate) fn of(site: Site<'a>) -> Team<'a> {
        Team { site: Some(site) }
    }
}

impl Team<'_> {
    /// Number of workers that may help the one that runs the stage. Not for splitting: work split
    /// by it would differ between machines.
    pub fn workers(&self) -> usize {
        self.crew().map_or(0, Crew::count)
    }

    /// Calls `body` for each chunk of `grain` elements with the index of its first element.
    ///
    /// # Panics
    /// If `grain` is 0, or with the panic of a body.
    pub fn for_each_chunk<T: Send>(
        &self,
        items: &mut [T],
        grain: usize,
        body: impl Fn(usize, &mut [T]) + Sync,
    ) {
        assert!(grain > 0, "a chunk holds at least one element");
        let none: &mut [()] = &mut [];
        let chunks = Chunks::new(items, none, grain, |count| self.cursor(count));
        self.spread(chunks.cursor(), &|progress| {
            chunks.drain(progress, |first, items, _| body(first, items))
        });
    }

    /// Like [`Team::for_each_chunk`] over two slices of one length, cut at the same indices.
    ///
    /// # Panics
    /// If the lengths differ, if `grain` is 0, or with the panic of a body.
    pub fn for_each_chunk2<A: Send, B: Send>(
        &self,
        a: &mut [A],
        b: &mut [B],
        grain: usize,
        body: impl Fn(usize, &mut [A], &mut [B]) + Sync,
    ) {
        assert!(grain > 0, "a chunk holds at least one element");
        assert_eq!(a.len(), b.len(), "both slices have one length");
        let chunks = Chunks::new(a, b, grain, |count| self.cursor(count));
        self.spread(chunks.cursor(), &|progress| chunks.drain(progress, &body));
    }

    /// Calls `body` for each index below `count`; an index is a chunk.
    ///
    /// # Panics
    /// With the panic of a body.
    pub fn for_each_index(&self, count: usize, body: impl Fn(usize) + Sync) {
        let cursor = self.cursor(count);
        self.spread(&cursor, &|progress| cursor.drain(progress, &body));
    }

    /// Lends the memory of the worker that runs the stage to `body`. Inside itself it is empty.
    ///
    /// # Panics
    /// With the panic of the body.
    pub fn scratch<R>(&self, body: impl FnOnce(&mut Scratch<'_>) -> R) -> R {
        match &self.site {
            Some(site) => {
                site.desk.blocks.lend(site.lane.into(), |block| body(&mut Scratch::new(block)))
            }
            None => body(&mut Scratch::new(&mut [])),
        }
    }

    fn crew(&self) -> Option<&Crew> {
        self.site.as_ref().and_then(|site| site.desk.crew)
    }

    fn cursor(&self, count: usize) -> Cursor {
        let chaotic = self.crew().is_some_and(|crew| crew.chaos().is_some());
        Cursor::new(count, (self.workers() + 1).min(count), chaotic)
    }

    /// Runs `drain` here and on whoever takes a ticket. There are as many tickets, this thread's
    /// included, as there are threads or chunks, whichever is less.
    fn spread(&self, cursor: &Cursor, drain: &(dyn Fn(Progress<'_>) -> bool + Sync)) {
        let Some(site) = &self.site else {
            drain(&mut |_, _| ());
            return;
        };
        let fault = Mutex::new(None);
        let ticket = |worker: u16, progress: Progress<'_>| {
            let begin_ns = if site.desk.log.is_some() { now_ns() } else { 0 };
            match catch_unwind(AssertUnwindSafe(|| drain(progress))) {
                Ok(false) => return,
                Ok(true) => {}
                Err(payload) => {
                    cursor.stop();
                    fault.lock().get_or_insert(payload);
                }
            }
            if let Some(log) = site.desk.log {
                let end_ns = now_ns();
                log.ticket(SpanRecord { span: site.span, worker, begin_ns, end_ns });
            }
        };
        match site.desk.crew.map(|crew| (crew, crew.claim_loop(site.lane.into()))) {
            None => ticket(site.lane, &mut |_, _| ()),
            Some((crew, Some(claim))) => {
                let helpers = cursor.shares() - 1;
                let job = |lane| ticket(lane_number(lane), &mut |_, _| ());
                claim.open(&job, u32::from(lane_number(helpers)), || {
                    let mut call = crew.announce_loop(helpers);
                    ticket(site.lane, &mut |done, left| call.progress(done, left));
                });
            }
            // This is a loop inside a chunk: its time is part of the outer ticket's, whose worker
            // it cannot know.
            Some((_, None)) => {
                drain(&mut |_, _| ());
            }
        }
        if let Some(payload) = fault.into_inner() {
            resume_unwind(payload);
        }
    }
}
