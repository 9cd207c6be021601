//! What differs between two runs: speed, work or result, and where first.
//!
//! In:    two records.
//! Out:   [`Difference`].
//! Keeps: nothing.
//! Not here: whether that may be (`judge`), whether a difference in speed is real (`pairs`).

use super::change::Change;
use super::judge::{change, unshared};
use super::record::{DIGESTS, FRAME, RunRecord, counters, times};
use crate::stats::Summary;
use std::fmt::Write;

/// Stages of a frame and the counters that each fills, in pipeline order.
const WORK: [(&str, &[&str]); 5] = [
    (
        "datasource.admit",
        &["pages", "admitted", "evicted", "refused", "queue_depth", "decoded_bytes"],
    ),
    (
        "lod.refine",
        &[
            "evaluations",
            "blocked",
            "splits",
            "merges",
            "diamonds",
            "leaves",
            "triangles",
            "wanted",
            "error_px_bound",
        ],
    ),
    ("mesh.build", &["built", "uploaded_bytes"]),
    ("mesh.place", &["drawn", "draws"]),
    // Of all stages together.
    (FRAME, &["allocations"]),
];

/// What differs between two runs.
#[derive(Clone, PartialEq, Debug)]
pub struct Difference {
    /// Facts that differ, as `name: a, b`.
    pub facts: Vec<String>,
    /// Frames of both.
    pub frames: [usize; 2],
    /// Digests that changed, in pipeline order.
    pub results: Vec<Change>,
    /// Counters that changed.
    pub work: Vec<Change>,
    /// Medians of times over all frames of all runs in milliseconds, before and after. No verdict:
    /// the runs were not made in pairs.
    pub speed: Vec<(&'static str, [f64; 2])>,
    /// The first frame in which anything but times differs.
    pub first: Option<usize>,
    /// The first stage that differs there.
    pub stage: &'static str,
}

/// Holds two runs against each other.
pub fn diff(a: &RunRecord, b: &RunRecord) -> Difference {
    let changes = |names: &[&str]| -> Vec<Change> {
        names.iter().filter_map(|name| change(name, [a, b])).collect()
    };
    let (results, work) = (changes(&DIGESTS), changes(&counters()));
    let first = results.iter().chain(&work).map(|change| change.first).min();
    let frames = [a.frames(), b.frames()];
    let stage = first.map_or("", |frame| stage_of(frame, &results, &work));
    Difference { facts: facts(a, b), frames, speed: speed(a, b), results, work, first, stage }
}

/// The first stage, in pipeline order, whose digest or counters differ in a frame.
fn stage_of(frame: usize, results: &[Change], work: &[Change]) -> &'static str {
    // Digests and the stages after which they are taken.
    const TAKEN: [(&str, &str); 4] = [
        ("digest.pages", "datasource.admit"),
        ("digest.mesh", "lod.refine"),
        ("digest.vertices", "mesh.build"),
        ("digest.draws", "mesh.place"),
    ];
    let there = |name: &str, all: &[Change]| {
        all.iter().any(|change| change.name == name && change.first == frame)
    };
    let differs = |stage: &str, counters: &[&str]| {
        counters.iter().any(|name| there(name, work))
            || TAKEN.iter().any(|(digest, of)| *of == stage && there(digest, results))
    };
    let mut stages = WORK.iter();
    stages.find(|(stage, counters)| differs(stage, counters)).map_or("unknown", |(stage, _)| stage)
}

fn facts(a: &RunRecord, b: &RunRecord) -> Vec<String> {
    let all = |record: &RunRecord| {
        let f = record.facts.clone();
        [
            ("program", f.program),
            ("profile", f.profile),
            ("platform", f.platform),
            ("processor", f.processor),
            ("cores", f.cores.to_string()),
            ("workers", f.workers.to_string()),
            ("flight", f.flight),
            ("scene", f.scene),
            ("settings", f.settings_digest),
            ("size", format!("{:?}", f.size_px)),
            ("loader delay", format!("{} ms", f.loader_delay_ms)),
            ("rate", format!("{} Hz", f.rate_hz)),
            ("first frame", f.first_frame.to_string()),
            ("frames", record.frames().to_string()),
        ]
    };
    let pairs = all(a).into_iter().zip(all(b)).filter(|((_, a), (_, b))| a != b);
    let alone = unshared([a, b]);
    let alone = (!alone.is_empty()).then(|| format!("counted by one alone: {}", alone.join(", ")));
    pairs.map(|((name, a), (_, b))| format!("{name}: {a}, {b}")).chain(alone).collect()
}

fn speed(a: &RunRecord, b: &RunRecord) -> Vec<(&'static str, [f64; 2])> {
    let median = |record: &RunRecord, name| {
        let all = record.times_ms(name).concat();
        Summary::of_numbers(&all).map(|summary| summary.p50)
    };
    let both = |name| Some((name, [median(a, name)?, median(b, name)?]));
    times().into_iter().filter_map(both).collect()
}

impl Difference {
    /// Whether result and work are the same to the last bit.
    pub fn same(&self) -> bool {
        self.first.is_none() && self.frames[0] == self.frames[1]
    }

    /// Everything in words; places are those of the second run.
    pub fn text(&self, b: &RunRecord) -> String {
        let mut out = String::new();
        let mut line = |text: String| writeln!(out, "{text}").expect("a text grows");
        self.facts.iter().for_each(|fact| line(format!("differs: {fact}")));
        match self.first {
            Some(frame) => line(format!("first: {}, stage {}", b.place(frame), self.stage)),
            None => line(format!("no count and no digest differs in {} frames", b.frames())),
        }
        let what = |changes: &[Change]| if changes.is_empty() { "the same" } else { "changed" };
        line(format!("result: {}", what(&self.results)));
        for change in &self.results {
            line(format!("  {}", change.sentence(b, b.frames())));
        }
        line(format!("work: {}", what(&self.work)));
        for change in &self.work {
            line(format!("  {}", change.sentence(b, b.frames())));
        }
        if self.speed.is_empty() {
            line("speed: not timed in both".into());
            return out;
        }
        line("speed: medians in ms; whether that is real only --against can tell".into());
        for (name, [a, b]) in &self.speed {
            let ratio = if *a > 0.0 { (b / a - 1.0) * 100.0 } else { f64::NAN };
            line(format!("  {name:<18}{a:>10.4}{b:>10.4}{ratio:>+9.1} %"));
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_counter_belongs_to_a_stage() {
        let mut named: Vec<&str> = WORK.iter().flat_map(|(_, names)| *names).copied().collect();
        let mut all = counters();
        named.sort_unstable();
        all.sort_unstable();
        assert_eq!(named, all);
    }
}
