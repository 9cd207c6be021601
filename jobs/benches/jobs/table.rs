//! The report: lines for people, the same figures as JSON.
//!
//! In:    rows and idle figures.
//! Out:   text on standard output; a JSON value.
//! Keeps: nothing.
//! Not here: how the figures come about (`summary`).

use crate::summary::Row;
use serde_json::{Value, json};

/// Processor time while nothing is to be done.
pub struct IdleRow {
    /// The scheduler's name.
    pub scheduler: &'static str,
    /// How long nothing was to be done.
    pub pause_ns: u64,
    /// Processor time of the whole process meanwhile.
    pub cpu_ns: u64,
    /// Its voluntary context switches; the one of the caller's sleep is among them.
    pub switches: u64,
}

/// Processor time in a second or two that counts as none: the caller's own sleep has to end.
const IDLE_CPU_NS_MAX: u64 = 200_000;

/// What the columns mean.
pub const LEGEND: &str = "\
Columns
  median, p99   time of an iteration, over all rounds
  best          median of the best turn: what other programs did least harm to
  per job       median by the number of empty jobs or chunks
  of ideal      (median of serial / threads) / median, the median over the rounds: 1 is perfect
  of plain      median of plain threads / median, likewise: 1 is as fast
  cpu/work      processor time of all threads by the shortest time of serial, the caller's own
                stage left out (cold2_prewake); not known beside a hog
  switches      voluntary context switches in an iteration, all threads, without the 5 ms sleep
  heap          calls to the allocator in an iteration, after 100 to warm up
Schedulers
  serial: loops of the caller. plain: threads that spin always, an even split of empty chunks, a
  cursor over chunks with work. rayon: the caller in its pool, cut at every chunk; rayon_adaptive:
  cut where rayon likes. ours: a frame held open over iterations back to back, none beside a hog
  or a sleep; ours_unframed: never one but its own; ours_spans: as ours, with times recorded.";

/// The names of the columns.
pub fn print_head() {
    println!(
        "{:<14}{:<15}{:>11} {:>10} {:>10} {:>8} {:>8} {:>8} {:>8} {:>8} {:>9}  goal of ours",
        "workload",
        "scheduler",
        "median us",
        "best us",
        "p99 us",
        "ns/job",
        "of ideal",
        "of plain",
        "cpu/work",
        "switches",
        "heap"
    );
}

/// A workload's lines.
pub fn print_rows(rows: &[Row]) {
    for row in rows {
        let goal = row.verdict.as_ref().map_or(String::new(), |(goal, met)| verdict(goal, *met));
        println!(
            "{:<14}{:<15}{:>11.2} {:>10.2} {:>10.2} {:>8} {:>8} {:>8} {:>8} {:>8.2} {:>9.2}  {goal}",
            row.workload,
            row.scheduler,
            row.median_ns / 1000.0,
            row.best_median_ns / 1000.0,
            row.p99_ns / 1000.0,
            cell(row.per_job_ns, 2),
            cell(row.of_ideal, 3),
            cell(row.of_plain, 3),
            cell(row.cpu_of_work, 2),
            row.switches,
            row.heap_calls,
        );
    }
    for row in rows {
        if let Some([median_ns, p99_ns]) = row.later_ns {
            let (median_us, p99_us) = (median_ns / 1000.0, p99_ns / 1000.0);
            let (name, gave_up) = (row.scheduler, row.give_ups);
            println!(
                "{:<14}{name:<15}{median_us:>11.2} {:>10} {p99_us:>10.2}  {gave_up} gave up",
                "  later start", ""
            );
        }
    }
}

/// The lines of the schedulers at rest.
pub fn print_idle(rows: &[IdleRow]) {
    println!("\nidle: processor time of the process while the caller sleeps after some frames");
    println!("{:<15}{:>9}{:>11}{:>10}", "scheduler", "sleep s", "cpu us", "switches");
    for row in rows {
        let ours = row.scheduler == "ours";
        let met = row.cpu_ns <= IDLE_CPU_NS_MAX;
        let goal = if ours { verdict("no time but to end the sleep", met) } else { String::new() };
        println!(
            "{:<15}{:>9.1}{:>11.1}{:>10}  {goal}",
            row.scheduler,
            row.pause_ns as f64 / 1e9,
            row.cpu_ns as f64 / 1000.0,
            row.switches
        );
    }
}

fn verdict(goal: &str, met: bool) -> String {
    format!("{goal}: {}", if met { "met" } else { "NOT MET" })
}

fn cell(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
}

/// All figures, in nanoseconds.
pub fn json(threads: usize, rounds: usize, rows: &[Row], idle: &[IdleRow]) -> Value {
    let rows: Vec<_> = rows.iter().map(row_json).collect();
    let idle: Vec<_> = idle
        .iter()
        .map(|row| {
            json!({
                "scheduler": row.scheduler,
                "pause_ns": row.pause_ns,
                "cpu_ns": row.cpu_ns,
                "switches": row.switches,
            })
        })
        .collect();
    json!({ "threads": threads, "rounds": rounds, "rows": rows, "idle": idle })
}

fn row_json(row: &Row) -> Value {
    json!({
        "workload": row.workload,
        "scheduler": row.scheduler,
        "iterations": row.iterations,
        "median_ns": row.median_ns,
        "best_median_ns": row.best_median_ns,
        "p99_ns": row.p99_ns,
        "per_job_ns": row.per_job_ns,
        "of_ideal": row.of_ideal,
        "of_plain": row.of_plain,
        "cpu_of_work": row.cpu_of_work,
        "switches": row.switches,
        "heap_calls": row.heap_calls,
        "later_start_median_ns": row.later_ns.map(|later| later[0]),
        "later_start_p99_ns": row.later_ns.map(|later| later[1]),
        "give_ups": row.give_ups,
        "goal": row.verdict.as_ref().map(|(goal, _)| goal),
        "goal_met": row.verdict.as_ref().map(|(_, met)| met),
    })
}
