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
use crate::cli::{Failure, write_by, write_whole};
use overfly::replay::budget::record::times;
use overfly::replay::budget::{Outcome, RunRecord, Verdict};
use serde::Serialize;
use serde_json::Serializer;
use serde_json::ser::Formatter;
use std::borrow::Cow;
use std::io::{self, Write};
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

/// Writes all of them into a folder, one after the other: those of long flights are large.
pub fn write(folder: &Path, report: &Report) -> Result<Vec<PathBuf>, Failure> {
    let mut written = Vec::new();
    let mut place = |name: &str| {
        written.push(folder.join(name));
        folder.join(name)
    };
    write_whole(&place("junit.xml"), junit::text(report).as_bytes())?;
    write_whole(&place("summary.md"), markdown::text(report).as_bytes())?;
    write_whole(&place("report.html"), html::page(report).as_bytes())?;
    if let Some(flew) = report.flew {
        write_by(&place("run.json"), |file| write_record(&flew.record, file))?;
        write_by(&place("frames.csv"), |file| write_frames(&flew.record, file))?;
        if !flew.spans.is_empty() {
            write_whole(&place("trace.json"), trace::text(flew).as_bytes())?;
        }
    }
    if let Some(versus) = report.versus {
        write_whole(&place("comparison.json"), versus.json().as_bytes())?;
    }
    Ok(written)
}

/// A record as JSON, a line a column, so that differences of two files can be read.
pub fn write_record(record: &RunRecord, to: &mut impl Write) -> io::Result<()> {
    record.serialize(&mut Serializer::with_formatter(&mut *to, Lines::default()))?;
    to.write_all(b"\n")
}

/// Compact JSON, but for a new line after each array that a key follows.
#[derive(Default)]
struct Lines {
    /// The last thing written ended an array.
    ends_array: bool,
}

impl Formatter for Lines {
    fn end_array<W: Write + ?Sized>(&mut self, to: &mut W) -> io::Result<()> {
        self.ends_array = true;
        to.write_all(b"]")
    }

    fn end_object<W: Write + ?Sized>(&mut self, to: &mut W) -> io::Result<()> {
        self.ends_array = false;
        to.write_all(b"}")
    }

    fn begin_object_key<W: Write + ?Sized>(&mut self, to: &mut W, first: bool) -> io::Result<()> {
        let ends_array = std::mem::take(&mut self.ends_array);
        to.write_all(match (first, ends_array) {
            (true, _) => b"",
            (false, true) => b",\n",
            (false, false) => b",",
        })
    }
}

/// One row a frame; times in milliseconds, a column for each run, named as in `frame_ms_1`.
fn write_frames(record: &RunRecord, to: &mut impl Write) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(to);
    let mut heads: Vec<String> =
        ["frame", "time_s", "lat_deg", "lon_deg", "height_m"].map(str::to_owned).into();
    let mut columns: Vec<Cow<'_, [f64]>> = Vec::new();
    for (name, column) in &record.counters {
        heads.push(name.clone());
        columns.push(Cow::from(column));
    }
    for name in times() {
        for (run, column) in record.times_ms(name).into_iter().enumerate() {
            heads.push(format!("{name}_ms_{}", run + 1));
            columns.push(Cow::from(column));
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
    writer.flush()
}
