//! What a case took: a table for people, columns for programs.
//!
//! In:    [`Columns`] of a case.
//! Out:   text; JSON.
//! Keeps: nothing.
//! Not here: percentiles (`overfly::replay::Summary`), flying (`fly`).

use crate::fly::{Case, Columns, DECIDE, FRAME, Side, Times};
use overfly::core::frame::{FrameCounts, STAGES};
use overfly::replay::Summary;
use serde_json::{Map, Value, json};
use std::fmt::Write;

/// Slowest frames that are listed.
const LISTED: usize = 6;

/// Counts that are listed with them.
const TOLD: [&str; 7] =
    ["evaluations", "splits", "merges", "blocked", "built", "admitted", "drawn"];

/// Counts of the table.
const COUNTED: [&str; 3] = ["evaluations", "splits", "merges"];

/// Rows of times: name and place in [`Times`].
fn rows() -> impl Iterator<Item = (&'static str, usize)> {
    let stages = STAGES.iter().enumerate().map(|(at, stage)| (stage.0, at));
    stages.chain([("prioritise + refine", DECIDE), ("frame", FRAME)])
}

fn times(side: &Side, at: usize) -> Vec<f64> {
    side.ms.iter().map(|times| times[at]).collect()
}

fn counts(side: &Side, name: &str) -> Vec<f64> {
    side.counts.iter().map(|counts| count(counts, name)).collect()
}

fn count(counts: &FrameCounts, name: &str) -> f64 {
    let found = counts.columns().into_iter().find(|(known, _)| *known == name);
    found.expect("a name of the counts").1
}

/// The table of one case.
pub fn table(case: &Case<'_>, columns: &Columns) -> String {
    let mut text = String::new();
    let leaves = Summary::of_numbers(&counts(&columns.lazy, "leaves")).expect("frames were flown");
    let frames = columns.index.len();
    writeln!(
        text,
        "{} k = {}: {frames} frames; leaves p50 {}, max {} of at most {}",
        case.flight,
        case.scene.lod.patch_depth,
        leaves.p50,
        leaves.max,
        case.scene.lod.triangles_max >> case.scene.lod.patch_depth,
    )
    .expect("text grows");
    line(
        &mut text,
        "",
        &["lazy p50", "p99", "max", "mean", "slowest 1%", "full p50", "p99", "max"],
    );
    let slowest = slowest(columns);
    for (name, at) in rows() {
        let lazy = cells(&times(&columns.lazy, at), 3);
        let tail = mean(slowest.iter().map(|&frame| columns.lazy.ms[frame][at]));
        let full = cells(&times(&columns.full, at), 3);
        row(&mut text, name, (lazy, format!("{tail:.3}"), full));
    }
    for name in COUNTED {
        let lazy = counts(&columns.lazy, name);
        let tail = mean(slowest.iter().map(|&frame| lazy[frame]));
        let full = cells(&counts(&columns.full, name), 0);
        row(&mut text, name, (cells(&lazy, 0), format!("{tail:.0}"), full));
    }
    text.push_str(&ratios(columns));
    text.push_str(&listing(columns, &slowest));
    text
}

fn line(text: &mut String, name: &str, cells: &[impl AsRef<str>]) {
    write!(text, "{name:<22}").expect("text grows");
    for cell in cells {
        write!(text, "{:>11}", cell.as_ref()).expect("text grows");
    }
    text.push('\n');
}

/// p50, p99, max and mean; nothing of an empty column.
fn cells(column: &[f64], digits: usize) -> Vec<String> {
    let Some(s) = Summary::of_numbers(column) else { return Vec::new() };
    [s.p50, s.p99, s.max, s.mean].iter().map(|value| format!("{value:.digits$}")).collect()
}

fn row(
    text: &mut String,
    name: &str,
    (mut lazy, tail, mut full): (Vec<String>, String, Vec<String>),
) {
    full.truncate(3);
    lazy.push(tail);
    lazy.append(&mut full);
    line(text, name, &lazy);
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// The slowest hundredth of the frames as shipped, the slowest first.
fn slowest(columns: &Columns) -> Vec<usize> {
    let ms = |frame: &usize| columns.lazy.ms[*frame][FRAME];
    let mut order: Vec<usize> = (0..columns.index.len()).collect();
    order.sort_by(|a, b| ms(b).total_cmp(&ms(a)));
    order.truncate(columns.index.len().div_ceil(100));
    order
}

/// The walks, and what `lazy` takes beside them and beside `full`.
fn ratios(columns: &Columns) -> String {
    let Some(walk) = Summary::of_numbers(&columns.recursion_ms) else { return String::new() };
    let visits = Summary::of_counts(&columns.visits).expect("as many as walks");
    let decide = |side| Summary::of_numbers(&times(side, DECIDE)).expect("frames were flown");
    let judged = |side| mean(counts(side, "evaluations").into_iter());
    let (lazy, full) = (decide(&columns.lazy), decide(&columns.full));
    format!(
        "recursion, {} walks: p50 {:.3}, p99 {:.3}; visits p50 {}, max {}\n\
         prioritise + refine of full / lazy: p50 {:.1}, p99 {:.1}, mean {:.1}; \
         evaluations, mean: {:.1}\n\
         recursion / prioritise + refine of lazy: p50 {:.1}, p99 {:.1}, mean {:.1}\n",
        columns.visits.len(),
        walk.p50,
        walk.p99,
        visits.p50,
        visits.max,
        full.p50 / lazy.p50,
        full.p99 / lazy.p99,
        full.mean / lazy.mean,
        judged(&columns.full) / judged(&columns.lazy),
        walk.p50 / lazy.p50,
        walk.p99 / lazy.p99,
        walk.mean / lazy.mean,
    )
}

/// The slowest frames with what they did: which stage, and why.
fn listing(columns: &Columns, slowest: &[usize]) -> String {
    let mut text = String::new();
    for &frame in slowest.iter().take(LISTED) {
        let times: &Times = &columns.lazy.ms[frame];
        let at = (0..STAGES.len()).max_by(|&a, &b| times[a].total_cmp(&times[b]));
        let at = at.expect("there are stages");
        write!(
            text,
            "slow: frame {} {:.3}, of which {} {:.3};",
            columns.index[frame], times[FRAME], STAGES[at].0, times[at]
        )
        .expect("text grows");
        for name in TOLD {
            write!(text, " {name} {}", count(&columns.lazy.counts[frame], name)).expect("text");
        }
        text.push('\n');
    }
    text
}

/// All frames of one case.
pub fn json(case: &Case<'_>, columns: &Columns) -> Value {
    let side = |side: &Side| {
        let ms: Map<String, Value> =
            rows().map(|(name, at)| (name.to_owned(), json!(times(side, at)))).collect();
        let names = FrameCounts::default().columns();
        let counts: Map<String, Value> = names
            .map(|(name, _)| (name.to_owned(), json!(counts(side, name))))
            .into_iter()
            .collect();
        json!({ "ms": ms, "counts": counts })
    };
    json!({
        "flight": case.flight,
        "patch_depth": case.scene.lod.patch_depth,
        "frame": columns.index,
        "lazy": side(&columns.lazy),
        "full": side(&columns.full),
        "recursion": {
            "every": case.every,
            "ms": columns.recursion_ms,
            "visits": columns.visits,
        },
    })
}
