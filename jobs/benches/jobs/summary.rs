//! From samples to figures: percentiles, ratios, goals.
//!
//! In:    the samples of all schedulers for one workload.
//! Out:   a [`Row`] per scheduler.
//! Keeps: nothing.
//! Not here: the clock (`measure`), how the figures are laid out (`table`).

use crate::measure::Samples;
use crate::workloads::{Goal, Work, Workload};

/// The figures of one scheduler for one workload.
pub struct Row {
    /// The workload's name.
    pub workload: &'static str,
    /// The scheduler's name.
    pub scheduler: &'static str,
    /// Iterations that counted.
    pub iterations: usize,
    /// Of the time of an iteration.
    pub median_ns: f64,
    /// Of the turn with the lowest one: what is left where other programs did not interfere.
    pub best_median_ns: f64,
    /// Of the time of an iteration.
    pub p99_ns: f64,
    /// The median by the number of jobs, where they have no work.
    pub per_job_ns: Option<f64>,
    /// Time of one thread over the number of threads, by this time.
    pub of_ideal: Option<f64>,
    /// Time of plain threads by this time.
    pub of_plain: Option<f64>,
    /// Processor time by the work, where there is work and no hog takes its share.
    pub cpu_of_work: Option<f64>,
    /// Voluntary context switches in an iteration, less the caller's own sleep before it.
    pub switches: f64,
    /// Calls to the allocator in an iteration.
    pub heap_calls: f64,
    /// From the begin to the start of the later of two jobs: median and 99th percentile.
    pub later_ns: Option<[f64; 2]>,
    /// Jobs in all iterations that waited 2 ms in vain for the other of their pair.
    pub give_ups: u64,
    /// What was to be reached, and whether it was; `None` but for `ours`.
    pub verdict: Option<(String, bool)>,
}

/// Ratios are made per round, from the medians of two turns that lay side by side, and the row has
/// the median of those: drift from round to round is in neither.
pub fn rows(workload: &Workload, threads: usize, all: &[Samples]) -> Vec<Row> {
    let find = |name: &str| all.iter().find(|samples| samples.scheduler == name);
    let (serial, plain) = (find("serial"), find("plain"));
    all.iter().map(|own| row(workload, threads, own, [serial, plain])).collect()
}

fn row(
    workload: &Workload,
    threads: usize,
    own: &Samples,
    [serial, plain]: [Option<&Samples>; 2],
) -> Row {
    let count = own.times_ns.len() as f64;
    let turn = workload.iterations;
    let median_ns = percentile(&own.times_ns, 50);
    let turn_medians = own.times_ns.chunks(turn).map(|times_ns| percentile(times_ns, 50));
    let works = workload.work != Work::Empty && !workload.hog;
    let asleep = if workload.sleeps() { 1.0 } else { 0.0 };
    let mut row = Row {
        workload: workload.name,
        scheduler: own.scheduler,
        iterations: own.times_ns.len(),
        median_ns,
        best_median_ns: turn_medians.fold(f64::INFINITY, f64::min),
        p99_ns: percentile(&own.times_ns, 99),
        per_job_ns: workload.jobs().map(|jobs| median_ns / jobs),
        of_ideal: serial.map(|serial| ratio(serial, own, turn) / threads as f64),
        of_plain: plain.map(|plain| ratio(plain, own, turn)),
        cpu_of_work: serial
            .filter(|_| works)
            .map(|serial| own.cpu_ns as f64 / count / percentile(&serial.times_ns, 0)),
        switches: (own.switches as f64 / count - asleep).max(0.0),
        heap_calls: own.heap_calls as f64 / count,
        later_ns: workload
            .meets()
            .then(|| [percentile(&own.later_ns, 50), percentile(&own.later_ns, 99)]),
        give_ups: own.give_ups,
        verdict: None,
    };
    row.verdict = (own.scheduler == "ours").then(|| verdict(workload, &row));
    row
}

/// The time of `other` by that of `own`: the median over the rounds.
fn ratio(other: &Samples, own: &Samples, turn: usize) -> f64 {
    let turns = other.times_ns.chunks(turn).zip(own.times_ns.chunks(turn));
    let mut ratios: Vec<f64> =
        turns.map(|(other, own)| percentile(other, 50) / percentile(own, 50)).collect();
    ratios.sort_by(f64::total_cmp);
    ratios[ratios.len() / 2]
}

/// The smallest time that so many percent of the times do not exceed.
fn percentile(times_ns: &[u64], percent: usize) -> f64 {
    let mut sorted = times_ns.to_vec();
    sorted.sort_unstable();
    let rank = (sorted.len() * percent).div_ceil(100).max(1);
    sorted[rank - 1] as f64
}

fn verdict(workload: &Workload, row: &Row) -> (String, bool) {
    let at_least = |share: Option<f64>, least: f64| share.is_some_and(|share| share >= least);
    let at_most = |value: Option<f64>, most: f64| value.is_some_and(|value| value <= most);
    let (goal, met) = match workload.goal {
        Goal::None => (String::new(), true),
        Goal::NoGiveUp => ("no give-up, ".to_owned(), row.give_ups == 0),
        Goal::PerJobNs(most) => (format!("<= {most} ns/job, "), at_most(row.per_job_ns, most)),
        Goal::MedianUs(most) => (format!("<= {most} us, "), row.median_ns <= most * 1000.0),
        Goal::P99Us(most) => (format!("p99 <= {most} us, "), row.p99_ns <= most * 1000.0),
        Goal::OfPlain(least) => (format!(">= {least} of plain, "), at_least(row.of_plain, least)),
        Goal::OverIdealAndCpu(time, cpu) => (
            format!("<= {time} of ideal at <= {cpu} cpu, "),
            at_least(row.of_ideal, 1.0 / time) && at_most(row.cpu_of_work, cpu),
        ),
    };
    (format!("{goal}0 heap"), met && row.heap_calls == 0.0)
}
