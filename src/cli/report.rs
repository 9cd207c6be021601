//! The summary table of a replay.
//!
//! In:    columns of a run.
//! Out:   text: per stage and count p50, p95, p99 and maximum.
//! Keeps: nothing.
//! Not here: the percentiles (`overfly::replay::Tally`).

use super::columns::Columns;
use overfly::replay::Tally;
use std::fmt::Write;

/// Counts that a reader of the table looks for; JSON holds all.
const SHOWN: [&str; 10] = [
    "triangles",
    "splits",
    "merges",
    "evaluations",
    "built",
    "drawn",
    "pages",
    "admitted",
    "wanted",
    "error_px_bound",
];

/// The table as text.
pub fn table(columns: &Columns) -> String {
    let mut text = String::new();
    let head = ["p50", "p95", "p99", "max"];
    let line = |text: &mut String, name: &str, cells: [String; 4]| {
        let [a, b, c, d] = cells;
        writeln!(text, "{name:<22}{a:>12}{b:>12}{c:>12}{d:>12}").expect("text grows");
    };
    line(&mut text, "stage, ms", head.map(String::from));
    for column in &columns.stages_ms {
        if let Some(s) = column.summary().filter(|s| s.max > 0.0) {
            line(&mut text, column.name, [s.p50, s.p95, s.p99, s.max].map(|ms| format!("{ms:.3}")));
        }
    }
    line(&mut text, "counts", head.map(String::from));
    for column in columns.counts.iter().filter(|column| SHOWN.contains(&column.name)) {
        if let Some(s) = column.summary() {
            let digits = if column.name == "error_px_bound" { 2 } else { 0 };
            let cell = |value: f64| match value {
                large if large >= 1e7 => format!("{large:.2e}"),
                value => format!("{value:.digits$}"),
            };
            line(&mut text, column.name, [s.p50, s.p95, s.p99, s.max].map(cell));
        }
    }
    if columns.frames() > Tally::EXACT {
        let exact = Tally::EXACT;
        writeln!(text, "percentiles of more than {exact} frames: up to 0.1 % too low")
            .expect("text");
    }
    let waited_s = columns.waited_ms.sum() / 1e3;
    writeln!(text, "waited for pages       {waited_s:.2} s, outside the frames").expect("text");
    text
}
