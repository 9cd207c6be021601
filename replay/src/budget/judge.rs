//! A run against the lines of a budget, and against a baseline.
//!
//! In:    a record, the budget's lines, the baseline's record.
//! Out:   [`Verdict`]s in a fixed order, and the [`Outcome`] of all.
//! Keeps: nothing.
//! Not here: reports and exit codes (the host), two programs in pairs (`pairs`).
//!
//! Counts are the same in every run, so one run decides. Times are not: a line of times holds where
//! it holds in every run, is broken where it is broken in every run, and else nobody knows.

use super::change::{Change, number};
use super::record::{DIGESTS, ERRORS, Facts, INSTRUCTIONS, RunRecord, counters, times};
use super::statistic::{Taken, take};
use overfly_config::{BudgetLine, BudgetNames, BudgetSettings, Severity, Statistic};

/// How a line came out.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Status {
    /// It holds.
    Pass,
    /// It was not judged, since what it needs was not asked for.
    Skipped,
    /// It does not hold, and that is only said.
    Warn,
    /// The machine was not quiet enough to tell.
    Inconclusive,
    /// It does not hold.
    Fail,
}

impl Status {
    /// In one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Skipped => "skipped",
            Self::Warn => "warn",
            Self::Inconclusive => "inconclusive",
            Self::Fail => "FAIL",
        }
    }
}

/// How a run came out.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Outcome {
    /// Every line holds or only warns.
    Pass,
    /// A line does not hold.
    Fail,
    /// No line is broken for sure, and of one nobody knows.
    Inconclusive,
}

/// One line of a budget or of a baseline, judged.
#[derive(Clone, PartialEq, Debug)]
pub struct Verdict {
    /// Counter, stage, metric or digest.
    pub of: String,
    /// What was taken of it.
    pub statistic: String,
    /// What it may be.
    pub limit: f64,
    /// What it is, in each run for times, else once. Empty where it was not judged.
    pub values: Vec<f64>,
    /// How that came out.
    pub status: Status,
    /// Why, naming frame and place of the worst.
    pub sentence: String,
    /// The worst frame, counted from the first of the columns.
    pub worst: Option<usize>,
}

/// What a budget may name, for reading its file: errors count as counters.
pub fn known_names() -> [Vec<&'static str>; 3] {
    let mut counted = counters();
    counted.extend(ERRORS);
    counted.push(INSTRUCTIONS);
    [counted, times(), DIGESTS.into()]
}

/// The names as the reader of budget files takes them.
pub fn budget_names<'n>(names: &'n [Vec<&'static str>; 3]) -> BudgetNames<'n> {
    let [counters, times, digests] = names;
    BudgetNames { counters, times, digests }
}

/// Judges a record. A baseline's counters, errors and digests must all be the same to the last bit,
/// but for those of which a line says how many frames may have `changed`, and for [`unshared`] ones.
pub fn judge(
    record: &RunRecord,
    budget: &BudgetSettings,
    baseline: Option<&RunRecord>,
) -> Vec<Verdict> {
    let mut verdicts: Vec<Verdict> = repeats(record).into_iter().collect();
    for line in &budget.lines {
        verdicts.push(match line.statistic {
            Statistic::Changed => changed(record, line, baseline),
            _ if times().contains(&line.of) => timed(record, line),
            _ => counted(record, line),
        });
    }
    let Some(base) = baseline else { return verdicts };
    let own = |of: &str| {
        let mut lines = budget.lines.iter();
        lines.any(|line| line.of == of && line.statistic == Statistic::Changed)
    };
    let unshared = unshared([record, base]);
    let [counted, _, digests] = known_names();
    // Another compiler gives other instructions for the same work.
    let counted = counted.into_iter().filter(|of| *of != INSTRUCTIONS);
    for of in digests.into_iter().chain(counted).filter(|of| !own(of)) {
        let (statistic, severity) = (Statistic::Changed, Severity::Fail);
        let line = BudgetLine { of, statistic, over: None, limit: 0.0, severity };
        // Errors are sampled where that was asked for: what only one of both has, is not compared.
        let is_shared = !ERRORS.contains(&of) || record.errors.frames == base.errors.frames;
        if is_shared && !unshared.iter().any(|name| name == of) {
            verdicts.push(changed(record, &line, Some(base)));
        }
    }
    verdicts
}

/// Counters that only one of two records has: the other is of a program that did not yet, or no
/// longer, count them.
pub fn unshared(records: [&RunRecord; 2]) -> Vec<String> {
    let [a, b] = records.map(|record| &record.counters);
    let of_a = a.keys().filter(|name| !b.contains_key(*name));
    of_a.chain(b.keys().filter(|name| !a.contains_key(*name))).cloned().collect()
}

/// All verdicts together.
pub fn outcome(verdicts: &[Verdict]) -> Outcome {
    match verdicts.iter().map(|verdict| verdict.status).max() {
        Some(Status::Fail) => Outcome::Fail,
        Some(Status::Inconclusive) => Outcome::Inconclusive,
        _ => Outcome::Pass,
    }
}

/// What keeps a record from being held against a baseline; nothing where both flew the same.
pub fn incomparable(now: &Facts, base: &Facts) -> Vec<String> {
    let facts = |facts: &Facts| {
        let Facts { flight, size_px, loader_delay_ms, rate_hz, first_frame, .. } = facts;
        [
            ("the flight", flight.clone()),
            ("the first frame", first_frame.to_string()),
            ("the rate", format!("{rate_hz} Hz")),
            ("the size", format!("{}x{}", size_px[0], size_px[1])),
            ("the loader's delay", format!("{loader_delay_ms} ms")),
        ]
    };
    let pairs = facts(now).into_iter().zip(facts(base));
    let differing = pairs.filter(|((_, now), (_, base))| now != base);
    differing
        .map(|((what, now), (_, base))| format!("{what} is {now}, there it is {base}"))
        .collect()
}

/// That every run counted the same, where there were several or something was odd.
fn repeats(record: &RunRecord) -> Option<Verdict> {
    let runs = record.cold_starts.len();
    let (status, sentence, worst) = match &record.odd {
        None if runs < 2 => return None,
        None => (Status::Pass, format!("{runs} runs counted the same, frame by frame"), None),
        Some(odd) => {
            let (frame, run) = (odd.frame as usize, odd.run + 1);
            let place = record.place(frame);
            let sentence = format!("{} of run {run} is not that of run 1 in {place}", odd.name);
            (Status::Fail, sentence, Some(frame))
        }
    };
    let (of, statistic) = ("all counters and digests".into(), "repeats".into());
    Some(Verdict { of, statistic, limit: 0.0, values: Vec::new(), status, sentence, worst })
}

fn broken(severity: Severity) -> Status {
    match severity {
        Severity::Fail => Status::Fail,
        Severity::Warn => Status::Warn,
    }
}

/// A verdict without a sentence.
fn verdict(line: &BudgetLine, values: Vec<f64>, status: Status) -> Verdict {
    let statistic = match line.over {
        Some(over) => format!("{} {}", line.statistic.name(), number(over)),
        None => line.statistic.name().to_owned(),
    };
    let (of, limit) = (line.of.to_owned(), line.limit);
    Verdict { of, statistic, limit, values, status, sentence: String::new(), worst: None }
}

fn skipped(line: &BudgetLine, why: &str) -> Verdict {
    let mut verdict = verdict(line, Vec::new(), Status::Skipped);
    verdict.sentence = format!("{} {}: {why}", line.of, line.statistic.name());
    verdict
}

/// A line of counts or of errors.
fn counted(record: &RunRecord, line: &BudgetLine) -> Verdict {
    let over = line.over.unwrap_or(0.0);
    let sampled = record.sampled(line.of);
    let from = sampled.map_or(&record.counters, |sampled| &sampled.columns);
    let column = from.get(line.of).map_or(&[][..], Vec::as_slice);
    let Some(taken) = take(line.statistic, over, column, record.facts.rate_hz) else {
        return skipped(line, "no frame was measured");
    };
    let frame = sampled.and_then(|sampled| sampled.frames.get(taken.worst));
    let frame = frame.map_or(taken.worst, |&frame| frame as usize);
    let holds = taken.value <= line.limit;
    let status = if holds { Status::Pass } else { broken(line.severity) };
    let mut verdict = verdict(line, vec![taken.value], status);
    verdict.sentence = sentence(record, line, (&[taken.value], ""), frame, column[taken.worst]);
    verdict.worst = Some(frame);
    verdict
}

/// A line of times: every run must hold it, or break it.
fn timed(record: &RunRecord, line: &BudgetLine) -> Verdict {
    let (over, rate_hz) = (line.over.unwrap_or(0.0), record.facts.rate_hz);
    let columns = record.times_ms(line.of);
    let of = |column: &Vec<f64>| take(line.statistic, over, column, rate_hz);
    let taken: Vec<Taken> = columns.iter().filter_map(of).collect();
    if taken.is_empty() {
        return skipped(line, "nothing was timed");
    }
    let values: Vec<f64> = taken.iter().map(|taken| taken.value).collect();
    let held = values.iter().filter(|&&value| value <= line.limit).count();
    let status = match held {
        held if held == values.len() => Status::Pass,
        0 => broken(line.severity),
        _ if line.severity == Severity::Warn => Status::Warn,
        _ => Status::Inconclusive,
    };
    let largest = (0..taken.len()).max_by(|&a, &b| values[a].total_cmp(&values[b]));
    let run = largest.expect("there is a run");
    let frame = taken[run].worst;
    let unit = match line.statistic {
        Statistic::ShareOver | Statistic::LongestRunOver | Statistic::HitchesPerMinute => "",
        _ => " ms",
    };
    let mut verdict = verdict(line, values, status);
    let worst_ms = columns[run][frame];
    verdict.sentence = sentence(record, line, (&verdict.values, unit), frame, worst_ms);
    verdict.worst = Some(frame);
    verdict
}

fn sentence(
    record: &RunRecord,
    line: &BudgetLine,
    (values, unit): (&[f64], &str),
    frame: usize,
    there: f64,
) -> String {
    let values: Vec<String> = values.iter().map(|&value| number(value)).collect();
    let over = line.over.map_or(String::new(), |over| format!(" {}", number(over)));
    format!(
        "{} {}{over} is {}{unit}, limit {}{unit}; worst in {}: {}",
        line.of,
        line.statistic.name(),
        values.join(", "),
        number(line.limit),
        record.place(frame),
        number(there)
    )
}

/// A line of frames that may differ from the baseline's.
fn changed(record: &RunRecord, line: &BudgetLine, baseline: Option<&RunRecord>) -> Verdict {
    let Some(base) = baseline else { return skipped(line, "there is no baseline") };
    if unshared([record, base]).iter().any(|name| name == line.of) {
        return skipped(line, "the baseline does not have it");
    }
    let change = change(line.of, [base, record]);
    let missing = record.frames().abs_diff(base.frames());
    let frames = change.as_ref().map_or(0, |change| change.frames) + missing;
    let holds = frames as f64 <= line.limit;
    let status = if holds { Status::Pass } else { broken(line.severity) };
    let mut verdict = verdict(line, vec![frames as f64], status);
    verdict.worst = change.as_ref().map(|change| change.most);
    verdict.sentence = match &change {
        Some(change) => change.sentence(record, record.frames()),
        None if missing > 0 => {
            format!("{} frames, the baseline has {}", record.frames(), base.frames())
        }
        None => format!("{} is the same in all {} frames", line.of, record.frames()),
    };
    verdict
}

/// How a counter, error or digest changed; its frames are those of the columns.
pub fn change(of: &str, records: [&RunRecord; 2]) -> Option<Change> {
    if let [Some(a), Some(b)] = records.map(|record| record.digests.get(of)) {
        return Change::of_digests(of, [a, b]);
    }
    if let [Some(a), Some(b)] = records.map(|record| record.counters.get(of)) {
        return Change::of_counts(of, [a, b]);
    }
    let [Some(a), Some(b)] = records.map(|record| record.sampled(of)?.columns.get(of)) else {
        return None;
    };
    let mut change = Change::of_counts(of, [a, b])?;
    let frames = &records[1].sampled(of)?.frames;
    change.first = frames[change.first] as usize;
    change.most = frames[change.most] as usize;
    Some(change)
}
