//! One run of a graph: which stage is ready, who runs it, what became of it.
//!
//! In:    the stages, the compiled [`Plan`], the context, the workers if they are free.
//! Out:   every stage run or skipped once; the first panic.
//! Keeps: the plan's counters, which end a run as they began it.
//! Not here: building the graph (`graph`), loops inside a stage (`team`).

use crate::spans::{Log, Span, SpanRecord, now_ns};
use crate::team::{Site, Team, lane_number};
use crate::workers::Crew;
use crossbeam::queue::ArrayQueue;
use parking_lot::Mutex;
use std::any::Any;
use std::error::Error;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};

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
    pub(crate) run: StageFn<C>,
}

/// The closure of a stage.
pub(crate) type StageFn<C> = Box<dyn Fn(&C, &Team) + Send + Sync>;

/// The edges of a graph as flat arrays, and the counters of a run.
pub(crate) struct Plan {
    /// Stages that wait for none.
    roots: Vec<u32>,
    /// Stage `s` is followed by `successors[first[s]..first[s + 1]]`.
    first: Vec<usize>,
    successors: Vec<u32>,
    /// How many stages each waits for.
    waits: Vec<u32>,
    /// How many it still waits for; whoever counts to 0 sets it back to `waits`.
    left: Vec<AtomicU32>,
    /// A stage it waits for panicked or was skipped; whoever skips the stage sets it back.
    doomed: Vec<AtomicBool>,
    /// Stages that anybody may start. A queue of the graph's size rather than deques of the
    /// workers: crossbeam's `Injector` allocates a block per 63 pushes and its `Worker` grows
    /// above 64 entries and shrinks again, while this never allocates, cannot overflow (a stage
    /// is in it at most once) and holds a handful of stages per frame. The many small pieces of
    /// work are chunks, and those are counted, not queued.
    ready: ArrayQueue<u32>,
}

impl Plan {
    /// Compiles the edges (before, after) of a graph of `stages` stages.
    pub(crate) fn new(stages: u32, edges: &[(u32, u32)]) -> Plan {
        let count = stages as usize;
        let mut waits = vec![0; count];
        let mut first = vec![0; count + 1];
        for &(before, after) in edges {
            waits[after as usize] += 1;
            first[before as usize + 1] += 1;
        }
        for stage in 0..count {
            first[stage + 1] += first[stage];
        }
        let mut by_before = edges.to_vec();
        by_before.sort_unstable();
        Plan {
            roots: (0..stages).filter(|&stage| waits[stage as usize] == 0).collect(),
            first,
            successors: by_before.into_iter().map(|(_, after)| after).collect(),
            left: waits.iter().map(|&waits| AtomicU32::new(waits)).collect(),
            doomed: (0..count).map(|_| AtomicBool::new(false)).collect(),
            waits,
            ready: ArrayQueue::new(count.max(1)),
        }
    }

    fn successors(&self, stage: usize) -> &[u32] {
        &self.successors[self.first[stage]..self.first[stage + 1]]
    }

    /// Counts one predecessor of `stage` as done; `true` if it was the last.
    fn release(&self, stage: usize) -> bool {
        let waits = self.waits[stage];
        // AcqRel: the last to count sees what all predecessors wrote, the flag `doomed` included.
        let last = waits == 1 || self.left[stage].fetch_sub(1, Ordering::AcqRel) == 1;
        if last {
            self.left[stage].store(waits, Ordering::Relaxed);
        }
        last
    }

    fn push(&self, stage: u32) {
        self.ready.push(stage).expect("a stage is ready once per run");
    }
}

/// A run under way, on the stack of its caller.
pub(crate) struct Run<'a, C> {
    pub(crate) stages: &'a [Stage<C>],
    pub(crate) plan: &'a Plan,
    pub(crate) context: &'a C,
    /// `None` while the workers serve another run.
    pub(crate) crew: Option<&'a Crew>,
    pub(crate) log: &'a Log,
    /// Stages neither run nor skipped.
    pub(crate) pending: AtomicUsize,
    pub(crate) fault: Mutex<Option<StagePanic>>,
}

impl<C: Sync> Run<'_, C> {
    /// Makes the first stages ready and works as the caller until all are done.
    pub(crate) fn lead(&self) {
        for &root in &self.plan.roots {
            self.plan.push(root);
        }
        if let Some(crew) = self.crew {
            crew.announce(self.plan.roots.len().saturating_sub(1));
        }
        self.work(0);
    }

    /// Works as `lane`. The caller, lane 0, stays until all is done; others leave when there is
    /// nothing to do for a while, so that the end of a run waits for no one who sleeps.
    pub(crate) fn work(&self, lane: usize) {
        loop {
            if let Some(crew) = self.crew {
                crew.look(lane);
            }
            if self.pending.load(Ordering::Acquire) == 0 {
                return;
            }
            if let Some(stage) = self.plan.ready.pop() {
                self.run_on(stage, lane);
                continue;
            }
            let crew = self.crew.expect("a caller alone finds a ready stage until all are done");
            if crew.join_loop(lane) || crew.spin(lane) {
                continue;
            }
            if lane != 0 {
                return;
            }
            crew.sleep(lane);
        }
    }

    /// Runs a stage, then one of those that it made ready, and so on.
    fn run_on(&self, stage: u32, lane: usize) {
        let mut next = Some(stage);
        while let Some(stage) = next {
            let stage = stage as usize;
            let doomed = &self.plan.doomed[stage];
            let skip = doomed.load(Ordering::Relaxed);
            if skip {
                doomed.store(false, Ordering::Relaxed);
            }
            let passed = !skip && self.run_stage(stage, lane);
            next = self.finish(stage, passed);
        }
    }

    /// Runs one stage; `false` if it panicked.
    fn run_stage(&self, index: usize, lane: usize) -> bool {
        let Stage { span, run } = &self.stages[index];
        let (span, worker) = (*span, lane_number(lane));
        let team = Team::of(Site { crew: self.crew, lane: worker, log: self.log, span });
        let begin_ns = now_ns();
        let outcome = catch_unwind(AssertUnwindSafe(|| run(self.context, &team)));
        let end_ns = now_ns();
        self.log.stage(index, SpanRecord { span, worker, begin_ns, end_ns });
        match outcome {
            Ok(()) => true,
            Err(payload) => {
                let message = text_of(payload.as_ref());
                self.fault.lock().get_or_insert(StagePanic { span, message });
                false
            }
        }
    }

    /// Releases the stages after `stage`; one that became ready is returned for this worker, the
    /// others are offered to all.
    fn finish(&self, stage: usize, passed: bool) -> Option<u32> {
        let mut next = None;
        let mut offered = 0;
        for &after in self.plan.successors(stage) {
            if !passed {
                self.plan.doomed[after as usize].store(true, Ordering::Relaxed);
            }
            if !self.plan.release(after as usize) {
                continue;
            }
            if next.is_none() {
                next = Some(after);
            } else {
                self.plan.push(after);
                offered += 1;
            }
        }
        let last = self.pending.fetch_sub(1, Ordering::AcqRel) == 1;
        if let Some(crew) = self.crew {
            crew.announce(offered);
            if last {
                crew.announce_end();
            }
        }
        next
    }
}

/// The text of a panic, if it has one.
fn text_of(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("a panic without text").to_owned()
}
