//! Per-frame jobs: ours, rayon and plain threads, side by side in one run.
//!
//! In:    options; `cargo bench -p overfly-jobs -- --help` lists them.
//! Out:   a table of times, ratios, processor time, switches, heap calls, goals; JSON if asked.
//! Keeps: nothing.
//! Not here: tests; a wrong order of jobs ends the report, a slow one is only reported.
//!
//! Figures come from one run or not at all: the schedulers take turns, and what is compared is the
//! ratio of turns that lay side by side. Threads are pinned, because some kernels put a woken
//! thread on the core of its waker.

mod board;
mod heap;
mod measure;
mod ours;
mod plain;
mod schedulers;
mod spin;
mod summary;
#[cfg(target_os = "linux")]
#[path = "system_linux.rs"]
mod system;
#[cfg(not(target_os = "linux"))]
#[path = "system_other.rs"]
mod system;
mod table;
mod with_rayon;
mod workloads;

use crate::board::Board;
use crate::measure::Bench;
use crate::schedulers::Scheduler;
use crate::spin::Pace;
use crate::summary::Row;
use crate::table::IdleRow;
use crate::workloads::{Pause, WORKLOADS, Workload};
use clap::Parser;
use clap::builder::PossibleValuesParser;
use std::error::Error;
use std::fs;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Duration;

/// Compares the job graph with rayon and with plain threads.
///
/// Every scheduler runs every workload, in rounds in which each takes its turn. Close what else
/// uses the cores: ratios stand some noise, percentiles do not. A run takes one to two minutes.
///
/// Examples: `cargo bench -p overfly-jobs -- --quick` for a first look;
/// `-- --only fan,chain --rounds 100` while working on the graph.
#[derive(Parser)]
#[command(bin_name = "cargo bench -p overfly-jobs --", after_help = table::LEGEND)]
struct Options {
    /// Threads of each scheduler, the caller included.
    #[arg(long, default_value = "2")]
    threads: NonZeroUsize,
    /// Only these workloads, and no idle measurement unless `idle` is named.
    #[arg(long, value_delimiter = ',', value_parser = PossibleValuesParser::new(names()))]
    only: Vec<String>,
    /// Turns of each scheduler in each workload; more turns, steadier figures.
    #[arg(long, default_value = "25")]
    rounds: NonZeroUsize,
    /// Few rounds: some 15 seconds, figures good to a tenth.
    #[arg(long, conflicts_with = "rounds")]
    quick: bool,
    /// Also writes all figures to this file.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// What cargo passes to every benchmark; it has no effect.
    #[arg(long, hide = true)]
    bench: bool,
}

const QUICK_ROUNDS: usize = 4;
const IDLE: Duration = Duration::from_secs(2);
const QUICK_IDLE: Duration = Duration::from_secs(1);

/// What `--only` knows.
fn names() -> Vec<&'static str> {
    WORKLOADS.iter().map(|workload| workload.name).chain(["idle"]).collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse();
    let bench = begin(&options);
    let mut schedulers = schedulers::all(bench.board, bench.threads);
    // Last, since a pool may ask its maker's thread how many cores there are.
    system::pin_to_core(0);
    table::print_head();
    let mut rows = Vec::new();
    for workload in WORKLOADS.iter().filter(|workload| options.wants(workload.name)) {
        rows.extend(measure(&bench, workload, &mut schedulers)?);
    }
    let mut idle = Vec::new();
    if options.wants("idle") {
        let pause = if options.quick { QUICK_IDLE } else { IDLE };
        idle = rest(&bench, &mut schedulers, pause);
    }
    println!("\n{}", table::LEGEND);
    if let Some(file) = options.json {
        let all = table::json(bench.threads, bench.rounds, &rows, &idle);
        fs::write(file, format!("{all:#}\n"))?;
    }
    Ok(())
}

impl Options {
    fn wants(&self, name: &str) -> bool {
        self.only.is_empty() || self.only.iter().any(|only| only == name)
    }
}

/// Measures the machine and says what is to come.
fn begin(options: &Options) -> Bench {
    let bench = Bench {
        // As long as the program, so that threads of every kind may hold on to it.
        board: Box::leak(Box::new(Board::new())),
        pace: Pace::calibrate(),
        threads: options.threads.get(),
        rounds: if options.quick { QUICK_ROUNDS } else { options.rounds.get() },
    };
    let cores = system::core_count();
    let (threads, rounds) = (bench.threads, bench.rounds);
    println!("{threads} threads on {cores} cores, {rounds} rounds");
    if threads > cores {
        println!("more threads than cores: plain threads spin against each other");
    }
    bench
}

/// Measures and prints one workload.
fn measure(
    bench: &Bench,
    workload: &Workload,
    schedulers: &mut [Box<dyn Scheduler>],
) -> Result<Vec<Row>, String> {
    if workload.needs_two() && bench.threads < 2 {
        println!("{:<14}needs two threads", workload.name);
        return Ok(Vec::new());
    }
    let samples = bench.run(workload, schedulers)?;
    let rows = summary::rows(workload, bench.threads, &samples);
    table::print_rows(&rows);
    Ok(rows)
}

/// Measures and prints what the schedulers do while there is nothing to do.
fn rest(bench: &Bench, schedulers: &mut [Box<dyn Scheduler>], pause: Duration) -> Vec<IdleRow> {
    let frame2 = WORKLOADS.iter().find(|workload| workload.name == "frame2");
    let frame2 = frame2.expect("the table has a frame2");
    let between = Workload { pause: Pause::Idle, ..*frame2 };
    let kinds = ["plain", "rayon", "ours"];
    let mut rows = Vec::new();
    for scheduler in schedulers.iter_mut().filter(|one| kinds.contains(&one.name())) {
        let (cpu_ns, switches) = bench.idle(&between, &mut **scheduler, pause);
        let pause_ns = u64::try_from(pause.as_nanos()).expect("seconds");
        rows.push(IdleRow { scheduler: scheduler.name(), pause_ns, cpu_ns, switches });
    }
    table::print_idle(&rows);
    rows
}
