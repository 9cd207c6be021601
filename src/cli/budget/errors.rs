//! A sparse sample of measured errors and promised bounds, apart from all timing.
//!
//! In:    a plan, a record of its frames, how many of them to measure.
//! Out:   [`Sampled`] errors.
//! Keeps: nothing.
//! Not here: the metrics (`overfly::replay::measure`), limits (`overfly::replay::budget`).

use super::fly::Plan;
use crate::cli::Failure;
use crate::cli::flown::{Flown, page_of};
use crate::cli::replay::default_workers;
use indicatif::{ProgressBar, ProgressStyle};
use overfly::replay::budget::RunRecord;
use overfly::replay::budget::Sampled;
use overfly::replay::budget::record::{ERRORS, told};
use overfly::replay::measure::{FlightErrors, Measure, MeasureSettings};
use std::sync::atomic::{AtomicBool, Ordering};

/// Rays of a measured frame.
const RAYS: u32 = 4000;

/// Measures `count` frames, evenly spread. The terrain comes up before each, so that the frames
/// which were timed are left alone; a stop ends it early with what there is.
pub fn sample(
    plan: &Plan,
    record: &RunRecord,
    count: usize,
    stop: &AtomicBool,
) -> Result<Sampled, Failure> {
    let mut flown = Flown::open(&plan.flight, &plan.scene, plan.manner)?;
    let settings = MeasureSettings {
        rays: RAYS,
        threads: default_workers() + 1,
        thorough_every: 0,
        cross_every: 0,
        ..MeasureSettings::default()
    };
    let mut measure = Measure::new(flown.overfly.terrain(), settings);
    let sources = flown.overfly.sources().clone();
    let first = record.facts.first_frame as usize;
    let mut errors = FlightErrors::default();
    let mut sampled = Sampled::default();
    let count = count.min(record.frames());
    let style = "{bar:40} {pos}/{len} frames measured, {eta} left";
    let bar = ProgressBar::new(count as u64)
        .with_style(ProgressStyle::with_template(style).expect("a fixed template"));
    for k in 0..count {
        let frame = (2 * k + 1) * record.frames() / (2 * count);
        if stop.load(Ordering::Relaxed) || !flown.lead_in(first + frame, stop)? {
            break;
        }
        flown.frame(first + frame)?;
        measure.cut();
        let now = (flown.overfly.terrain(), &flown.output);
        let make = |key, part| page_of(&sources, (key, part));
        measure.frame(now, frame as u64, &make, &mut errors);
        let found = errors.frames.last().expect("just measured");
        let values = [found.e1_px.max, found.e1_px.rms, found.bound_px, found.e5()];
        for (name, value) in ERRORS.into_iter().zip(values) {
            sampled.columns.entry(name.to_owned()).or_default().push(told(value));
        }
        sampled.frames.push(u32::try_from(frame)?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    flown.overfly.close();
    Ok(sampled)
}
