//! The only clock of the libraries, and the times of one run of a graph.
//!
//! In:    begin and end of stages and of their parallel-for tickets, from any worker.
//! Out:   [`Spans`]: records in nanoseconds since the clock's start.
//! Keeps: buffers of fixed capacity; a run clears them and never grows them.
//! Not here: budgets, percentiles, drawing (the host reads [`Spans`]).

use crossbeam::utils::CachePadded;
use parking_lot::Mutex;
use std::sync::OnceLock;
use std::time::Instant;

/// Ticket records that one worker can keep per run; 20 KiB.
const TICKETS_PER_WORKER: usize = 512;

/// Nanoseconds since the clock's start, which is the first call in this process. Never falls, and
/// is comparable between threads. Lasts 584 years.
#[expect(clippy::disallowed_methods, reason = "the one place where the libraries read a clock")]
pub fn now_ns() -> u64 {
    static START: OnceLock<Instant> = OnceLock::new();
    let since = Instant::now().saturating_duration_since(*START.get_or_init(Instant::now));
    since.as_secs() * 1_000_000_000 + u64::from(since.subsec_nanos())
}

/// Name of a stage, spelt like its module path: `lod.select`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Span(pub &'static str);

/// One piece of work: a whole stage, or what one worker did of one parallel-for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SpanRecord {
    /// The stage.
    pub span: Span,
    /// Who did it: 0 is the thread that called `run`, then `1..=workers`.
    pub worker: u16,
    /// Start, in nanoseconds of [`now_ns`].
    pub begin_ns: u64,
    /// End, in nanoseconds of [`now_ns`]; not before `begin_ns`.
    pub end_ns: u64,
}

/// The times of the last run of a graph. Empty before the first.
#[derive(Default)]
pub struct Spans {
    stages: Vec<SpanRecord>,
    tickets: Vec<SpanRecord>,
    dropped: u64,
}

impl Spans {
    /// All records: [`Spans::stages`], then [`Spans::tickets`].
    pub fn records(&self) -> impl Iterator<Item = &SpanRecord> {
        self.stages.iter().chain(&self.tickets)
    }

    /// One record for each stage that ran, in the order the stages were added. A skipped stage has
    /// none; one that panicked has.
    pub fn stages(&self) -> impl Iterator<Item = &SpanRecord> {
        self.stages.iter()
    }

    /// One record per worker and parallel-for it took part in, named like the stage; by worker,
    /// then by time.
    pub fn tickets(&self) -> impl Iterator<Item = &SpanRecord> {
        self.tickets.iter()
    }

    /// Wall time, in nanoseconds, of the first stage of that name; `None` if it did not run.
    pub fn stage_ns(&self, span: Span) -> Option<u64> {
        let record = self.stages.iter().find(|record| record.span == span)?;
        Some(record.end_ns - record.begin_ns)
    }

    /// Number of ticket records of the last run that did not fit. Stages always fit.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }
}

/// What the workers write into during a run. Each lock has one user at a time and costs little.
#[derive(Default)]
pub(crate) struct Log {
    stages: Vec<Mutex<Option<SpanRecord>>>,
    lanes: Vec<CachePadded<Mutex<Lane>>>,
}

#[derive(Default)]
struct Lane {
    tickets: Vec<SpanRecord>,
    dropped: u64,
}

impl Log {
    /// Forgets the last run and makes room for `stages` stages on `lanes` workers and caller.
    pub(crate) fn begin(&mut self, stages: usize, lanes: usize) {
        self.stages.iter_mut().for_each(|stage| *stage.get_mut() = None);
        self.stages.resize_with(stages, Mutex::default);
        for lane in &mut self.lanes {
            let lane = lane.get_mut();
            lane.tickets.clear();
            lane.dropped = 0;
        }
        while self.lanes.len() < lanes {
            let tickets = Vec::with_capacity(TICKETS_PER_WORKER);
            self.lanes.push(CachePadded::new(Mutex::new(Lane { tickets, dropped: 0 })));
        }
    }

    /// Writes the time of the stage with that index.
    pub(crate) fn stage(&self, stage: usize, record: SpanRecord) {
        *self.stages[stage].lock() = Some(record);
    }

    /// Writes the time of one ticket, or counts it when the buffer is full.
    pub(crate) fn ticket(&self, record: SpanRecord) {
        let mut lane = self.lanes[usize::from(record.worker)].lock();
        if lane.tickets.len() < TICKETS_PER_WORKER {
            lane.tickets.push(record);
        } else {
            lane.dropped += 1;
        }
    }

    /// Copies the finished run into `spans`.
    pub(crate) fn collect_into(&mut self, spans: &mut Spans) {
        spans.stages.clear();
        spans.stages.reserve(self.stages.len());
        spans.stages.extend(self.stages.iter_mut().filter_map(|stage| *stage.get_mut()));
        spans.tickets.clear();
        spans.tickets.reserve(self.lanes.len() * TICKETS_PER_WORKER);
        spans.dropped = 0;
        for lane in &mut self.lanes {
            let lane = lane.get_mut();
            spans.tickets.extend_from_slice(&lane.tickets);
            spans.dropped += lane.dropped;
        }
    }
}
