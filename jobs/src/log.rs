//! What the workers write down during a run, if times are recorded.
//!
//! In:    begin and end of stages, of tickets and of waits, from any worker.
//! Out:   the records, copied into [`Spans`] after the run.
//! Keeps: one slot per stage, and per worker buffers of fixed capacity.
//! Not here: the clock and what the host reads (`spans`).

use crate::spans::{Span, SpanRecord, Spans, WaitKind, WaitRecord, now_ns};
use crossbeam::utils::CachePadded;
use parking_lot::Mutex;
use std::sync::atomic::{AtomicU16, AtomicU64, Ordering};

/// Ticket records that one worker can keep per run; 20 KiB. As many waits.
const RECORDS_PER_WORKER: usize = 512;

/// The worker of a stage that has no record.
const NOBODY: u16 = u16::MAX;

/// The time of one stage. Plain stores: one worker writes, and the run's end orders them.
struct StageTime {
    worker: AtomicU16,
    begin_ns: AtomicU64,
    end_ns: AtomicU64,
}

#[derive(Default)]
struct Lane {
    tickets: Vec<SpanRecord>,
    waits: Vec<WaitRecord>,
    dropped: u64,
    /// Since when the worker is outside the run; 0 while it is inside.
    away_ns: u64,
}

/// The records of a run under way.
#[derive(Default)]
pub(crate) struct Log {
    stages: Vec<StageTime>,
    /// Each lock has one user at a time and costs little.
    lanes: Vec<CachePadded<Mutex<Lane>>>,
}

impl Log {
    /// Forgets the last run and makes room for `stages` stages on `lanes` workers and caller.
    pub(crate) fn begin(&mut self, stages: usize, lanes: usize) {
        let time = || StageTime {
            worker: AtomicU16::new(NOBODY),
            begin_ns: AtomicU64::new(0),
            end_ns: AtomicU64::new(0),
        };
        self.stages.resize_with(stages, time);
        self.stages.iter_mut().for_each(|stage| *stage.worker.get_mut() = NOBODY);
        let begin_ns = now_ns();
        for lane in &mut self.lanes {
            let lane = lane.get_mut();
            lane.tickets.clear();
            lane.waits.clear();
            lane.dropped = 0;
            lane.away_ns = begin_ns;
        }
        while self.lanes.len() < lanes {
            let lane = Lane {
                tickets: Vec::with_capacity(RECORDS_PER_WORKER),
                waits: Vec::with_capacity(RECORDS_PER_WORKER),
                dropped: 0,
                away_ns: begin_ns,
            };
            self.lanes.push(CachePadded::new(Mutex::new(lane)));
        }
        *self.away(0) = 0;
    }

    fn away(&mut self, lane: usize) -> &mut u64 {
        &mut self.lanes[lane].get_mut().away_ns
    }

    /// Writes when a stage began, and who ran it.
    #[inline]
    pub(crate) fn stage_begins(&self, stage: usize, worker: u16, begin_ns: u64) {
        self.stages[stage].begin_ns.store(begin_ns, Ordering::Relaxed);
        self.stages[stage].worker.store(worker, Ordering::Relaxed);
    }

    /// Writes when a stage ended.
    #[inline]
    pub(crate) fn stage_ends(&self, stage: usize, end_ns: u64) {
        self.stages[stage].end_ns.store(end_ns, Ordering::Relaxed);
    }

    /// Writes the time of one ticket, or counts it when the buffer is full.
    pub(crate) fn ticket(&self, record: SpanRecord) {
        let mut lane = self.lanes[usize::from(record.worker)].lock();
        if lane.tickets.len() < RECORDS_PER_WORKER {
            lane.tickets.push(record);
        } else {
            lane.dropped += 1;
        }
    }

    /// Writes the time of one wait, or counts it when the buffer is full.
    pub(crate) fn wait(&self, record: WaitRecord) {
        self.lanes[usize::from(record.worker)].lock().wait(record);
    }

    /// A worker joins the run.
    pub(crate) fn arrive(&self, worker: u16) {
        let mut lane = self.lanes[usize::from(worker)].lock();
        let begin_ns = std::mem::take(&mut lane.away_ns);
        lane.wait(WaitRecord { worker, kind: WaitKind::Park, begin_ns, end_ns: now_ns() });
    }

    /// A worker leaves the run, maybe to come back.
    pub(crate) fn depart(&self, worker: u16) {
        self.lanes[usize::from(worker)].lock().away_ns = now_ns();
    }

    /// Copies the finished run of `lanes` workers and caller into `spans`; `name` knows a stage's.
    pub(crate) fn collect_into(
        &mut self,
        spans: &mut Spans,
        lanes: usize,
        name: impl Fn(usize) -> Span,
    ) {
        spans.clear();
        spans.stages.reserve(self.stages.len());
        for (index, stage) in self.stages.iter_mut().enumerate() {
            let worker = *stage.worker.get_mut();
            if worker != NOBODY {
                let (begin_ns, end_ns) = (*stage.begin_ns.get_mut(), *stage.end_ns.get_mut());
                spans.stages.push(SpanRecord { span: name(index), worker, begin_ns, end_ns });
            }
        }
        let end_ns = now_ns();
        spans.tickets.reserve(self.lanes.len() * RECORDS_PER_WORKER);
        spans.waits.reserve(self.lanes.len() * RECORDS_PER_WORKER);
        for (worker, lane) in (0..).zip(self.lanes.iter_mut().take(lanes)) {
            let lane = lane.get_mut();
            if lane.away_ns != 0 && lane.away_ns < end_ns {
                let (kind, begin_ns) = (WaitKind::Park, lane.away_ns);
                lane.wait(WaitRecord { worker, kind, begin_ns, end_ns });
            }
            spans.tickets.extend_from_slice(&lane.tickets);
            spans.waits.extend_from_slice(&lane.waits);
            spans.dropped += lane.dropped;
        }
    }
}

impl Lane {
    fn wait(&mut self, record: WaitRecord) {
        if self.waits.len() < RECORDS_PER_WORKER {
            self.waits.push(record);
        } else {
            self.dropped += 1;
        }
    }
}
