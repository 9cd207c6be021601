//! What the bench says of its runs: medians, 99th percentiles and a table.
//!
//! In:    times of frames in milliseconds, counts.
//! Out:   [`Summary`]; [`header`] and [`Row`], the lines of a table of fixed width.
//! Keeps: nothing.
//! Not here: reading clocks (the bench).

use super::workload::{Flight, Preset};
use std::fmt;

/// What a run's frames took.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Summary {
    /// The middle frame, or the mean of the two middle ones.
    pub median_ms: f64,
    /// The nearest-rank 99th percentile: a frame that was, not one between two.
    pub p99_ms: f64,
}

impl Summary {
    /// Of the times of all frames, which it sorts.
    ///
    /// # Panics
    /// If there is no frame.
    pub fn of(times_ms: &mut [f64]) -> Self {
        assert!(!times_ms.is_empty(), "a run without frames has no median");
        times_ms.sort_unstable_by(f64::total_cmp);
        let count = times_ms.len();
        let median_ms = 0.5 * (times_ms[(count - 1) / 2] + times_ms[count / 2]);
        Self { median_ms, p99_ms: times_ms[(99 * count).div_ceil(100) - 1] }
    }
}

/// Means over the frames of a run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PerFrame {
    /// Priorities computed.
    pub evaluations: f64,
    /// Diamonds split.
    pub splits: f64,
    /// Diamonds merged.
    pub merges: f64,
}

/// One run: a line of the table.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Row {
    /// How fine the mesh is.
    pub preset: Preset,
    /// What was flown.
    pub flight: Flight,
    /// Leaves on the last frame.
    pub leaves: u64,
    /// The engine's frames.
    pub ours: Summary,
    /// The recursion's frames, in the same run.
    pub recursion: Summary,
    /// What the engine did in a frame.
    pub work: PerFrame,
    /// Memory of the engine's mesh over its leaves, in bytes.
    pub bytes_per_leaf: f64,
    /// From the two roots to the mesh of frame 0.
    pub cold_start_ms: f64,
}

impl Row {
    /// The engine's median over the recursion's.
    pub fn ratio(&self) -> f64 {
        self.ours.median_ms / self.recursion.median_ms
    }
}

/// Titles of the columns and how wide they are.
const COLUMNS: [(&str, usize); 13] = [
    ("preset", 6),
    ("flight", 10),
    ("leaves", 8),
    ("ours ms", 8),
    ("p99", 8),
    ("rec. ms", 8),
    ("p99", 8),
    ("ratio", 7),
    ("evals", 9),
    ("splits", 8),
    ("merges", 8),
    ("B/leaf", 6),
    ("cold ms", 8),
];

/// The titles of the table.
pub fn header() -> String {
    line(COLUMNS.map(|(title, _)| title.to_owned()))
}

/// A ratio as it is thought of: `1/12.5` if below one, else `1.25`.
fn spoken(ratio: f64) -> String {
    if ratio < 1.0 { format!("1/{:.1}", 1.0 / ratio) } else { format!("{ratio:.2}") }
}

/// Cells in their columns, the first two from the left, numbers from the right.
fn line(cells: [String; COLUMNS.len()]) -> String {
    let mut line = String::new();
    for (at, (cell, (_, width))) in cells.iter().zip(COLUMNS).enumerate() {
        let gap = if at == 0 { "" } else { "  " };
        let padded = if at < 2 { format!("{cell:<width$}") } else { format!("{cell:>width$}") };
        line.push_str(gap);
        line.push_str(&padded);
    }
    line
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Flight { path, speed } = self.flight;
        let ms = |time_ms: f64| format!("{time_ms:.4}");
        f.write_str(&line([
            self.preset.name().to_owned(),
            format!("{} {}", path.name(), speed.name()),
            self.leaves.to_string(),
            ms(self.ours.median_ms),
            ms(self.ours.p99_ms),
            ms(self.recursion.median_ms),
            ms(self.recursion.p99_ms),
            spoken(self.ratio()),
            format!("{:.0}", self.work.evaluations),
            format!("{:.1}", self.work.splits),
            format!("{:.1}", self.work.merges),
            format!("{:.1}", self.bytes_per_leaf),
            format!("{:.2}", self.cold_start_ms),
        ]))
    }
}
