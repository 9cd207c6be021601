//! What `overfly budget` takes, and what goes with what.
//!
//! In:    arguments.
//! Out:   [`Arguments`], or why they cannot be used.
//! Keeps: nothing.
//! Not here: what is done with them (`budget`).

use crate::cli::Failure;
use crate::cli::replay::{parse_frames, parse_size};
use std::ops::Range;
use std::path::PathBuf;

/// Shown under `budget --help`.
const TEACHES: &str = "\
Work is counted, and counts are the same on every machine to the last digit: gate on them anywhere.
Times are not. A line of times holds where it holds in all runs, fails where it fails in all, else
nobody knows, and that has an exit code of its own. Nothing is trimmed. Frames in which the terrain
comes up are told apart.

A budget is RON; `--init` writes one from a run, with head-room stated:
  Budget(lines: [
      (of: \"triangles\", statistic: \"max\", limit: 110000),
      (of: \"frame\", statistic: \"p99\", limit: 8.0),                       // milliseconds
      (of: \"frame\", statistic: \"hitches_per_min\", over: 25.0, limit: 2),
      (of: \"lod.refine\", statistic: \"p99\", limit: 2.0, severity: \"warn\"),
      (of: \"digest.mesh\", statistic: \"changed\", limit: 0),               // with --baseline
  ])
  of: a counter or stage (names are those of frames.csv), frame, e1_max_px, e1_rms_px, bound_px,
      e5 (measured error over promised bound), instructions (with --instructions N),
      digest.pages, .mesh, .vertices, .draws
  statistic: sum, mean, p50, p95, p99, p99.9, max, share_over, longest_run_over, hitches_per_min
      (the last three with `over`), changed (frames that differ from the baseline)

A baseline is the run.json of an earlier run. Its counters and digests must all be the same, but
for those of which a line with `changed` says otherwise.

--against runs two programs in pairs, in random order, until their relation is known; of the --runs
of each every frame's fastest counts, since other load only adds. SLOWER or
FASTER where the 99 % interval lies beyond --effect, SAME where it lies within, else INCONCLUSIVE.
Only the whole frame being inconclusive makes exit code 3; anything SLOWER makes 1.

Exit codes: 0 pass, 1 fail, 2 bad input, 3 inconclusive, 130 interrupted: what was flown is kept.

Examples:
  overfly budget rainier --init --budget budget.ron
  overfly budget rainier --budget budget.ron --out out/budget
  overfly budget rainier --frames 0..600 --counters-only --baseline base.json
  overfly budget rainier --frames 0..1200 --against ./overfly-main
  overfly budget rainier --frames 0..1200 --scene my.ron --against-scene earth
  overfly budget rainier --frames 0..1200 --calibrate
  overfly budget rainier --frames 0..60 --instructions 60 --record run.json";

/// What `budget` takes.
#[derive(clap::Args)]
#[command(after_help = TEACHES)]
pub struct Arguments {
    /// A bundled flight (rainier, descent, poles) or an .ovf file.
    pub flight: String,
    /// Lines that the run must hold, RON; see below.
    #[arg(long, value_name = "FILE")]
    pub budget: Option<PathBuf>,
    /// Writes a budget from a run instead, to --budget or budget.ron; never over another.
    #[arg(long, conflicts_with_all = ["baseline", "against", "against_scene", "calibrate",
          "counters_only"])]
    pub init: bool,
    /// The run.json of an earlier run, whose counters, errors and digests must be the same.
    #[arg(long, value_name = "FILE")]
    pub baseline: Option<PathBuf>,
    /// Another overfly to hold this one against, in pairs of runs.
    #[arg(long, value_name = "BINARY", conflicts_with_all = ["against_scene", "calibrate"])]
    pub against: Option<PathBuf>,
    /// Another scene to hold this one against, in pairs of runs.
    #[arg(long, value_name = "SCENE", conflicts_with = "calibrate")]
    pub against_scene: Option<String>,
    /// Holds this program against itself, to see what this machine can resolve.
    #[arg(long)]
    pub calibrate: bool,
    /// Folder for run.json, junit.xml, summary.md, frames.csv, trace.json and report.html.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Draws no stills of the worst frames for the page.
    #[arg(long)]
    pub no_stills: bool,
    /// Writes the run alone: every frame's counts, digests, places and times. A baseline.
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// A scene file or a preset (earth, moon, small). A recording brings its own. [default: earth]
    #[arg(long)]
    pub scene: Option<String>,
    /// Only these frames, the end excluded; the terrain comes up before the first.
    #[arg(long, value_name = "A..B", value_parser = parse_frames)]
    pub frames: Option<Range<usize>>,
    /// Size of the picture whose pixels errors are counted in.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    pub size: [u32; 2],
    /// Worker threads beside the main one, 0 to 64. Counts are the same for any number.
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=64))]
    pub workers: Option<u8>,
    /// Pages arrive this many milliseconds of the flight's time after the next frame.
    #[arg(long, value_name = "D", default_value_t = 0,
          value_parser = clap::value_parser!(u32).range(0..=60_000))]
    pub loader_delay_ms: u32,
    /// How often the flight is flown, 1 to 99. [default: 3 where times are judged or compared,
    /// else 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=99))]
    pub runs: Option<u32>,
    /// Keeps and judges no times: the record is the same to the last byte on every machine.
    #[arg(long, conflicts_with_all = ["against", "against_scene", "calibrate"])]
    pub counters_only: bool,
    /// Frames whose error is measured, evenly spread, after all timing; 0 measures none.
    #[arg(long, value_name = "N", default_value_t = 2,
          value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub errors: u32,
    /// Counts the instructions of the first N frames in a run under valgrind, some fifty times slower:
    /// `instructions` in budgets. They tell on a busy machine what times cannot.
    #[arg(long, value_name = "N", default_value_t = 0,
          value_parser = clap::value_parser!(u32).range(0..=100_000))]
    pub instructions: u32,
    /// Pairs of runs: at least A, at most B; from 3 to 1000.
    #[arg(long, value_name = "A..B", default_value = "6..40", value_parser = parse_pairs)]
    pub pairs: (usize, usize),
    /// The smallest difference of interest, percent of the time, 0.1 to 100.
    #[arg(long, value_name = "PERCENT", default_value_t = 3.0, value_parser = parse_effect)]
    pub effect: f64,
    /// Decides in which order pairs run.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}

fn parse_pairs(text: &str) -> Result<(usize, usize), String> {
    let wrong = || format!("`{text}` is not A..B with 3 <= A <= B <= 1000");
    let (a, b) = text.split_once("..").ok_or_else(wrong)?;
    let (a, b) = (a.parse().map_err(|_| wrong())?, b.parse().map_err(|_| wrong())?);
    if (3..=b).contains(&a) && b <= 1000 { Ok((a, b)) } else { Err(wrong()) }
}

fn parse_effect(text: &str) -> Result<f64, String> {
    let effect = text.parse().ok().filter(|effect| (0.1..=100.0).contains(effect));
    effect.ok_or_else(|| format!("`{text}` is not a number from 0.1 to 100"))
}

impl Arguments {
    /// Whether this process flies; pairs alone are flown by others.
    pub fn flies(&self) -> bool {
        self.init || self.judged() || self.record.is_some() || !self.pairs_up()
    }

    /// Whether there is anything to hold or to compare.
    pub fn judges(&self) -> bool {
        !self.init && (self.judged() || self.pairs_up())
    }

    fn judged(&self) -> bool {
        self.budget.is_some() || self.baseline.is_some()
    }

    /// Whether pairs of runs were asked for.
    pub fn pairs_up(&self) -> bool {
        self.against.is_some() || self.against_scene.is_some() || self.calibrate
    }

    /// # Errors
    /// Nothing was asked for.
    pub fn checked(&self) -> Result<(), Failure> {
        let keeps = self.record.is_some() || self.out.is_some();
        if self.judged() || self.init || self.pairs_up() || keeps {
            return Ok(());
        }
        Err("there is nothing to do: give one of --budget FILE, --init, --baseline FILE, --against \
             BINARY, --against-scene SCENE, --calibrate, --record FILE, --out DIR"
            .into())
    }
}
