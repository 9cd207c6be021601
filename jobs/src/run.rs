//! What a run does at the nodes of a graph: calls closures, keeps panics and times.
//!
//! In:    the closures, the context, the workers if they are free, the cancel flag.
//! Out:   the closures called; the first panic, whether anything was cancelled.
//! Keeps: nothing.
//! Not here: order (`walk`), loops inside a stage (`team`).

use crate::cancel::Cancel;
use crate::scratch::Scratch;
use crate::spans::{Span, SpanRecord, WaitKind, WaitRecord, now_ns};
use crate::sync::Std;
use crate::team::{Desk, Site, Team};
use crate::tickets::ITEMS_MAX;
use crate::walk::{Hand, Walk, Work};
use parking_lot::Mutex;
use std::any::Any;
use std::cell::Cell;
use std::error::Error;
use std::fmt;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

/// The first panic of a run. Stages that follow the panicked one, directly or not, were skipped;
/// all others ran.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct StagePanic {
    /// The stage that panicked, or whose chunk did.
    pub span: Span,
    /// The panic's text; a replacement if it carried none.
    pub message: String,
}

impl fmt::Display for StagePanic {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "stage {} panicked: {}", self.span.0, self.message)
    }
}

impl Error for StagePanic {}

/// A stage as the graph keeps it.
pub(crate) struct Stage<C> {
    pub(crate) span: Span,
    pub(crate) body: Body<C>,
}

/// The closures of a stage.
pub(crate) enum Body<C> {
    /// Called once.
    Once(OnceFn<C>),
    /// Counts chunks; called with ranges of them.
    Each(CountFn<C>, ChunksFn<C>),
}

pub(crate) type OnceFn<C> = Box<dyn Fn(&C, &Team<'_>) + Send + Sync>;
pub(crate) type CountFn<C> = Box<dyn Fn(&C) -> usize + Send + Sync>;
pub(crate) type ChunksFn<C> = Box<dyn Fn(&C, Range<usize>, &mut [u128]) + Send + Sync>;

/// Makes a function of ranges from one of chunks, so that chunks cost no call through a pointer.
pub(crate) fn in_ranges<C>(
    body: impl Fn(&C, usize, &mut Scratch<'_>) + Send + Sync + 'static,
) -> ChunksFn<C> {
    Box::new(move |context, chunks, block| {
        let mut block = Scratch::new(block);
        for chunk in chunks {
            body(context, chunk, &mut block.anew());
        }
    })
}

/// The work of one run.
pub(crate) struct Deeds<'a, C> {
    pub(crate) stages: &'a [Stage<C>],
    pub(crate) context: &'a C,
    pub(crate) desk: Desk<'a>,
    pub(crate) cancel: Option<&'a Cancel>,
    /// Something was skipped because of `cancel`.
    pub(crate) cancelled: AtomicBool,
    pub(crate) fault: Mutex<Option<StagePanic>>,
}

impl<C: Sync> Deeds<'_, C> {
    fn report(&self, span: Span, payload: &(dyn Any + Send)) {
        let message = text_of(payload);
        self.fault.lock().get_or_insert(StagePanic { span, message });
    }

    /// A worker's part of the run, of which there may be several.
    pub(crate) fn visited_by(&self, lane: usize, walk: &Walk<'_, Self, Std>) {
        if let Some(log) = self.desk.log {
            log.arrive(lane_number(lane));
        }
        walk.help(lane);
        if let Some(log) = self.desk.log {
            log.depart(lane_number(lane));
        }
    }

    #[inline]
    fn stage(&self, node: u32, worker: u16, hand: &mut Hand) {
        let Stage { span, body: Body::Once(run) } = &self.stages[node as usize] else {
            unreachable!("the plan's kind is the body's");
        };
        let team = Team::of(Site { desk: &self.desk, lane: worker, span: *span });
        let Some(log) = self.desk.log else { return run(self.context, &team) };
        log.stage_begins(node as usize, worker, self.begin_ns(hand));
        run(self.context, &team);
        hand.clock_ns = now_ns();
        log.stage_ends(node as usize, hand.clock_ns);
    }

    /// The time at which what this worker does now begins.
    fn begin_ns(&self, hand: &mut Hand) -> u64 {
        match std::mem::take(&mut hand.clock_ns) {
            0 => now_ns(),
            clock_ns => clock_ns,
        }
    }
}

impl<C: Sync> Work for Deeds<'_, C> {
    #[inline]
    fn is_cancelled(&self) -> bool {
        let cancelled = self.cancel.is_some_and(Cancel::is_cancelled);
        if cancelled {
            self.cancelled.store(true, Ordering::Relaxed);
        }
        cancelled
    }

    #[inline]
    fn stages(
        &self,
        first: u32,
        hand: &mut Hand,
        mut follow: impl FnMut(u32) -> Option<u32>,
    ) -> (u32, bool) {
        let at = Cell::new(first);
        let worker = lane_number(hand.lane);
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            loop {
                self.stage(at.get(), worker, hand);
                match follow(at.get()) {
                    Some(next) => at.set(next),
                    None => return,
                }
            }
        }));
        let last = at.get();
        if let Err(payload) = &outcome {
            self.report(self.stages[last as usize].span, payload.as_ref());
            if let Some(log) = self.desk.log {
                hand.clock_ns = now_ns();
                log.stage_ends(last as usize, hand.clock_ns);
            }
        }
        (last, outcome.is_ok())
    }

    fn count(&self, node: u32, hand: &mut Hand) -> Option<usize> {
        let Stage { span, body: Body::Each(count, _) } = &self.stages[node as usize] else {
            unreachable!("the plan's kind is the body's");
        };
        if let Some(log) = self.desk.log {
            log.stage_begins(node as usize, lane_number(hand.lane), self.begin_ns(hand));
        }
        let counted = catch_unwind(AssertUnwindSafe(|| {
            let count = count(self.context);
            assert!(count <= ITEMS_MAX, "{count} chunks are more than {ITEMS_MAX}");
            count
        }));
        if let Err(payload) = &counted {
            self.report(*span, payload.as_ref());
            self.chunks_end(node, hand);
        }
        counted.ok()
    }

    fn chunks(
        &self,
        node: u32,
        hand: &mut Hand,
        claim: &mut dyn FnMut() -> Option<Range<usize>>,
    ) -> bool {
        let Stage { span, body: Body::Each(_, run) } = &self.stages[node as usize] else {
            unreachable!("the plan's kind is the body's");
        };
        let begin_ns = if self.desk.log.is_some() { now_ns() } else { 0 };
        let outcome = self.desk.blocks.lend(hand.lane, |block| {
            catch_unwind(AssertUnwindSafe(|| {
                std::iter::from_fn(&mut *claim).for_each(|chunks| run(self.context, chunks, block));
            }))
        });
        if let Some(log) = self.desk.log {
            let (worker, end_ns) = (lane_number(hand.lane), now_ns());
            log.ticket(SpanRecord { span: *span, worker, begin_ns, end_ns });
        }
        if let Err(payload) = &outcome {
            self.report(*span, payload.as_ref());
        }
        outcome.is_ok()
    }

    fn chunks_end(&self, node: u32, hand: &mut Hand) {
        if let Some(log) = self.desk.log {
            hand.clock_ns = now_ns();
            log.stage_ends(node as usize, hand.clock_ns);
        }
    }

    #[inline]
    fn idle(&self, hand: &mut Hand) {
        if self.desk.log.is_some() && hand.idle_ns == 0 {
            hand.idle_ns = now_ns();
        }
    }

    #[inline]
    fn busy(&self, hand: &mut Hand, parked: bool) {
        if let Some(log) = self.desk.log.filter(|_| hand.idle_ns != 0) {
            let begin_ns = std::mem::take(&mut hand.idle_ns);
            let kind = if parked { WaitKind::Park } else { WaitKind::Spin };
            let (worker, end_ns) = (lane_number(hand.lane), now_ns());
            log.wait(WaitRecord { worker, kind, begin_ns, end_ns });
        }
    }
}

/// A lane, or a number of lanes, as records store it.
pub(crate) fn lane_number(lane: usize) -> u16 {
    u16::try_from(lane).expect("there are at most 65 lanes")
}

/// The text of a panic, if it has one.
fn text_of(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("a panic without text").to_owned()
}
