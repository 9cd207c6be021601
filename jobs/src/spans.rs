//! The only clock of the libraries, and the times of one run of a graph.
//!
//! In:    what the workers wrote down during the run (`log`).
//! Out:   [`Spans`]: records in nanoseconds since the clock's start.
//! Keeps: buffers of fixed capacity; a run clears them and never grows them.
//! Not here: budgets, percentiles, drawing (the host reads [`Spans`]).

use std::sync::OnceLock;
use std::time::Instant;

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

/// How a worker waited.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum WaitKind {
    /// It looked for work again and again.
    Spin,
    /// It slept, was on its way from sleep, or was never given a core.
    Park,
}

/// A time in which a worker had nothing to do although the run was under way.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct WaitRecord {
    /// Who: 0 is the thread that called `run`, then `1..=workers`.
    pub worker: u16,
    /// How.
    pub kind: WaitKind,
    /// Start, in nanoseconds of [`now_ns`].
    pub begin_ns: u64,
    /// End, in nanoseconds of [`now_ns`]; not before `begin_ns`.
    pub end_ns: u64,
}

/// The times of the last run of a graph. Empty before the first, and after a run without
/// [recording](crate::Graph::record_spans).
#[derive(Default)]
pub struct Spans {
    pub(crate) stages: Vec<SpanRecord>,
    pub(crate) tickets: Vec<SpanRecord>,
    pub(crate) waits: Vec<WaitRecord>,
    pub(crate) dropped: u64,
}

impl Spans {
    /// Forgets everything and keeps the room.
    pub(crate) fn clear(&mut self) {
        self.stages.clear();
        self.tickets.clear();
        self.waits.clear();
        self.dropped = 0;
    }

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

    /// What each worker waited, by worker, then by time. A worker's tickets, its stages and its
    /// waits fill the run, up to the scheduler's own steps.
    pub fn waits(&self) -> impl Iterator<Item = &WaitRecord> {
        self.waits.iter()
    }

    /// Wall time, in nanoseconds, of the first stage of that name; `None` if it did not run.
    pub fn stage_ns(&self, span: Span) -> Option<u64> {
        let record = self.stages.iter().find(|record| record.span == span)?;
        Some(record.end_ns - record.begin_ns)
    }

    /// Number of ticket and wait records of the last run that did not fit. Stages always fit.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }
}
