//! Every report of a budget, written beside and renamed.
//!
//! In:    what was flown, judged and compared.
//! Out:   `run.json`, `junit.xml`, `summary.md`, `frames.csv`, `trace.json`, `report.html`.
//! Keeps: nothing.
//! Not here: what is in them (`junit`, `markdown`, `trace`, `html`).

use super::fly::Flew;
use super::stills::Still;
use super::versus::Versus;
use super::{html, junit, markdown, trace};
use crate::cli::{Failure, write_whole};
use overfly::replay::budget::record::times;
use overfly::replay::budget::{Outcome, RunRecord, Verdict};
use std::path::{Path, PathBuf};

/// What reports are made of.
pub struct Report<'a> {
    /// As it was asked for.
    pub flight: &'a str,
    pub outcome: Outcome,
    /// What was assumed, left out or cut short.
    pub notes: &'a [String],
    pub verdicts: &'a [Verdict],
    pub flew: Option<&'a Flew>,
    pub versus: Option<&'a Versus>,
    /// Of the worst frames.
    pub stills: &'a [Still],
    /// Limits of single frames, for the chart of frame times.
    pub limits_ms: &'a [f64],
}

/// An outcome in one word.
pub fn word(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Pass => "pass",
        Outcome::Fail => "FAIL",
        Outcome::Inconclusive => "inconclusive",
    }
}

/// Writes all of them into a folder.
pub fn write(folder: &Path, report: &Report) -> Result<Vec<PathBuf>, Failure> {
    let mut files = vec![
        ("junit.xml", junit::text(report)),
        ("summary.md", markdown::text(report)),
        ("report.html", html::page(report)),
    ];
    if let Some(flew) = report.flew {
        files.push(("run.json", record_text(&flew.record)?));
        files.push(("frames.csv", frames_csv(&flew.record)?));
        if !flew.spans.is_empty() {
            files.push(("trace.json", trace::text(flew)));
        }
    }
    if let Some(versus) = report.versus {
        files.push(("comparison.json", versus.json()));
    }
    let mut written = Vec::new();
    for (name, text) in files {
        let path = folder.join(name);
        write_whole(&path, text.as_bytes())?;
        written.push(path);
    }
    Ok(written)
}

/// A record as JSON, a line a column, so that differences of two files can be read.
pub fn record_text(record: &RunRecord) -> Result<String, Failure> {
    // Within a text a quotation mark would have a backslash before it.
    Ok(serde_json::to_string(record)?.replace("],\"", "],\n\"") + "\n")
}

/// One row a frame; times in milliseconds, a column for each run, named as in `frame_ms_1`.
fn frames_csv(record: &RunRecord) -> Result<String, Failure> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut heads: Vec<String> =
        ["frame", "time_s", "lat_deg", "lon_deg", "height_m"].map(str::to_owned).into();
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for (name, column) in &record.counters {
        heads.push(name.clone());
        columns.push(column.clone());
    }
    for name in times() {
        for (run, column) in record.times_ms(name).into_iter().enumerate() {
            heads.push(format!("{name}_ms_{}", run + 1));
            columns.push(column);
        }
    }
    writer.write_record(&heads)?;
    for frame in 0..record.frames() {
        let places = [&record.time_s, &record.lat_deg, &record.lon_deg, &record.height_m];
        let number = record.facts.first_frame as usize + frame;
        let row = std::iter::once(number.to_string())
            .chain(places.map(|column| column[frame].to_string()))
            .chain(columns.iter().map(|column| column[frame].to_string()));
        writer.write_record(row)?;
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}
