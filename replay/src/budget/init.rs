//! A budget out of a run, with the head-room that its lines have.
//!
//! In:    a record.
//! Out:   the text of a `budget.ron`.
//! Keeps: nothing.
//! Not here: writing the file (the host), reading one (`overfly_config`).

use super::change::number;
use super::record::{ERRORS, FRAME, INSTRUCTIONS, RunRecord, times};
use super::statistic::take;
use overfly_config::Statistic;
use std::fmt::Write;

/// Counts may grow by this factor.
pub const COUNTS_FACTOR: f64 = 1.1;
/// Times may: machines differ, and so do the neighbours of a shared one.
pub const TIMES_FACTOR: f64 = 2.0;
/// A hitch lasts longer than so many median frames.
const HITCH_FACTOR: f64 = 8.0;

/// Counters that cost time or memory, and what is limited of them.
const COUNTED: [(&str, &[&str]); 12] = [
    ("triangles", &["p99", "max"]),
    ("drawn", &["p99", "max"]),
    ("draws", &["max"]),
    ("evaluations", &["sum", "p99", "max"]),
    ("splits", &["sum", "max"]),
    ("merges", &["sum", "max"]),
    ("pages", &["max"]),
    ("wanted", &["sum", "max"]),
    ("decoded_bytes", &["sum", "max"]),
    ("uploaded_bytes", &["sum", "max"]),
    ("allocations", &["sum", "max"]),
    ("error_px_bound", &["max"]),
];

/// The budget's text: every limit is what the run had, times a stated factor.
pub fn budget_text(record: &RunRecord) -> String {
    let facts = &record.facts;
    let mut out = format!(
        "// Budget of {} over {}, frames {} to {}, from {} ({}).\n\
         // Counts and errors may be {COUNTS_FACTOR} times what that run had: they are the same on \
         every machine,\n// so lower the factor to what you mean to allow. Times may be \
         {TIMES_FACTOR} times what it had,\n// in milliseconds on {}: set them for the machine \
         that judges.\n// Behind each line stands what the run had. statistic: sum, mean, p50, \
         p95, p99, p99.9, max,\n// share_over, longest_run_over, hitches_per_min (these three \
         with over:), changed (frames that differ\n// from the baseline). severity: fail or \
         warn.\nBudget(\n    lines: [\n",
        facts.flight,
        facts.scene,
        facts.first_frame,
        facts.first_frame as usize + record.frames().saturating_sub(1),
        facts.program,
        facts.profile,
        if facts.processor.is_empty() { &facts.platform } else { &facts.processor },
    );
    for (name, statistics) in COUNTED {
        let column = record.counters.get(name).map_or(&[][..], Vec::as_slice);
        for statistic in statistics {
            line(&mut out, (name, statistic, None), (column, COUNTS_FACTOR), record);
        }
    }
    for name in [ERRORS[0], ERRORS[3], INSTRUCTIONS] {
        let sampled = record.sampled(name).and_then(|sampled| sampled.columns.get(name));
        let column = sampled.map_or(&[][..], Vec::as_slice);
        line(&mut out, (name, "max", None), (column, COUNTS_FACTOR), record);
    }
    for name in times() {
        let column = record.times_ms(name).concat();
        line(&mut out, (name, "p99", None), (&column, TIMES_FACTOR), record);
        if name == FRAME {
            line(&mut out, (name, "p50", None), (&column, TIMES_FACTOR), record);
            line(&mut out, (name, "p99.9", None), (&column, TIMES_FACTOR), record);
            let median = take(Statistic::Percentile(500), 0.0, &column, 1.0);
            let hitch_ms = median.map(|taken| rounded_up(HITCH_FACTOR * taken.value));
            for statistic in ["hitches_per_min", "longest_run_over"] {
                line(&mut out, (name, statistic, hitch_ms), (&column, TIMES_FACTOR), record);
            }
        }
    }
    out.push_str("    ],\n)\n");
    out
}

fn line(
    out: &mut String,
    (name, statistic, over): (&str, &str, Option<f64>),
    (column, factor): (&[f64], f64),
    record: &RunRecord,
) {
    let known = Statistic::ALL.into_iter().find(|(known, _)| *known == statistic);
    let (_, known) = known.expect("a statistic of this file");
    let taken = take(known, over.unwrap_or(0.0), column, record.facts.rate_hz);
    let Some(taken) = taken.filter(|taken| taken.value < 1e17) else { return };
    // Where there was none, one is allowed: nothing times a factor is nothing.
    let floor = if known.needs_over() { 1.0 } else { 0.0 };
    let limit = rounded_up(taken.value * factor).max(floor);
    // Of things that are counted there is no part.
    let whole = column.iter().all(|value| *value == value.trunc());
    let limit = if whole { limit.ceil() } else { limit };
    let over = over.map_or(String::new(), |over| format!("over: {over}, "));
    let had = number(taken.value);
    writeln!(
        out,
        "        (of: \"{name}\", statistic: \"{statistic}\", {over}limit: {limit}), // {had}"
    )
    .expect("a text grows");
}

/// Three figures, rounded up, so that a limit says no more than it means.
fn rounded_up(value: f64) -> f64 {
    if value <= 0.0 || !value.is_finite() {
        return 0.0;
    }
    // What is above a figure by the error of a product alone, is that figure.
    let up = |x: f64| (x * (1.0 - 1e-12)).ceil();
    let (mut unit, mut parts) = (1.0, 1.0);
    while value / unit >= 1000.0 {
        unit *= 10.0;
    }
    while value * parts < 100.0 && parts < 1e9 {
        parts *= 10.0;
    }
    if unit > 1.0 { up(value / unit) * unit } else { up(value * parts) / parts }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_have_three_figures_and_are_never_below_the_value() {
        let rounded = [0.0, 1234.5, 200_000.0 * 1.1, 0.012_345, 99.95, 7.0].map(rounded_up);
        assert_eq!(rounded, [0.0, 1240.0, 220_000.0, 0.0124, 100.0, 7.0]);
    }
}
