//! `overfly trade`: what every knob costs and what it buys, over a flight.
//!
//! In:    a flight, a scene, a sweep file, the options.
//! Out:   `trade.csv`, `trade.json`, `trade.html`, `trade.md`; an exit code.
//! Keeps: finished clips and passes in a folder, so that a stopped trade goes on.
//! Not here: points, fronts and slopes (`overfly::replay::trade`), the metrics
//!        (`overfly::replay::measure`).

pub mod entry;
mod fly;
pub mod html;
pub mod keep;
pub mod laws;
pub mod markdown;
pub mod plan;
pub mod plot;
pub mod recommend;
pub mod tables;

use super::{Failure, INTERRUPTED, write_whole};
use entry::Entry;
use fly::{Pass, Shot};
use indicatif::{ProgressBar, ProgressStyle};
use keep::Kept;
use overfly::config;
use overfly::core::digest::mix;
use overfly::replay::trade::{Point, SweepSettings, default_sweep, law_points, points};
use plan::{Flying, Plan};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Shown under `trade --help`.
const MORE: &str = "\
A sweep file is RON; every field is a list and may be left out:
  Sweep(
      tolerance_px: [0.5, 1, 2, 4],        // 0.01 to 1e6
      triangles_max: [10000, 100000],      // 8 to 16000000
      patch_depth: [2, 4, 6],              // 0, 2, 4, 6 or 8
      splits_max: [64, 512],               // 1 to 65536
      vertices: [TwoFloat, EyeF64],
      depth_ranges: [[], [30.0, 10000.0]], // borders in metres, 0.001 to 1e9
      morph_s: [0, 0.25],                  // 0 to 10
      pages_mib: [16, 256],                // 4 to 65536
      loader_delay_ms: [0, 200],           // 0 to 60000
      workers: [0, 1],                     // 0 to 64
      grid: false,                         // true: every value with every other
  )
Without `grid` one knob is turned at a time, the others being as in the scene. Without a file
usual values of each knob are tried.

Errors and counts are the same in every run; times are not: frames are timed in passes of their
own, points in shuffled order. What takes longest is the ground itself, once a clip. Ctrl-C loses
nothing: the same command goes on.

Examples:
  overfly trade rainier
  overfly trade descent --sweep my.ron --every 3000
  overfly recommend rainier --error-px 1";

/// What `trade` takes.
#[derive(clap::Args)]
#[command(after_help = MORE)]
pub struct Arguments {
    /// A bundled flight (rainier, descent, poles), an .ovf file of poses, or one
    /// that `import` reads.
    flight: String,
    /// Values to try, RON; see below.
    #[arg(long, value_name = "FILE")]
    sweep: Option<PathBuf>,
    #[command(flatten)]
    flying: Flying,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let sweep = arguments.sweep.as_deref().map(sweep_of).transpose()?;
    let (plan, base) = Plan::of(&arguments.flight, &arguments.flying)?;
    let folder = folder_of(&arguments.flight, arguments.flying.out.as_deref());
    let stop = stop_on_ctrl_c()?;
    Ok(match trade((&plan, &base), sweep.as_ref(), &folder, &stop)? {
        Some(_) => ExitCode::SUCCESS,
        None => ExitCode::from(INTERRUPTED),
    })
}

/// Where results of a flight go.
pub fn folder_of(flight: &str, asked: Option<&Path>) -> PathBuf {
    let name = Path::new(flight).file_stem().unwrap_or(flight.as_ref());
    asked.map_or_else(|| PathBuf::from("out").join(name), Path::to_owned)
}

fn sweep_of(file: &Path) -> Result<SweepSettings, Failure> {
    let name = file.display().to_string();
    let text = std::fs::read_to_string(file)
        .map_err(|error| format!("cannot read sweep {name}: {error}"))?;
    Ok(config::read_sweep(&text, &name)?)
}

/// Ctrl-C asks for an end; what is finished by then is kept.
pub fn stop_on_ctrl_c() -> Result<Arc<AtomicBool>, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let asked = stop.clone();
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))?;
    Ok(stop)
}

/// All points of a sweep, flown and written down; `None` when stopped.
pub fn trade(
    (plan, base): (&Plan, &Point),
    sweep: Option<&SweepSettings>,
    folder: &Path,
    stop: &AtomicBool,
) -> Result<Option<Vec<Entry>>, Failure> {
    let points = match sweep {
        Some(sweep) => points(base, sweep, false)?,
        None => {
            let mut all = points(base, &default_sweep(), true)?;
            let more = law_points(base).into_iter().filter(|point| !all.contains(point));
            let more: Vec<Point> = more.collect();
            all.extend(more);
            all
        }
    };
    let mut kept = Kept::new(folder.join("points"));
    say!(
        "{} over {}: {} points, {} clips of {} frames, {} timing passes",
        plan.ways.flight,
        plan.ways.scene,
        points.len(),
        plan.clips.len(),
        plan.clips[0].len(),
        plan.ways.repeats,
    );
    let Some(entries) = fly_all((plan, base), &points, &mut kept, stop)? else {
        let folder = kept.folder.display();
        eprintln!("overfly: interrupted; {} results are kept in {folder}", kept.found + kept.flown);
        return Ok(None);
    };
    say!("{} results were kept from before, {} are new", kept.found, kept.flown);
    let laws = laws::laws(base, &entries);
    laws.iter().for_each(|law| say!("{}", law.sentence()));
    for (name, text) in [
        ("trade.csv", tables::csv(&entries)?),
        ("trade.json", tables::json((plan, base), &entries, &laws)?),
        ("trade.md", markdown::text(plan, &entries, &laws)),
        ("trade.html", html::page((plan, base), &entries, &laws)),
    ] {
        let path = folder.join(name);
        write_whole(&path, text.as_bytes())?;
        say!("wrote {}", path.display());
    }
    Ok(Some(entries))
}

/// Measures all points clip by clip, then times them in shuffled order; `None` when stopped.
pub fn fly_all(
    (plan, base): (&Plan, &Point),
    points: &[Point],
    kept: &mut Kept,
    stop: &AtomicBool,
) -> Result<Option<Vec<Entry>>, Failure> {
    let style = "{bar:30} {pos}/{len}, {elapsed} gone, {eta} left, {msg}";
    let bar = ProgressBar::new((points.len() * (plan.clips.len() + repeats(plan))) as u64)
        .with_style(ProgressStyle::with_template(style).expect("a fixed template"));
    let shots = measure_all(plan, (points, base), (kept, &bar), stop)?;
    let Some(shots) = shots else { return Ok(None) };
    let passes = time_all(plan, (points, base), (kept, &bar), stop)?;
    let Some(passes) = passes else { return Ok(None) };
    bar.finish_and_clear();
    let all = points.iter().zip(shots.iter().zip(&passes));
    Ok(Some(all.map(|(point, (shots, passes))| Entry::of(base, point, shots, passes)).collect()))
}

fn repeats(plan: &Plan) -> usize {
    plan.ways.repeats as usize
}

/// Clip by clip: the ground of a clip, which takes longest to make, is the same for all points.
fn measure_all(
    plan: &Plan,
    (points, base): (&[Point], &Point),
    (kept, bar): (&mut Kept, &ProgressBar),
    stop: &AtomicBool,
) -> Result<Option<Vec<Vec<Shot>>>, Failure> {
    let mut shots: Vec<Vec<Shot>> = vec![Vec::new(); points.len()];
    for clip in &plan.clips {
        let mut measure = None;
        for (point, shots) in points.iter().zip(&mut shots) {
            bar.set_message(format!("measuring frame {}: {}", clip.end - 1, point.name(base)));
            let Some(shot) = kept.clip(plan, (point, clip), &mut measure, stop)? else {
                bar.abandon();
                return Ok(None);
            };
            shots.push(shot);
            bar.inc(1);
        }
    }
    Ok(Some(shots))
}

fn time_all(
    plan: &Plan,
    (points, base): (&[Point], &Point),
    (kept, bar): (&mut Kept, &ProgressBar),
    stop: &AtomicBool,
) -> Result<Option<Vec<Vec<Pass>>>, Failure> {
    let mut passes: Vec<Vec<Pass>> = vec![Vec::new(); points.len()];
    for round in 0..plan.ways.repeats {
        for at in shuffled(points.len(), u64::from(round)) {
            bar.set_message(format!("timing pass {}: {}", round + 1, points[at].name(base)));
            let Some(pass) = kept.pass(plan, (&points[at], round), stop)? else {
                bar.abandon();
                return Ok(None);
            };
            passes[at].push(pass);
            bar.inc(1);
        }
    }
    Ok(Some(passes))
}

/// An order of `0..count` that depends on the seed alone.
fn shuffled(count: usize, seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by_key(|&at| mix(mix(seed) ^ at as u64));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_round_has_an_order_of_its_own_and_always_the_same() {
        let [a, b] = [0, 1].map(|seed| shuffled(20, seed));
        assert_ne!(a, b);
        assert_eq!(a, shuffled(20, 0));
        let mut sorted = b;
        sorted.sort_unstable();
        assert_eq!(sorted, (0..20).collect::<Vec<_>>());
    }
}
