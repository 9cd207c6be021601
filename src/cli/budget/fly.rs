//! Flying for a budget: every frame counted, placed and timed.
//!
//! In:    a [`Plan`].
//! Out:   [`Flew`]: the record of all runs, the spans of the last one.
//! Keeps: nothing.
//! Not here: what a record holds (`overfly::replay::budget`), errors (`errors`), verdicts.

use super::trace;
use crate::cli::Failure;
use crate::cli::flown::{Flown, Manner};
use indicatif::{ProgressBar, ProgressStyle};
use overfly::core::frame::FrameOutput;
use overfly::core::geodesy::Geodetic;
use overfly::core::mesh::patches::{PatchMorph, PatchVertex};
use overfly::core::settings::SceneSettings;
use overfly::jobs::Span;
use overfly::replay::budget::record::{DIGESTS, FRAME, MORE_COUNTERS, Odd, Sampled, told};
use overfly::replay::budget::{ColdStart, Facts, RunRecord};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

/// Places at most at which the ground beneath the eye is asked for.
const GROUND_PLACES: usize = 400;

/// So often those spans are thrown away that no trace will show.
const SPANS_FRAMES: usize = 1 << 14;

/// What is flown, and how often.
pub struct Plan {
    /// Bundled flight or file.
    pub flight: String,
    /// Preset or path, for people.
    pub scene_name: String,
    /// As it was asked for.
    pub scene_given: Option<String>,
    pub scene: SceneSettings,
    pub manner: Manner,
    /// All where there is none.
    pub frames: Option<Range<usize>>,
    pub runs: u32,
    /// Times are kept.
    pub timed: bool,
    /// Spans and the ground's profile are kept, for reports.
    pub reported: bool,
    pub loader_delay_ms: u32,
}

/// One span of a frame.
pub struct Traced {
    /// Frame of the columns.
    pub frame: usize,
    pub name: &'static str,
    pub worker: u16,
    pub begin_ns: u64,
    pub end_ns: u64,
}

/// What flying yielded.
pub struct Flew {
    pub record: RunRecord,
    /// Of the last whole run, by frame.
    pub spans: Vec<Traced>,
}

/// Flies all runs. What was flown before an interruption is whole.
pub fn fly(plan: &Plan, stop: &AtomicBool) -> Result<Flew, Failure> {
    let mut flew: Option<Flew> = None;
    for run in 0..plan.runs {
        let mut flown = Flown::open(&plan.flight, &plan.scene, plan.manner)?;
        let frames = frames_of(plan, &flown)?;
        let mut now = Flew { record: RunRecord::new(facts(plan, &flown, &frames)), spans: vec![] };
        let bar = bar(plan, run, frames.len());
        let whole = one_run((plan, &frames), &mut flown, &mut now, (&bar, stop))?;
        bar.finish_and_clear();
        if run == 0 {
            now.record.facts.interrupted = !whole;
            if plan.reported && whole {
                now.record.ground = ground(&flown, &now.record);
            }
            flown.overfly.close();
            flew = Some(now);
        } else if whole {
            flown.overfly.close();
            merge(flew.as_mut().expect("the first run came before"), now, run);
        }
        if !whole {
            flew.as_mut().expect("there is a run").record.facts.interrupted = true;
            break;
        }
    }
    flew.ok_or_else(|| "there is nothing to fly in 0 runs".into())
}

fn bar(plan: &Plan, run: u32, frames: usize) -> ProgressBar {
    let style = "{bar:40} {pos}/{len} frames, {per_sec}, {eta} left, {msg}";
    ProgressBar::new(frames as u64)
        .with_style(ProgressStyle::with_template(style).expect("a fixed template"))
        .with_message(format!("run {} of {}", run + 1, plan.runs))
}

fn frames_of(plan: &Plan, flown: &Flown) -> Result<Range<usize>, Failure> {
    let count = flown.source.frames();
    let frames = plan.frames.clone().unwrap_or(0..count);
    if frames.end > count || frames.is_empty() {
        let (name, Range { start, end }) = (&plan.flight, &frames);
        return Err(
            format!("--frames {start}..{end}: {name} has {count} frames, 0..{count}").into()
        );
    }
    Ok(frames)
}

/// Flies one run; false where it was stopped.
fn one_run(
    (plan, frames): (&Plan, &Range<usize>),
    flown: &mut Flown,
    flew: &mut Flew,
    (bar, stop): (&ProgressBar, &AtomicBool),
) -> Result<bool, Failure> {
    if plan.timed {
        flew.record.times_ns.push(BTreeMap::new());
    }
    let came_up = flown.lead_in(frames.start, stop)?;
    let lead_in = &flown.lead_in_ns;
    let shown = |ns: u64| if plan.timed { ns } else { 0 };
    flew.record.cold_starts.push(ColdStart {
        frames: u32::try_from(lead_in.len())?,
        total_ns: shown(lead_in.iter().sum()),
        max_ns: shown(lead_in.iter().copied().max().unwrap_or(0)),
    });
    // A recording is played from its beginning, whatever is asked for.
    let skipped = if flown.source.is_followed() { 0..frames.start } else { 0..0 };
    for index in skipped {
        if stop.load(Ordering::Relaxed) {
            return Ok(false);
        }
        flown.frame(index)?;
    }
    for index in frames.clone() {
        if !came_up || stop.load(Ordering::Relaxed) {
            return Ok(false);
        }
        flown.frame(index)?;
        note(plan, flown, index - frames.start, flew);
        bar.inc(1);
    }
    Ok(true)
}

/// Adds the last frame to the columns.
fn note(plan: &Plan, flown: &Flown, frame: usize, flew: &mut Flew) {
    let record = &mut flew.record;
    let at = place(flown);
    record.time_s.push(flown.time_s());
    record.lat_deg.push(rounded(at.lat_rad.to_degrees(), 1e8));
    record.lon_deg.push(rounded(at.lon_rad.to_degrees(), 1e8));
    record.height_m.push(rounded(at.height_m, 1e3));
    let add = |columns: &mut BTreeMap<String, Vec<f64>>, name: &str, value: f64| {
        columns.entry(name.to_owned()).or_default().push(told(value));
    };
    for (name, value) in flown.output.counts.columns() {
        add(&mut record.counters, name, value);
    }
    for (name, value) in MORE_COUNTERS.into_iter().zip(more_counts(flown)) {
        add(&mut record.counters, name, value);
    }
    for (name, digest) in DIGESTS.into_iter().zip(flown.output.digest.parts()) {
        record.digests.entry(name.to_owned()).or_default().push(digest);
    }
    if let Some(times) = record.times_ns.last_mut().filter(|_| plan.timed) {
        for name in overfly::replay::budget::record::times() {
            let stage = || flown.overfly.spans().stage_ns(Span(name)).unwrap_or(0);
            let ns = if name == FRAME { flown.frame_ns } else { stage() };
            times.entry(name.to_owned()).or_default().push(ns);
        }
    }
    if plan.reported && plan.timed {
        flew.spans.extend(flown.overfly.spans().records().map(|span| Traced {
            frame,
            name: span.span.0,
            worker: span.worker,
            begin_ns: span.begin_ns,
            end_ns: span.end_ns,
        }));
        if frame % SPANS_FRAMES == SPANS_FRAMES - 1 {
            trace::thin(flew);
        }
    }
}

/// In the order of [`MORE_COUNTERS`].
fn more_counts(flown: &Flown) -> [f64; MORE_COUNTERS.len()] {
    let FrameOutput { counts, views, .. } = &flown.output;
    let terrain = flown.overfly.terrain();
    let ranges = views.iter().flat_map(|view| &view.ranges);
    let draws = ranges.filter(|range| !range.patches.is_empty()).count();
    let morphs = terrain.settings().lod.morph_s > 0.0;
    let morph_bytes = if morphs { size_of::<PatchMorph>() } else { 0 };
    let patch = f64::from(terrain.patches().vertices_per_patch);
    let bytes = patch * (size_of::<PatchVertex>() + morph_bytes) as f64;
    [
        draws as f64,
        f64::from(counts.built) * bytes,
        flown.queue_depth() as f64,
        flown.decoded_bytes as f64,
        flown.allocations as f64,
    ]
}

/// Where the first eye of the last frame was.
fn place(flown: &Flown) -> Geodetic {
    let body = flown.overfly.terrain().settings().body;
    let eye = flown.output.views.first().map(|view| view.camera.eye);
    let nowhere = Geodetic { lat_rad: 0.0, lon_rad: 0.0, height_m: 0.0 };
    eye.map_or(nowhere, |eye| body.geodetic_from_ecef(eye))
}

/// What is below a part of a place helps nobody and takes room in files.
fn rounded(value: f64, parts: f64) -> f64 {
    (value * parts).round() / parts
}

/// Adds a later run to the first: its times, and the first count that was not the same.
fn merge(first: &mut Flew, next: Flew, run: u32) {
    let (to, from) = (&mut first.record, next.record);
    if to.odd.is_none() {
        let changed = odd(to, &from);
        to.odd = changed.map(|(frame, name)| Odd { run, frame, name });
    }
    to.cold_starts.extend(from.cold_starts);
    to.times_ns.extend(from.times_ns);
    if !next.spans.is_empty() {
        first.spans = next.spans;
    }
}

/// The first frame in which two runs counted differently, and what.
fn odd(a: &RunRecord, b: &RunRecord) -> Option<(u32, String)> {
    let names = a.digests.keys().chain(a.counters.keys());
    let changes = names.filter_map(|name| {
        let change = overfly::replay::budget::judge::change(name, [a, b])?;
        Some((u32::try_from(change.first).ok()?, name.clone()))
    });
    changes.min_by_key(|(frame, _)| *frame)
}

/// Height of the ground beneath the eye, evenly along the flight; where it can be read.
fn ground(flown: &Flown, record: &RunRecord) -> Sampled {
    let every = record.frames().div_ceil(GROUND_PLACES).max(1);
    let mut sampled = Sampled::default();
    let mut heights = Vec::new();
    for frame in (0..record.frames()).step_by(every) {
        let at = Geodetic {
            lat_rad: record.lat_deg[frame].to_radians(),
            lon_rad: record.lon_deg[frame].to_radians(),
            height_m: 0.0,
        };
        let found = flown.overfly.ground_height_m(at).ok().zip(u32::try_from(frame).ok());
        if let Some((height_m, frame)) = found {
            sampled.frames.push(frame);
            heights.push(rounded(height_m, 10.0));
        }
    }
    sampled.columns.insert("height_m".into(), heights);
    sampled
}

fn facts(plan: &Plan, flown: &Flown, frames: &Range<usize>) -> Facts {
    let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let of_times = |fact: String| if plan.timed { fact } else { String::new() };
    let number_of_times = |fact: usize| if plan.timed { count(fact) } else { 0 };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let profile = if cfg!(debug_assertions) { "debug" } else { "release" };
    Facts {
        program: concat!("overfly ", env!("CARGO_PKG_VERSION")).into(),
        profile: of_times(profile.into()),
        platform: of_times(format!("{} {}", std::env::consts::OS, std::env::consts::ARCH)),
        processor: of_times(processor()),
        cores: number_of_times(cores),
        workers: number_of_times(plan.manner.workers),
        flight: flown.source.name().to_owned(),
        scene: plan.scene_name.clone(),
        settings_digest: format!("{:016x}", plan.scene.digest()),
        size_px: flown.source.size_px().unwrap_or(plan.manner.size_px),
        loader_delay_ms: plan.loader_delay_ms,
        rate_hz: flown.source.rate_hz(),
        first_frame: count(frames.start),
        interrupted: false,
    }
}

/// The processor as Linux calls it; nothing elsewhere.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = text.lines().find(|line| line.starts_with("model name"));
    let name = line.and_then(|line| line.split_once(':')).map(|(_, name)| name.trim());
    name.unwrap_or_default().to_owned()
}
