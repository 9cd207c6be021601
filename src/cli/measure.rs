//! `overfly measure`: how far what is drawn strays from the ground, over a flight.
//!
//! In:    a flight or recording, a scene, the options.
//! Out:   a table, JSON, pictures; an exit code.
//! Keeps: nothing.
//! Not here: the metrics (`overfly::replay::measure`), flying (`flown`).

mod canvas;
mod charts;
mod json;
mod table;
mod tuned;

use super::flown::{Flown, Manner, page_of};
use super::replay::{default_workers, parse_frames, parse_size};
use super::source::recording_header;
use super::{Failure, INTERRUPTED, place_of, read_by, write_whole};
use charts::Worst;
use indicatif::{ProgressBar, ProgressStyle};
use overfly::config;
use overfly::core::settings::SceneSettings;
use overfly::replay::measure::{FlightErrors, MakePage, Measure, MeasureSettings, Taken};
use std::ops::Range;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A bound did not hold, or there is a crack.
const UNSOUND: u8 = 1;

/// So many frames are measured at most where `--every` says nothing.
const FRAMES: usize = 600;

/// Shown under `measure --help`.
const TEACHES: &str = "\
Every ray of a measured frame meets the ground itself, in f64 and as fine as the picture can show,
and the mesh that is drawn. E1, the radial error, is the distance of both on the screen, along the
vertical; E5 is its maximum over what is certain of the frame. docs/accuracy.md says what each metric is.

In every 30th measured frame the costly metrics are measured as well (E4, C1-C3, H, J1, M32, Z), more
often where few frames are measured; in every third of those, E1 is found a second way.

Exit codes: 0 all bounds held and there is no crack, 1 one of them did not hold, 2 bad input,
130 interrupted: what was measured until then is shown and written.

Examples:
  overfly measure rainier
  overfly measure rainier --frames 6000..6600 --every 1 --json rainier.json --out rainier
  overfly measure descent --tolerance-px 2 --triangles-max 50000 --rays 20000
  overfly measure poles --loader-delay-ms 100 --morph-s 0";

/// What `measure` takes.
#[derive(clap::Args)]
#[command(after_help = TEACHES)]
pub struct Arguments {
    /// A bundled flight (rainier, descent, poles) or an .ovf file.
    flight: String,
    /// A scene file or a preset (earth, moon, small). A recording brings its own. [default: earth]
    #[arg(long)]
    scene: Option<String>,
    /// Only these frames, the end excluded. The terrain comes up at A.
    #[arg(long, value_name = "A..B", value_parser = parse_frames)]
    frames: Option<Range<usize>>,
    /// Measures every N-th frame; the others are only flown. [default: so that no more than 600
    /// frames are measured]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    every: Option<u32>,
    /// Rays of a measured frame, at least. 100000 are needed to tell p99.9 well.
    #[arg(long, value_name = "N", default_value_t = 100_000,
        value_parser = clap::value_parser!(u32).range(1..=16_000_000))]
    rays: u32,
    /// Size of the picture whose pixels errors are counted in.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    size: [u32; 2],
    /// Threads beside the main one, 0 to 64. The results are the same for any number.
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=64))]
    workers: Option<u8>,
    /// Pages arrive this many milliseconds of the flight's time after the next frame.
    #[arg(long, value_name = "D", default_value_t = 0,
        value_parser = clap::value_parser!(u32).range(0..=60_000))]
    loader_delay_ms: u32,
    #[command(flatten)]
    tuned: tuned::Tuned,
    /// Cells of the reference ground look no larger than this, in pixels.
    #[arg(long, value_name = "PX", default_value_t = 1.0, value_parser = parse_cell)]
    cell_px: f64,
    /// Writes the metric vector and every frame's columns.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Writes pictures there: errors over the worst view, along the flight, on its map.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

fn parse_cell(text: &str) -> Result<f64, String> {
    let cell = text.parse().ok().filter(|cell| (0.05..=64.0).contains(cell));
    cell.ok_or_else(|| format!("`{text}` is not a number from 0.05 to 64"))
}

/// Facts of a run beside its errors.
pub struct Facts {
    /// Name of the flight or recording.
    pub flight: String,
    /// Preset or path of the scene.
    pub scene_name: String,
    /// The scene with what the options changed.
    pub scene: SceneSettings,
    /// Frames flown.
    pub frames: Range<usize>,
    /// Every so many of them were measured.
    pub every: usize,
    /// Size of the picture.
    pub size_px: [u32; 2],
    /// How the frames were measured.
    pub settings: MeasureSettings,
    /// The run was interrupted.
    pub interrupted: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let (scene_name, mut scene) = scene_of(arguments)?;
    arguments.tuned.apply(&mut scene)?;
    let json = places(arguments)?;
    let workers = arguments.workers.map_or_else(default_workers, usize::from);
    let delay_s = f64::from(arguments.loader_delay_ms) / 1e3;
    let manner = Manner { workers, size_px: arguments.size, delay_s };
    let flown = Flown::open(&arguments.flight, &scene, manner)?;
    let frames = frames_of(arguments, &flown)?;
    let least = frames.len().div_ceil(FRAMES).max(1);
    let every = arguments.every.map_or(Ok(least), usize::try_from)?;
    // Where few frames are measured, more of them are measured thoroughly: some 20 at least.
    let thorough_every = (frames.len() / every / 20).clamp(1, 30) as u64;
    let settings = MeasureSettings {
        rays: arguments.rays,
        cell_px: arguments.cell_px,
        threads: workers + 1,
        thorough_every,
        cross_every: 3 * thorough_every,
        ..MeasureSettings::default()
    };
    let mut facts = Facts {
        flight: flown.source.name().to_owned(),
        scene_name,
        scene,
        every,
        size_px: flown.source.size_px().unwrap_or(arguments.size),
        frames,
        settings,
        interrupted: false,
    };
    say!("{}", table::head(&facts));
    let (errors, worst) = measure(flown, &mut facts)?;
    say!("{}", table::text(&errors).trim_end());
    if let Some(path) = json {
        write_whole(&path, json::text(&facts, &errors).as_bytes())?;
        say!("wrote {}", path.display());
    }
    if let Some(folder) = &arguments.out {
        for path in charts::write(folder, &facts, &errors, worst.as_ref())? {
            say!("wrote {}", path.display());
        }
    }
    let faults = errors.faults();
    faults.iter().for_each(|fault| say!("{fault}"));
    Ok(ExitCode::from(match (facts.interrupted, faults.is_empty()) {
        (true, _) => INTERRUPTED,
        (false, true) => 0,
        (false, false) => UNSOUND,
    }))
}

fn scene_of(arguments: &Arguments) -> Result<(String, SceneSettings), Failure> {
    let header = recording_header(&arguments.flight)?;
    match (&arguments.scene, header) {
        (Some(name), _) => Ok((name.clone(), config::load(name)?)),
        (None, Some(header)) if !header.scene_text.is_empty() => {
            let name = format!("the scene in {}", arguments.flight);
            let scene = config::read(&header.scene_text, &name)?;
            Ok((name, scene))
        }
        (None, _) => Ok(("earth".into(), config::load("earth")?)),
    }
}

/// Where the JSON goes, checked before anything runs.
fn places(arguments: &Arguments) -> Result<Option<PathBuf>, Failure> {
    let mut taken = read_by([Some(&arguments.flight), arguments.scene.as_ref()]);
    arguments.json.as_deref().map(|path| place_of(path, &mut taken)).transpose()
}

fn frames_of(arguments: &Arguments, flown: &Flown) -> Result<Range<usize>, Failure> {
    let all = flown.source.frames();
    if !flown.source.is_whole() {
        eprintln!("overfly: {}: the file has no end; its whole frames count", arguments.flight);
    }
    let frames = arguments.frames.clone().unwrap_or(0..all);
    if frames.end > all {
        let (first, end) = (frames.start, frames.end);
        return Err(
            format!("--frames: {first}..{end} goes beyond the {all} frames there are").into()
        );
    }
    Ok(frames)
}

/// Flies and measures; ends early, and says so in the facts, where it is interrupted.
fn measure(mut flown: Flown, facts: &mut Facts) -> Result<(FlightErrors, Option<Worst>), Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let asked = stop.clone();
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))?;
    let mut measure = Measure::new(flown.overfly.terrain(), facts.settings);
    measure.stop_on(stop.clone());
    let mut errors = FlightErrors::default();
    let mut worst: Option<Worst> = None;
    let sources = flown.overfly.sources().clone();
    // A page takes long enough to be waited for after Ctrl-C.
    let make = |key, part| {
        if stop.load(Ordering::Relaxed) { None } else { page_of(&sources, (key, part)) }
    };
    let style = "{bar:40} {pos}/{len} frames, {eta} left; E1 {msg}";
    let bar = ProgressBar::new(facts.frames.len() as u64)
        .with_style(ProgressStyle::with_template(style).expect("a fixed template"));
    if facts.frames.start > 0 {
        flown.source.forget_states();
    }
    let came_up = flown.lead_in(facts.frames.start, &stop)?;
    let mut pair = Pair { taken: Taken::new(facts.scene.body), is_taken: false, is_ahead: false };
    for index in facts.frames.clone() {
        if !came_up || stop.load(Ordering::Relaxed) {
            facts.interrupted = true;
            break;
        }
        pair.fly(&mut flown, index)?;
        let left = (index - facts.frames.start) % facts.every;
        if left == 0 && !flown.output.views.is_empty() {
            let next = Some(index + 1).filter(|next| facts.every == 1 && *next < facts.frames.end);
            let ground = (&make as MakePage<'_>, &mut errors);
            if !pair.measure((&mut measure, &mut flown), (index, next), ground)? {
                facts.interrupted = true;
                break;
            }
            let frame = errors.frames.last().expect("just measured");
            bar.set_message(format!("{:.3} px of {:.3}", frame.e1_px.max, frame.bound_px));
            if worst.as_ref().is_none_or(|worst| worst.frame.e1_px.max < frame.e1_px.max) {
                worst = Some(Worst { frame: frame.clone(), map: measure.map() });
            }
        } else if left + 1 == facts.every && !flown.output.views.is_empty() {
            measure.take(flown.overfly.terrain(), &flown.output);
        } else {
            measure.cut();
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    flown.overfly.close();
    Ok((errors, worst))
}

/// A frame that is measured, and the next one, which is flown meanwhile: both have serial parts.
struct Pair {
    taken: Taken,
    /// The mesh of the frame that was flown last was taken.
    is_taken: bool,
    /// The frame that is asked for next was flown already.
    is_ahead: bool,
}

impl Pair {
    /// Flies a frame, if that was not done.
    fn fly(&mut self, flown: &mut Flown, index: usize) -> Result<(), Failure> {
        if std::mem::take(&mut self.is_ahead) {
            return Ok(());
        }
        self.is_taken = false;
        flown.frame(index)
    }

    fn take(&mut self, flown: &Flown) {
        self.is_taken = !flown.output.views.is_empty();
        if self.is_taken {
            self.taken.take(flown.overfly.terrain(), &flown.output);
        }
    }

    /// Measures frame `index`, and flies the next one beside it where its terrain is not needed any
    /// more. False if it was stopped.
    fn measure(
        &mut self,
        (measure, flown): (&mut Measure, &mut Flown),
        (index, next): (usize, Option<usize>),
        (make, errors): (MakePage<'_>, &mut FlightErrors),
    ) -> Result<bool, Failure> {
        if !self.is_taken {
            self.take(flown);
        }
        measure.accept(&mut self.taken);
        let Some(next) = next.filter(|_| !measure.needs_terrain()) else {
            let frame = (flown.overfly.terrain(), &flown.output);
            return Ok(measure.judge(frame, index as u64, make, errors));
        };
        std::thread::scope(|scope| {
            let judging = scope.spawn(|| measure.judge_accepted(index as u64, make, errors));
            flown.frame(next)?;
            self.take(flown);
            self.is_ahead = true;
            Ok(judging.join().expect("measuring does not panic"))
        })
    }
}
