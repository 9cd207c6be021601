//! What a replay measures: one column a stage and a count, one value a frame.
//!
//! In:    spans and counts of each frame.
//! Out:   columns for tables and JSON.
//! Keeps: tallies, whatever the number of frames; every frame where a file of them was asked for.
//! Not here: percentiles (`overfly::replay::Tally`).

use overfly::core::frame::{FrameCounts, STAGES};
use overfly::jobs::{Span, Spans};
use overfly::replay::{Summary, Tally};
use overfly::{RECORD, core::frame::FrameOutput};

/// Columns of one run.
pub struct Columns {
    /// Whole frame and stages, in milliseconds.
    pub stages_ms: Vec<Column>,
    /// Counts of the frame.
    pub counts: Vec<Column>,
    /// Time spent waiting for the loader before each frame, in milliseconds; not part of the frame.
    pub waited_ms: Column,
    frames: usize,
}

/// Values of one name, one a frame.
pub struct Column {
    /// Of the stage or the count.
    pub name: &'static str,
    tally: Tally,
    /// All of them, where they are kept.
    values: Option<Vec<f64>>,
}

impl Column {
    fn new(name: &'static str, keeps_frames: bool) -> Self {
        Self { name, tally: Tally::default(), values: keeps_frames.then(Vec::new) }
    }

    fn add(&mut self, value: f64) {
        self.tally.add(value);
        if let Some(values) = &mut self.values {
            values.push(value);
        }
    }

    /// Its percentiles; `None` without a frame.
    pub fn summary(&self) -> Option<Summary<f64>> {
        self.tally.summary()
    }

    /// The sum of all values.
    pub fn sum(&self) -> f64 {
        self.tally.sum()
    }

    /// All values; none where they are not kept.
    pub fn values(&self) -> &[f64] {
        self.values.as_deref().unwrap_or_default()
    }
}

/// Name of the row of the whole frame.
pub const FRAME: &str = "frame";

impl Columns {
    /// Empty columns, which keep the values of each frame or only what a table needs.
    pub fn new(keeps_frames: bool) -> Self {
        let stages = STAGES.iter().chain([&RECORD]).map(|&Span(name)| name);
        let names = [FRAME].into_iter().chain(stages);
        let column = |name| Column::new(name, keeps_frames);
        Self {
            stages_ms: names.map(column).collect(),
            counts: FrameCounts::default().columns().map(|(name, _)| column(name)).into(),
            waited_ms: column("waited"),
            frames: 0,
        }
    }

    /// Adds a frame.
    pub fn add(&mut self, frame_ns: u64, waited_ns: u64, spans: &Spans, output: &FrameOutput) {
        let ms = |ns: u64| ns as f64 / 1e6;
        for column in &mut self.stages_ms {
            let name = column.name;
            let ns = if name == FRAME { Some(frame_ns) } else { spans.stage_ns(Span(name)) };
            column.add(ms(ns.unwrap_or(0)));
        }
        for (column, (_, value)) in self.counts.iter_mut().zip(output.counts.columns()) {
            column.add(value);
        }
        self.waited_ms.add(ms(waited_ns));
        self.frames += 1;
    }

    /// Frames added.
    pub fn frames(&self) -> usize {
        self.frames
    }
}
