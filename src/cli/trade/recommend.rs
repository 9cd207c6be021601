//! `overfly recommend`: the scene to take for a stated error or a stated budget.
//!
//! In:    a goal; a trade, from a file or flown now.
//! Out:   a scene file, and whether it keeps what it promises; an exit code.
//! Keeps: nothing beside what a trade keeps.
//! Not here: the choice (`overfly::replay::trade::advice`).

use super::entry::Entry;
use super::keep::Kept;
use super::plan::{Flying, Plan};
use super::{fly_all, folder_of, stop_on_ctrl_c, tables, trade};
use crate::cli::{Failure, INTERRUPTED, write_whole};
use overfly::config;
use overfly::replay::trade::{Goal, Point, Search, Yield, choose};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

/// Knobs that are turned to meet a goal.
const TURNED: [&str; 5] =
    ["tolerance_px", "triangles_max", "patch_depth", "splits_max", "pages_mib"];
const DEFAULT_SCENE: &str = "earth";
/// The goal is not met, or what was promised was not kept.
const NOT_KEPT: u8 = 1;

/// Shown under `recommend --help`.
const MORE: &str = "\
--error-px: the cheapest setting (median CPU time, then triangles) whose E1 p99.9 of the worst
measured frame, and where the tolerance decides how fine the mesh is also its bound, is 5 % below
the stated error. Only one ray in a thousand of a measured frame then errs by more.
--budget-ms: the most accurate setting (E1 p99.9, then triangles) whose p99 of CPU time a frame is
15 % below the stated budget. Of this machine, and without drawing.

Settings come from --from, else from trade.json of an earlier trade in the output folder, else
from the default sweep, flown now. Flight, scene, frames and size of a trade from a file count,
not those of other options. Chosen are tolerance_px, triangles_max, patch_depth, splits_max and
pages_mib; the rest stays as the scene has it. Where none will do, triangles_max goes on from the
nearest in steps of 1.41, up or down, four at a time and eight at most.

The scene is then replayed: by `same` over the clips of the trade, by `between` over clips that lie
halfway between, where nothing was measured before; that is the harder test.

Exit codes: 0 kept, 1 no setting was found or the promise was not kept, 2 bad input,
130 interrupted.

Examples:
  overfly recommend rainier --error-px 1 -o rainier.ron
  overfly recommend --budget-ms 2 --from out/rainier/trade.json";

/// How the promise is tried.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Verify {
    /// Over the clips of the trade.
    Same,
    /// Over clips halfway between them.
    Between,
    /// Not at all.
    Off,
}

/// What `recommend` takes.
#[derive(clap::Args)]
#[command(after_help = MORE,
          group = clap::ArgGroup::new("goal").required(true).args(["error_px", "budget_ms"]))]
pub struct Arguments {
    /// A bundled flight (rainier, descent, poles), an .ovf file of poses, or one
    /// that `import` reads. [default: that of --from, else rainier]
    flight: Option<String>,
    /// The error that may be, in pixels.
    #[arg(long, value_name = "PX", value_parser = positive)]
    error_px: Option<f64>,
    /// The time that a frame may take, in milliseconds.
    #[arg(long, value_name = "MS", value_parser = positive)]
    budget_ms: Option<f64>,
    /// A trade.json that `overfly trade` wrote.
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
    /// The scene file to write. [default: out/FLIGHT/recommended.ron]
    #[arg(short, value_name = "FILE")]
    o: Option<PathBuf>,
    /// Whether the scene is replayed, and where.
    #[arg(long, value_enum, default_value = "same")]
    verify: Verify,
    #[command(flatten)]
    flying: Flying,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if value > 0.0 && value < 1e9 => Ok(value),
        _ => Err(format!("`{text}` is not a number above 0 and below 1e9")),
    }
}

/// What is known before the search.
struct Known {
    plan: Plan,
    base: Point,
    points: Vec<(Point, Yield)>,
    /// Where it is known from, in words.
    from: String,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let goal = match (arguments.error_px, arguments.budget_ms) {
        (Some(px), _) => Goal::ErrorPx(px),
        (_, Some(ms)) => Goal::BudgetMs(ms),
        _ => return Err("a goal is missing: --error-px PX or --budget-ms MS".into()),
    };
    let stop = stop_on_ctrl_c()?;
    let Some(mut known) = known(arguments, &stop)? else { return Ok(ExitCode::from(INTERRUPTED)) };
    let flight = known.plan.ways.flight.clone();
    let folder = folder_of(&flight, arguments.flying.out.as_deref());
    let mut kept = Kept::new(folder.join("points"));
    if !search(goal, &mut known, &mut kept, &stop)? {
        return Ok(ExitCode::from(INTERRUPTED));
    }
    let yields: Vec<Yield> = known.points.iter().map(|(_, found)| *found).collect();
    let chosen = match choose(goal, &yields) {
        Ok(chosen) => chosen,
        Err(nearest) => {
            let nearest = nearest.map_or("nothing was measured".into(), |at| {
                let (point, found) = &known.points[at];
                format!("the nearest is {}: {}", point.name(&known.base), words(found))
            });
            eprintln!("overfly: no setting has {}; {nearest}", wish(goal));
            return Ok(ExitCode::from(NOT_KEPT));
        }
    };
    let (point, found) = &known.points[chosen];
    let file = arguments.o.clone().unwrap_or_else(|| folder.join("recommended.ron"));
    write_whole(&file, scene_file(goal, &known, (point, found))?.as_bytes())?;
    say!("{}: {}", point.name(&known.base), words(found));
    say!("wrote {}", file.display());
    verify(arguments.verify, goal, (&known, point), (&file, &stop))
}

/// A trade from a file, or flown now; `None` when stopped.
fn known(arguments: &Arguments, stop: &AtomicBool) -> Result<Option<Known>, Failure> {
    let flight = arguments.flight.as_deref();
    let folder = folder_of(flight.unwrap_or("rainier"), arguments.flying.out.as_deref());
    let place = folder.join("trade.json");
    let from = arguments.from.clone().or_else(|| place.is_file().then_some(place));
    if let Some(file) = from {
        let name = file.display().to_string();
        let text = std::fs::read_to_string(&file)
            .map_err(|error| format!("cannot read trade {name}: {error}"))?;
        let (ways, base, points) = tables::read(&text, &name)?;
        if let Some(other) = flight.filter(|flight| *flight != ways.flight) {
            return Err(format!("{name} is of flight {}, asked for is {other}", ways.flight).into());
        }
        let scene = &arguments.flying.scene;
        if *scene != ways.scene && scene != DEFAULT_SCENE {
            let has = &ways.scene;
            return Err(format!(
                "{name} is over scene {has}, asked for is {scene}; --out names \
                                another folder"
            )
            .into());
        }
        say!("{} points from {name}: {} over {}", points.len(), ways.flight, ways.scene);
        let points = candidates(&base, points);
        return Ok(Some(Known { plan: Plan::again(ways, &base)?, base, points, from: name }));
    }
    let (plan, base) = Plan::of(flight.unwrap_or("rainier"), &arguments.flying)?;
    let Some(entries) = trade((&plan, &base), None, &folder, stop)? else { return Ok(None) };
    let points = entries.into_iter().map(|entry| (entry.point, entry.found, entry.digest));
    let points = candidates(&base, points.collect());
    Ok(Some(Known { plan, base, points, from: "the default sweep".into() }))
}

/// Points that a scene file can stand for and that differ in what was measured. The rest stays as
/// the scene has it: workers and late pages are not the scene's, what only drawing costs was not
/// measured, and pops are not part of any goal. Of points with the same frames the first counts.
fn candidates(base: &Point, all: Vec<tables::Known>) -> Vec<(Point, Yield)> {
    let mut seen = BTreeSet::new();
    let turned = |point: &Point| point.turned_from(base);
    let belongs = |point: &Point| turned(point).iter().all(|(name, _)| TURNED.contains(name));
    let kept = all.into_iter().filter(|(point, ..)| belongs(point));
    kept.filter(|(.., digest)| seen.insert(digest.clone())).map(|(p, y, _)| (p, y)).collect()
}

/// Looks on where no point will do; false when stopped.
fn search(
    goal: Goal,
    known: &mut Known,
    kept: &mut Kept,
    stop: &AtomicBool,
) -> Result<bool, Failure> {
    let yields: Vec<Yield> = known.points.iter().map(|(_, found)| *found).collect();
    let Err(Some(nearest)) = choose(goal, &yields) else { return Ok(true) };
    let from = known.points[nearest].0.clone();
    let lod = &from.scene.lod;
    // Where the tolerance decides, more triangles change nothing: it gives way to the goal.
    let tolerance_px = match goal {
        Goal::ErrorPx(_) => lod.tolerance.0.min(goal.aim()).max(0.01),
        Goal::BudgetMs(_) => lod.tolerance.0,
    };
    let range = [8 << lod.patch_depth, 16_000_000];
    let mut search = Search::from(goal, lod.triangles_max);
    loop {
        let tried = search.next(range);
        if tried.is_empty() {
            return Ok(true);
        }
        say!("nothing has {} yet: trying triangles_max {tried:?}", wish(goal));
        let points = tried.iter().map(|&most| from.with_limits(tolerance_px, most));
        let points: Vec<Point> = points.collect();
        let flown = fly_all((&known.plan, &known.base), &points, kept, stop)?;
        let Some(entries) = flown else { return Ok(false) };
        let met = entries.iter().any(|entry| goal.meets(&entry.found));
        known.points.extend(entries.into_iter().map(|Entry { point, found, .. }| (point, found)));
        if met {
            return Ok(true);
        }
    }
}

/// The goal in words.
fn wish(goal: Goal) -> String {
    match goal {
        Goal::ErrorPx(px) => format!("an error of {px} px less a margin of 5 %"),
        Goal::BudgetMs(ms) => format!("frames of {ms} ms less a margin of 15 %"),
    }
}

fn words(found: &Yield) -> String {
    let [p50, p99] = found.cpu_ms;
    let bound = if found.tolerance_decides() { ", which its tolerance decides" } else { "" };
    format!(
        "E1 p99.9 {:.3} px, rms {:.3} px, bound {:.2} px{bound}, {:.0} triangles, CPU {p50:.3} ms, \
         p99 {p99:.3} ms",
        found.error_px, found.rms_px, found.bound_px, found.triangles
    )
}

/// The scene with what it follows from.
fn scene_file(
    goal: Goal,
    known: &Known,
    (point, found): (&Point, &Yield),
) -> Result<String, Failure> {
    let ways = &known.plan.ways;
    let [w, h] = ways.size_px;
    let mut out = String::new();
    let mut line = |text: &str| writeln!(out, "// {text}").expect("a text grows");
    line(&format!("Recommended by overfly {} for {}.", env!("CARGO_PKG_VERSION"), wish(goal)));
    line(&format!("Follows from {}: {} points.", one_line(&known.from), known.points.len()));
    line(&format!(
        "Flight {}, scene {}, {} clips of frames {} to {}, pictures of {w}x{h} pixels.",
        one_line(&ways.flight),
        one_line(&ways.scene),
        known.plan.clips.len(),
        ways.frames.start,
        ways.frames.end
    ));
    line(&format!("Measured: {}.", words(found)));
    line(&match goal {
        Goal::ErrorPx(px) => format!(
            "Promised: in each of these frames at most one ray in a thousand errs by more than \
             {px} px."
        ),
        Goal::BudgetMs(ms) => format!(
            "Promised: on the machine that measured it, 99 of 100 of these frames take the \
             processor at most {ms} ms, with {} workers and without drawing.",
            point.workers
        ),
    });
    if point.loader_delay_ms > 0 {
        line(&format!("Pages came {} ms late.", point.loader_delay_ms));
    }
    out.push_str(&config::write(&point.scene)?);
    Ok(out)
}

fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// Reads the written scene, flies it anew and says whether it keeps its promise.
fn verify(
    how: Verify,
    goal: Goal,
    (known, point): (&Known, &Point),
    (file, stop): (&Path, &AtomicBool),
) -> Result<ExitCode, Failure> {
    let between = match how {
        Verify::Off => return Ok(ExitCode::SUCCESS),
        Verify::Same => None,
        Verify::Between => Some(known.plan.between()),
    };
    let plan = between.as_ref().unwrap_or(&known.plan);
    let scene = config::load(&file.to_string_lossy())?;
    let points = [Point { scene, ..point.clone() }];
    // Nothing that was kept counts: the promise is tried, not looked up.
    let fresh = tried_folder(file);
    let mut kept = Kept::new(fresh.clone());
    let flown = fly_all((plan, &known.base), &points, &mut kept, stop);
    // What was tried is of no use to anyone; that a folder stays behind changes nothing.
    let _ = std::fs::remove_dir_all(&fresh);
    let Some(found) = flown?.and_then(|mut all| all.pop()).map(|entry| entry.found) else {
        return Ok(ExitCode::from(INTERRUPTED));
    };
    let kept = goal.keeps(&found);
    let verdict = if kept { "kept" } else { "NOT KEPT" };
    say!("replayed: {}", words(&found));
    say!("the promise is {verdict}: {}", stated(goal, &found));
    Ok(if kept { ExitCode::SUCCESS } else { ExitCode::from(NOT_KEPT) })
}

fn tried_folder(file: &Path) -> PathBuf {
    let mut name = file.as_os_str().to_owned();
    name.push(format!(".tried-{}", std::process::id()));
    name.into()
}

fn stated(goal: Goal, found: &Yield) -> String {
    let has = goal.of(found);
    match goal {
        Goal::ErrorPx(px) => format!("{has:.3} px of {px} px"),
        Goal::BudgetMs(ms) => format!("p99 {has:.3} ms of {ms} ms"),
    }
}
