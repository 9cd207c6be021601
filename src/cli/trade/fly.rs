//! Flying a point: once to measure, and again, without measuring, to time.
//!
//! In:    a plan, a point.
//! Out:   [`Shot`]: what a clip measured and how much work it was; [`Pass`]: what a pass took.
//! Keeps: nothing.
//! Not here: which points (`overfly::replay::trade`), files (`keep`).

use super::plan::Plan;
use crate::cli::Failure;
use crate::cli::flown::{Flown, page_of};
use crate::cli::replay::default_workers;
use overfly::core::frame::{FrameCounts, STAGES};
use overfly::jobs::{Span, Spans};
use overfly::replay::RunDigest;
use overfly::replay::measure::{FlightErrors, Measure, MeasureSettings};
use overfly::replay::trade::{Clip, Point};
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};

/// A number, or none where it could not be told: JSON has no NaN.
pub type Told = Option<f64>;

/// What a clip yielded; the same on every machine.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Shot {
    /// The metric vector of its last frame.
    pub metrics: Vec<(String, Told)>,
    /// Counts of each frame.
    pub counts: Vec<(String, Vec<Told>)>,
    /// Vertices of a patch.
    pub patch_vertices: u32,
    /// Digest of all its frames.
    pub digest: String,
}

/// What one timing pass took over all clips.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Pass {
    /// Milliseconds of each frame: of all stages, and of each.
    pub stages_ms: Vec<(String, Vec<f64>)>,
}

/// Name of the whole frame, from the first stage's begin to the last one's end.
pub const FRAME: &str = "frame";

/// Flies a clip and measures its last frame. `measure` goes from point to point: the ground under
/// one clip is the same for all of them, and making it takes longer than all else.
pub fn measure_clip(
    plan: &Plan,
    (point, clip): (&Point, &Clip),
    measure: &mut Option<Measure>,
    stop: &AtomicBool,
) -> Result<Option<Shot>, Failure> {
    let mut flown = Flown::open(&plan.ways.flight, &point.scene, plan.manner(point))?;
    if !flown.lead_in(clip.start, stop)? {
        return Ok(None);
    }
    let measure = measure
        .get_or_insert_with(|| Measure::new(flown.overfly.terrain(), measure_settings(plan)));
    measure.cut();
    let names = FrameCounts::default().columns().map(|(name, _)| name);
    let mut counts = names.map(|name| (name.to_owned(), Vec::with_capacity(clip.len())));
    let (mut digest, mut flight) = (RunDigest::default(), FlightErrors::default());
    let sources = flown.overfly.sources().clone();
    let make = |key, part| page_of(&sources, (key, part));
    for index in clip.clone() {
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        flown.frame(index)?;
        digest.add(&flown.output.digest);
        for ((_, column), (_, value)) in counts.iter_mut().zip(flown.output.counts.columns()) {
            column.push(told(value));
        }
        let frame = (flown.overfly.terrain(), &flown.output);
        if index + 1 == clip.end {
            measure.frame(frame, index as u64, &make, &mut flight);
        } else if index + 2 == clip.end {
            measure.take(frame.0, frame.1);
        }
    }
    let metrics = flight.vector().into_iter();
    Ok(Some(Shot {
        metrics: metrics.map(|(name, value)| (name.to_owned(), told(value))).collect(),
        counts: counts.into(),
        patch_vertices: flown.overfly.terrain().patches().vertices_per_patch,
        digest: format!("{:016x}", digest.value()),
    }))
}

/// Every point's frames are measured alike, whatever was measured before.
fn measure_settings(plan: &Plan) -> MeasureSettings {
    MeasureSettings {
        rays: plan.ways.rays,
        cell_px: plan.ways.cell_px,
        threads: default_workers() + 1,
        thorough_every: 1,
        cross_every: 0,
        ..MeasureSettings::default()
    }
}

fn told(value: f64) -> Told {
    Some(value).filter(|value| value.is_finite())
}

/// Flies all clips and times their frames; nothing is measured meanwhile, and what goes before a
/// clip is not counted.
pub fn time_clips(plan: &Plan, point: &Point, stop: &AtomicBool) -> Result<Option<Pass>, Failure> {
    let mut flown = Flown::open(&plan.ways.flight, &point.scene, plan.manner(point))?;
    let names = [FRAME].into_iter().chain(STAGES.iter().map(|Span(name)| *name));
    let mut stages_ms: Vec<(String, Vec<f64>)> =
        names.map(|name| (name.to_owned(), Vec::new())).collect();
    for clip in &plan.clips {
        if !flown.lead_in(clip.start, stop)? {
            return Ok(None);
        }
        for index in clip.clone() {
            if stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            flown.frame(index)?;
            note(&mut stages_ms, flown.overfly.spans());
        }
    }
    Ok(Some(Pass { stages_ms }))
}

fn note(stages_ms: &mut [(String, Vec<f64>)], spans: &Spans) {
    let begin_ns = spans.stages().map(|span| span.begin_ns).min().unwrap_or(0);
    let end_ns = spans.stages().map(|span| span.end_ns).max().unwrap_or(0);
    for (name, column) in stages_ms {
        let own = |span: &&overfly::jobs::SpanRecord| span.span.0 == name;
        let ns = if name == FRAME {
            end_ns - begin_ns
        } else {
            spans.stages().filter(own).map(|span| span.end_ns - span.begin_ns).sum()
        };
        column.push(ns as f64 / 1e6);
    }
}
