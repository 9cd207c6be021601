//! `overfly measure`: how far what is drawn strays from the ground, over a flight.
//!
//! In:    a flight or recording, a scene, the options.
//! Out:   a table, JSON, pictures; an exit code.
//! Keeps: nothing.
//! Not here: the metrics (`overfly::replay::measure`), flying (`flown`).

use super::flown::{Flown, Manner};
use super::replay::{default_workers, parse_frames, parse_size};
use super::{Failure, INTERRUPTED};
use indicatif::{ProgressBar, ProgressStyle};
use overfly::config;
use overfly::replay::measure::{FlightErrors, Measure, MeasureSettings};
use std::ops::Range;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What `measure` takes.
#[derive(clap::Args)]
pub struct Arguments {
    /// A bundled flight (rainier, descent, poles) or an .ovf file.
    flight: String,
    /// A scene file or a preset (earth, moon, small).
    #[arg(long, default_value = "earth")]
    scene: String,
    /// Only these frames, the end excluded.
    #[arg(long, value_name = "A..B", value_parser = parse_frames)]
    frames: Option<Range<usize>>,
    /// Measures every N-th frame; the others are only flown.
    #[arg(long, value_name = "N", default_value_t = 1)]
    every: usize,
    /// Rays of a measured frame, at least.
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    rays: u32,
    /// Size of the picture whose pixels errors are counted in.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    size: [u32; 2],
    /// Tolerance in pixels, instead of the scene's.
    #[arg(long, value_name = "PX")]
    tolerance_px: Option<f64>,
    /// Most triangles, instead of the scene's.
    #[arg(long, value_name = "N")]
    triangles_max: Option<u32>,
    /// Cells of the reference ground look no larger than this, in pixels.
    #[arg(long, value_name = "PX", default_value_t = 1.0)]
    cell_px: f64,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let mut scene = config::load(&arguments.scene)?;
    if let Some(px) = arguments.tolerance_px {
        scene.lod.tolerance.0 = px;
    }
    if let Some(most) = arguments.triangles_max {
        scene.lod.triangles_max = most;
    }
    let workers = default_workers();
    let manner = Manner { workers, size_px: arguments.size, delay_s: 0.0 };
    let mut flown = Flown::open(&arguments.flight, &scene, manner)?;
    let frames = arguments.frames.clone().unwrap_or(0..flown.source.frames());
    let stop = Arc::new(AtomicBool::new(false));
    let asked = stop.clone();
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))?;
    let style = "{bar:40} {pos}/{len} frames, {per_sec}, {eta} left {msg}";
    let bar = ProgressBar::new(frames.len() as u64)
        .with_style(ProgressStyle::with_template(style).expect("a fixed template"));
    flown.lead_in(frames.start, &stop)?;
    let settings = MeasureSettings {
        rays: arguments.rays,
        cell_px: arguments.cell_px,
        threads: workers + 1,
        ..MeasureSettings::default()
    };
    let mut measure = Measure::new(flown.overfly.terrain(), settings);
    let mut flight = FlightErrors::default();
    let sources = flown.overfly.sources().clone();
    let make = |key| sources.page(key).ok();
    for index in frames.clone() {
        if stop.load(Ordering::Relaxed) {
            return Ok(ExitCode::from(INTERRUPTED));
        }
        flown.frame(index)?;
        let (terrain, output) = (flown.overfly.terrain(), &flown.output);
        if (index - frames.start).is_multiple_of(arguments.every) {
            measure.frame((terrain, output), index as u64, &make, &mut flight);
            let e = flight.frames.last().expect("just measured");
            let c = &output.counts;
            say!(
                "{index} tri {} above {:.0} bound {:.2} e1 rms {:.3} p99 {:.3} p999 {:.3} max {:.3} ({:.0},{:.0}) e5 {:.3} e3 {} holes {} pin {} lost {} t1 {} pop p999 {:.4} max {:.3} plates {}/{}",
                c.triangles,
                e.above_m,
                e.bound_px,
                e.e1_px.rms,
                e.e1_px.p99,
                e.e1_px.p999,
                e.e1_px.max,
                e.e1_px.at.pixel[0],
                e.e1_px.at.pixel[1],
                e.e5(),
                e.e3_rays,
                e.holes,
                e.pinholes,
                e.lost,
                e.stretched,
                e.p1_px.p999,
                e.p1_px.max,
                measure.reference.shown(),
                measure.reference.plates()
            );
        } else if (index + 1 - frames.start).is_multiple_of(arguments.every) {
            measure.take(terrain, output);
        } else {
            measure.cut();
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    say!("E1 {:?}", flight.e1_px.spread());
    Ok(ExitCode::SUCCESS)
}
