//! `overfly budget`: whether a flight's frames cost what they may.
//!
//! In:    a flight, a scene, a budget, a baseline, another program; the options.
//! Out:   verdicts, reports, a record; an exit code.
//! Keeps: nothing.
//! Not here: verdicts and statistics (`overfly::replay::budget`), flying (`fly`).

mod chart;
mod errors;
mod fly;
mod html;
mod instructions;
mod junit;
mod markdown;
mod options;
mod reports;
mod stills;
mod trace;
mod versus;

use super::flown::Manner;
use super::replay::default_workers;
use super::source::recording_header;
use super::trade::stop_on_ctrl_c;
use super::{BAD_INPUT, Failure, INTERRUPTED, place_of, read_by, write_by, write_whole};
use fly::{Flew, Plan};
pub use options::Arguments;
use overfly::config::{self, read_budget};
use overfly::core::settings::SceneSettings;
use overfly::replay::budget::judge::{budget_names, incomparable, known_names, unshared};
use overfly::replay::budget::record::{ERRORS, FRAME, INSTRUCTIONS, times};
use overfly::replay::budget::{
    BudgetSettings, Outcome, PairRule, RunRecord, Statistic, Status, Verdict, init, judge, outcome,
};
use reports::{Report, word};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use stills::Still;
use versus::{Side, Versus, versus};

/// A line does not hold, or the other program is slower.
const FAILED: u8 = 1;
/// Nobody knows: the machine was not quiet enough.
const INCONCLUSIVE: u8 = 3;
/// Runs where times are judged: one alone does not tell a slow program from a busy machine.
const RUNS: u32 = 3;
/// Stills of a page at most.
const STILLS: usize = 6;
/// So many annotations of one kind are what GitHub shows.
const ANNOTATIONS: usize = 10;

/// What the options name, read before anything flies.
struct Given {
    budget: BudgetSettings,
    baseline: Option<RunRecord>,
    /// Where a record, and where a new budget go.
    record: Option<PathBuf>,
    init: Option<PathBuf>,
    is_recording: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    arguments.checked()?;
    let given = given(arguments)?;
    let plan = plan(arguments, &given)?;
    let stop = stop_on_ctrl_c()?;
    let flew = if arguments.flies() { Some(flown(arguments, &given, &plan, &stop)?) } else { None };
    let mut notes = Vec::new();
    let stopped = stop.load(Ordering::Relaxed);
    let verdicts = match &flew {
        Some(flew) if !stopped => judged(&flew.record, &given, &mut notes)?,
        _ => Vec::new(),
    };
    let against = if stopped { None } else { against(arguments, &plan, &stop)? };
    let stopped = stop.load(Ordering::Relaxed);
    if stopped {
        let frames = flew.as_ref().map_or(0, |flew| flew.record.frames());
        notes.push(format!("Interrupted: {frames} frames and all finished pairs were kept."));
    }
    let all = [Some(outcome(&verdicts)), against.as_ref().map(Versus::outcome)];
    let all = if stopped { Outcome::Inconclusive } else { together(all) };
    let (stills, why) = stills(arguments, &plan, flew.as_ref(), &stop)?;
    notes.extend(why);
    let report = Report {
        flight: &arguments.flight,
        outcome: all,
        notes: &notes,
        verdicts: &verdicts,
        flew: flew.as_ref(),
        versus: against.as_ref(),
        stills: &stills,
        limits_ms: &limits_ms(&given.budget),
    };
    shown(&report);
    written(arguments, &given, &report, stopped)?;
    if arguments.judges() {
        say!("{}: {}", arguments.flight, word(all));
    }
    Ok(ExitCode::from(match all {
        _ if stopped => INTERRUPTED,
        Outcome::Pass => 0,
        Outcome::Fail => FAILED,
        Outcome::Inconclusive => INCONCLUSIVE,
    }))
}

fn together(all: [Option<Outcome>; 2]) -> Outcome {
    let any = |outcome| all.into_iter().flatten().any(|one| one == outcome);
    match (any(Outcome::Fail), any(Outcome::Inconclusive)) {
        (true, _) => Outcome::Fail,
        (false, true) => Outcome::Inconclusive,
        (false, false) => Outcome::Pass,
    }
}

/// Reads and checks everything that the options name.
fn given(arguments: &Arguments) -> Result<Given, Failure> {
    let is_recording = recording_header(&arguments.flight)?.is_some();
    let budget = match arguments.budget.as_deref().filter(|_| !arguments.init) {
        Some(path) => budget_of(path)?,
        None => BudgetSettings::default(),
    };
    if is_recording && budget.lines.iter().any(|line| ERRORS.contains(&line.of)) {
        let (flight, names) = (&arguments.flight, ERRORS.join(", "));
        return Err(format!(
            "{flight} is a recording, whose errors `overfly measure` tells; {names} need a flight"
        )
        .into());
    }
    if arguments.instructions == 0 && budget.lines.iter().any(|line| line.of == INSTRUCTIONS) {
        return Err("the budget names instructions, which only --instructions N counts".into());
    }
    let baseline = arguments.baseline.as_deref().map(read_record).transpose()?;
    let mut taken = read_by([Some(&arguments.flight), arguments.scene.as_ref()]);
    let files = [arguments.baseline.as_deref(), arguments.budget.as_deref()];
    taken.extend(files.into_iter().flatten().filter_map(|path| path.canonicalize().ok()));
    let record = arguments.record.as_deref().map(|path| place_of(path, &mut taken)).transpose()?;
    if let Some(folder) = arguments.out.as_ref().filter(|path| path.exists() && !path.is_dir()) {
        return Err(format!("--out {}: is there and is not a folder", folder.display()).into());
    }
    let init = arguments
        .init
        .then(|| arguments.budget.clone().unwrap_or_else(|| PathBuf::from("budget.ron")));
    if let Some(path) = init.as_ref().filter(|path| path.exists()) {
        let path = path.display();
        return Err(format!("--init: {path} is there already; --budget FILE names another").into());
    }
    Ok(Given { budget, baseline, record, init, is_recording })
}

fn budget_of(path: &Path) -> Result<BudgetSettings, Failure> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|error| format!("cannot read budget {name}: {error}"))?;
    let names = known_names();
    Ok(read_budget(&text, &name, &budget_names(&names))?)
}

/// A record of a file, with every fault naming it.
pub fn read_record(path: &Path) -> Result<RunRecord, Failure> {
    let name = path.display();
    let text = std::fs::read_to_string(path)
        .map_err(|error| format!("cannot read run {name}: {error}"))?;
    let record: RunRecord =
        serde_json::from_str(&text).map_err(|error| format!("{name}: is no run: {error}"))?;
    Ok(record.checked().map_err(|fault| format!("{name}: {fault}"))?)
}

fn plan(arguments: &Arguments, given: &Given) -> Result<Plan, Failure> {
    let (scene_name, scene) = scene_of(arguments)?;
    let workers = arguments.workers.map_or_else(default_workers, usize::from);
    let delay_s = f64::from(arguments.loader_delay_ms) / 1e3;
    let timed = !arguments.counters_only;
    let judges_times = given.budget.lines.iter().any(|line| times().contains(&line.of));
    let several = timed && (judges_times || arguments.init);
    Ok(Plan {
        flight: arguments.flight.clone(),
        scene_name,
        scene_given: arguments.scene.clone(),
        scene,
        manner: Manner { workers, size_px: arguments.size, delay_s },
        frames: arguments.frames.clone(),
        runs: arguments.runs.unwrap_or(if several { RUNS } else { 1 }),
        timed,
        reported: arguments.out.is_some(),
        loader_delay_ms: arguments.loader_delay_ms,
    })
}

fn scene_of(arguments: &Arguments) -> Result<(String, SceneSettings), Failure> {
    match (&arguments.scene, recording_header(&arguments.flight)?) {
        (Some(name), _) => Ok((name.clone(), config::load(name)?)),
        (None, Some(header)) if !header.scene_text.is_empty() => {
            let name = format!("the scene in {}", arguments.flight);
            let scene = config::read(&header.scene_text, &name)?;
            Ok((name, scene))
        }
        (None, _) => Ok(("earth".into(), config::load("earth")?)),
    }
}

/// All runs, then the sample of errors.
fn flown(
    arguments: &Arguments,
    given: &Given,
    plan: &Plan,
    stop: &AtomicBool,
) -> Result<Flew, Failure> {
    let runs = if plan.runs == 1 { "one run".into() } else { format!("{} runs", plan.runs) };
    say!("{} over {}, {runs}", plan.flight, plan.scene_name);
    let mut flew = fly::fly(plan, stop)?;
    let count = arguments.errors as usize;
    if count > 0 && !given.is_recording && !stop.load(Ordering::Relaxed) {
        flew.record.errors = errors::sample(plan, &flew.record, count, stop)?;
    }
    if arguments.instructions > 0 && !stop.load(Ordering::Relaxed) {
        let clip = (flew.record.facts.first_frame as usize, arguments.instructions as usize);
        let clip = (clip.0, clip.1.min(flew.record.frames()));
        flew.record.instructions = instructions::count(plan, clip, stop)?;
    }
    Ok(flew)
}

fn judged(
    record: &RunRecord,
    given: &Given,
    notes: &mut Vec<String>,
) -> Result<Vec<Verdict>, Failure> {
    if let Some(base) = &given.baseline {
        let reasons = incomparable(&record.facts, &base.facts);
        if !reasons.is_empty() {
            return Err(format!("--baseline is of another run: {}", reasons.join("; ")).into());
        }
        if record.facts.settings_digest != base.facts.settings_digest {
            notes.push("The scene's settings are not those of the baseline.".into());
        }
        if record.errors.frames != base.errors.frames {
            notes.push("The baseline has errors of other frames; they were not compared.".into());
        }
        let alone = unshared([record, base]);
        if !alone.is_empty() {
            let alone = alone.join(", ");
            notes.push(format!("Not compared, since only run or baseline counts it: {alone}."));
        }
    }
    Ok(judge(record, &given.budget, given.baseline.as_ref()))
}

/// Stills of the worst frames, for the page; or why there are none.
fn stills(
    arguments: &Arguments,
    plan: &Plan,
    flew: Option<&Flew>,
    stop: &AtomicBool,
) -> Result<(Vec<Still>, Option<String>), Failure> {
    let is_wanted = arguments.out.is_some() && !arguments.no_stills;
    let Some(flew) = flew.filter(|flew| is_wanted && flew.record.frames() > 0) else {
        return Ok((Vec::new(), None));
    };
    let mut worst = html::worst(&flew.record);
    worst.truncate(STILLS);
    let first = flew.record.facts.first_frame as usize;
    Ok(match stills::draw(plan, (first, &worst), stop)? {
        Ok(stills) => (stills, None),
        Err(why) => (Vec::new(), Some(why)),
    })
}

/// Pairs of runs, where they were asked for.
fn against(
    arguments: &Arguments,
    plan: &Plan,
    stop: &AtomicBool,
) -> Result<Option<Versus>, Failure> {
    if !arguments.pairs_up() {
        return Ok(None);
    }
    let own = std::env::current_exe()?;
    let side = |label: String, program: PathBuf, scene: Option<&String>| Side {
        arguments: child_arguments(arguments, plan, scene),
        label,
        program,
    };
    let scene = arguments.scene.as_ref();
    // With --against this program is B, the one that is judged, and the other one is what it was.
    let sides = match (&arguments.against, &arguments.against_scene) {
        (Some(other), _) => [
            side(other.display().to_string(), other.clone(), scene),
            side("this program".into(), own, scene),
        ],
        (None, Some(other)) => [
            side(format!("scene {other}"), own.clone(), Some(other)),
            side(format!("scene {}", plan.scene_name), own, scene),
        ],
        (None, None) => [
            side("this program".into(), own.clone(), scene),
            side("this program again".into(), own, scene),
        ],
    };
    let (least, most) = arguments.pairs;
    let rule = PairRule {
        effect: arguments.effect / 100.0,
        least,
        most,
        seed: arguments.seed,
        ..PairRule::default()
    };
    versus(&sides, rule, arguments.calibrate, stop).map(Some)
}

/// What a child is called with; every default is spelt out, since programs may differ in theirs.
fn child_arguments(arguments: &Arguments, plan: &Plan, scene: Option<&String>) -> Vec<String> {
    let [width, height] = plan.manner.size_px;
    let mut words: Vec<String> = vec!["budget".into(), plan.flight.clone()];
    let mut option = |name: &str, value: String| words.extend([name.to_owned(), value]);
    option("--runs", arguments.runs.unwrap_or(RUNS).to_string());
    option("--errors", "0".into());
    option("--workers", plan.manner.workers.to_string());
    option("--loader-delay-ms", plan.loader_delay_ms.to_string());
    option("--size", format!("{width}x{height}"));
    if let Some(frames) = &arguments.frames {
        option("--frames", format!("{}..{}", frames.start, frames.end));
    }
    if let Some(scene) = scene {
        option("--scene", scene.clone());
    }
    words
}

/// Limits of single frames in milliseconds.
fn limits_ms(budget: &BudgetSettings) -> Vec<f64> {
    let of_frame = budget.lines.iter().filter(|line| line.of == FRAME);
    let limit = |line: &overfly::replay::budget::BudgetLine| match line.statistic {
        Statistic::Max | Statistic::Percentile(_) => Some(line.limit),
        _ => line.over,
    };
    of_frame.filter_map(limit).collect()
}

/// What does not simply hold, on the screen; as annotations where GitHub runs it.
fn shown(report: &Report) {
    report.notes.iter().for_each(|note| say!("{note}"));
    if let Some(versus) = report.versus {
        say!("{}", versus.text().trim_end());
    }
    let count = |status| report.verdicts.iter().filter(|one| one.status == status).count();
    if !report.verdicts.is_empty() {
        let (hold, skipped) = (count(Status::Pass), count(Status::Skipped));
        say!("{hold} of {} lines hold, {skipped} were skipped", report.verdicts.len());
    }
    let loud = || report.verdicts.iter().filter(|one| one.status > Status::Skipped);
    loud().for_each(|one| say!("{:<13} {}", one.status.word(), one.sentence));
    if std::env::var_os("GITHUB_ACTIONS").is_some_and(|is| is == "true") {
        let failed = loud().filter(|one| one.status == Status::Fail);
        failed.take(ANNOTATIONS).for_each(|one| {
            say!("::error title=overfly budget::{}", one.sentence);
        });
    }
}

fn written(
    arguments: &Arguments,
    given: &Given,
    report: &Report,
    stopped: bool,
) -> Result<(), Failure> {
    if let (Some(path), Some(flew)) = (&given.record, report.flew) {
        write_by(path, |file| reports::write_record(&flew.record, file))?;
        say!("wrote {}", path.display());
    }
    if let (Some(path), Some(flew), false) = (&given.init, report.flew, stopped) {
        write_whole(path, init::budget_text(&flew.record).as_bytes())?;
        say!("wrote {}", path.display());
    }
    if let Some(folder) = &arguments.out {
        for path in reports::write(folder, report)? {
            say!("wrote {}", path.display());
        }
    }
    Ok(())
}

/// What `diff` takes.
#[derive(clap::Args)]
#[command(after_help = "\
The first frame and the first stage of the pipeline that differ are named, then what changed:
results (digests), work (counters), speed (medians; whether a difference is real only
`overfly budget --against` can tell).

Exit codes: 0 same results and same work, 1 something differs, 2 bad input.

Examples:
  overfly budget rainier --frames 0..600 --record a.json
  overfly diff a.json b.json")]
pub struct DiffArguments {
    /// A run.json, or what `overfly budget --record` wrote.
    a: PathBuf,
    /// The same of another run.
    b: PathBuf,
}

/// Runs `overfly diff`.
pub fn run_diff(arguments: &DiffArguments) -> Result<ExitCode, Failure> {
    let [a, b] = [read_record(&arguments.a)?, read_record(&arguments.b)?];
    let reasons = incomparable(&b.facts, &a.facts);
    if !reasons.is_empty() {
        eprintln!("overfly: these are not runs of one flight: {}", reasons.join("; "));
        return Ok(ExitCode::from(BAD_INPUT));
    }
    let found = overfly::replay::budget::diff(&a, &b);
    say!("{}", found.text(&b).trim_end());
    Ok(if found.same() { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}
