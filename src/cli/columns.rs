//! What a replay measures: one column a stage and a count, one value a frame.
//!
//! In:    spans and counts of each frame.
//! Out:   columns for tables and JSON.
//! Keeps: all frames.
//! Not here: percentiles (`overfly::replay::Summary`).

use overfly::core::frame::{FrameCounts, STAGES};
use overfly::jobs::{Span, Spans};
use overfly::{RECORD, core::frame::FrameOutput};

/// Columns of one run.
pub struct Columns {
    /// Whole frame and stages, in milliseconds.
    pub stages_ms: Vec<(&'static str, Vec<f64>)>,
    /// Counts of the frame.
    pub counts: Vec<(&'static str, Vec<f64>)>,
    /// Time spent waiting for the loader before each frame, in milliseconds; not part of the frame.
    pub waited_ms: Vec<f64>,
}

/// Name of the row of the whole frame.
pub const FRAME: &str = "frame";

impl Columns {
    /// Columns with room for `frames`.
    pub fn new(frames: usize) -> Self {
        let stages = STAGES.iter().chain([&RECORD]).map(|&Span(name)| name);
        let names = [FRAME].into_iter().chain(stages);
        let column = |name| (name, Vec::with_capacity(frames));
        Self {
            stages_ms: names.map(column).collect(),
            counts: FrameCounts::default().columns().map(|(name, _)| column(name)).into(),
            waited_ms: Vec::with_capacity(frames),
        }
    }

    /// Adds a frame.
    pub fn add(&mut self, frame_ns: u64, waited_ns: u64, spans: &Spans, output: &FrameOutput) {
        let ms = |ns: u64| ns as f64 / 1e6;
        for (name, column) in &mut self.stages_ms {
            let ns = if *name == FRAME { Some(frame_ns) } else { spans.stage_ns(Span(name)) };
            column.push(ms(ns.unwrap_or(0)));
        }
        for ((_, column), (_, value)) in self.counts.iter_mut().zip(output.counts.columns()) {
            column.push(value);
        }
        self.waited_ms.push(ms(waited_ns));
    }

    /// Frames added.
    pub fn frames(&self) -> usize {
        self.waited_ms.len()
    }
}
