//! Two programs, or two scenes, in pairs of runs until it is known how they relate.
//!
//! In:    two ways of calling a program.
//! Out:   [`Versus`]: comparisons, what else differs.
//! Keeps: a folder for the runs' records while it lasts.
//! Not here: statistics (`overfly::replay::budget::pairs`).

use crate::cli::trade::plot::escaped;
use crate::cli::{Failure, INTERRUPTED};
use indicatif::{ProgressBar, ProgressStyle};
use overfly::replay::budget::pairs::{compare, goes_on};
use overfly::replay::budget::record::times;
use overfly::replay::budget::{
    Comparison, Interval, Outcome, PairCells, PairRule, Relation, RunRecord, diff,
};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};

/// One side: a program and what it is called with.
pub struct Side {
    pub label: String,
    pub program: PathBuf,
    pub arguments: Vec<String>,
}

/// What the pairs said.
pub struct Versus {
    pub labels: [String; 2],
    pub pairs: usize,
    pub rule: PairRule,
    pub compared: Vec<Comparison>,
    /// Whether both sides counted the same, in words.
    pub counted: String,
    /// Both sides are one program: this only says what the machine can resolve.
    pub calibrates: bool,
    pub interrupted: bool,
}

/// Runs pairs until all is decided, the limit is reached or it is stopped.
pub fn versus(
    sides: &[Side; 2],
    rule: PairRule,
    calibrates: bool,
    stop: &AtomicBool,
) -> Result<Versus, Failure> {
    let folder = Folder::create()?;
    let labels = [0, 1].map(|side: usize| sides[side].label.clone());
    let mut versus = Versus {
        labels,
        pairs: 0,
        rule,
        compared: Vec::new(),
        counted: String::new(),
        calibrates,
        interrupted: false,
    };
    let style = "{bar:30} {pos}/{len} pairs at most, {elapsed} gone, {msg}";
    let bar = ProgressBar::new(rule.most as u64)
        .with_style(ProgressStyle::with_template(style).expect("a fixed template"));
    let mut cells = Vec::new();
    let names = times();
    loop {
        let Some([a, b]) = pair(sides, (&rule, cells.len()), &folder.path, stop)? else {
            versus.interrupted = true;
            break;
        };
        if cells.is_empty() {
            versus.counted = counted(&a, &b);
        }
        let both = fastest(&a).zip(fastest(&b));
        let (a, b) = both.ok_or("a run was not timed")?;
        cells.push(PairCells::of(&a, &b));
        versus.pairs = cells.len();
        versus.compared = compare(&cells, &names, &rule);
        let frame = &versus.compared[0];
        bar.set_message(format!("frame {} {}", frame.relation.word(), frame.typical));
        bar.inc(1);
        // A calibration is to say what so many pairs resolve, so it runs them all.
        if !goes_on(&versus.compared, cells.len(), &rule)
            || (calibrates && cells.len() >= rule.least)
        {
            break;
        }
    }
    bar.finish_and_clear();
    Ok(versus)
}

/// One run of each side, in the order that the rule says; `None` when stopped.
fn pair(
    sides: &[Side; 2],
    (rule, pair): (&PairRule, usize),
    folder: &Path,
    stop: &AtomicBool,
) -> Result<Option<[RunRecord; 2]>, Failure> {
    let mut records = [None, None];
    let order = if rule.first_goes_first(pair) { [0, 1] } else { [1, 0] };
    for side in order {
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        records[side] = one_run(&sides[side], &folder.join(format!("{side}.json")))?;
        if records[side].is_none() {
            return Ok(None);
        }
    }
    let [Some(a), Some(b)] = records else { return Ok(None) };
    Ok(Some([a, b]))
}

/// A child's record; `None` if it was interrupted.
fn one_run(side: &Side, file: &Path) -> Result<Option<RunRecord>, Failure> {
    let mut command = Command::new(&side.program);
    command.args(&side.arguments).arg("--record").arg(file);
    let done = command.stdin(Stdio::null()).stdout(Stdio::null()).output();
    let named = side.program.display();
    let done = done.map_err(|error| format!("--against: cannot run {named}: {error}"))?;
    if done.status.code() == Some(i32::from(INTERRUPTED)) {
        return Ok(None);
    }
    if !done.status.success() {
        let said = String::from_utf8_lossy(&done.stderr);
        let line = said.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
        return Err(format!("{named} ended with {}: {line}", done.status).into());
    }
    Ok(Some(super::read_record(file)?))
}

/// Each frame's time in the run in which it was fastest: every run does the same work, and what
/// else the machine does only adds to it. A hitch of the program itself is in all runs, and stays.
fn fastest(record: &RunRecord) -> Option<BTreeMap<String, Vec<u64>>> {
    let (first, rest) = record.times_ns.split_first()?;
    let mut least = first.clone();
    for (name, column) in rest.iter().flatten() {
        let Some(least) = least.get_mut(name) else { continue };
        least.iter_mut().zip(column).for_each(|(least, ns)| *least = (*least).min(*ns));
    }
    Some(least)
}

/// Whether the first runs of both sides counted the same.
fn counted(a: &RunRecord, b: &RunRecord) -> String {
    let found = diff(a, b);
    let what = match (found.results.is_empty(), found.work.is_empty()) {
        _ if found.same() => return "Both did the same work with the same results.".into(),
        (false, _) => "Results differ",
        (true, false) => "Results are the same, the work is not",
        (true, true) => "The numbers of frames differ",
    };
    let first = found.first.map_or(String::new(), |frame| {
        format!(", first in {}, stage {}", b.place(frame), found.stage)
    });
    format!("{what}{first}; overfly diff has the details.")
}

impl Versus {
    /// Slower in anything is a failure; so long as the whole frame is not decided nobody knows.
    pub fn outcome(&self) -> Outcome {
        let is = |relation| self.compared.iter().any(|one| one.relation == relation);
        match self.compared.first() {
            _ if self.calibrates => Outcome::Pass,
            _ if is(Relation::Slower) => Outcome::Fail,
            Some(frame) if frame.relation != Relation::Inconclusive => Outcome::Pass,
            _ => Outcome::Inconclusive,
        }
    }

    /// The verdict in a sentence, about the whole frame; what of it is slower comes first.
    pub fn sentence(&self) -> String {
        let Some(frame) = self.compared.first() else { return "no pair was finished".into() };
        let (pairs, effect) = (self.pairs, self.rule.effect * 100.0);
        if self.calibrates {
            let half = frame.typical.resolves() * 100.0;
            let needed = (pairs as f64 * (half / effect) * (half / effect)).ceil().max(3.0);
            return format!(
                "this machine can resolve ±{half:.2} % of the typical frame in {pairs} pairs; \
                 ±{effect} % takes about {needed:.0}"
            );
        }
        let slower = self.compared[1..].iter().filter(|one| one.relation == Relation::Slower);
        let slower: Vec<String> =
            slower.map(|one| format!("{} by {}", one.name, one.typical)).collect();
        let (word, label) = (frame.relation.word(), &self.labels[1]);
        let of_frame = format!("{label} is {} in the typical frame, {pairs} pairs", frame.typical);
        match (slower.is_empty(), frame.relation) {
            (false, relation) if relation != Relation::Slower => {
                format!("SLOWER: {}; the whole frame: {word}: {of_frame}", slower.join(", "))
            }
            _ => format!("{word}: {of_frame}"),
        }
    }

    fn rows(&self) -> impl Iterator<Item = [String; 5]> {
        self.compared.iter().map(|one| {
            let relation = match self.calibrates {
                true => format!("±{:.2} %", one.typical.resolves() * 100.0),
                false => one.relation.word().to_owned(),
            };
            let mean = format!("{:.4}", one.mean_ms);
            [one.name.clone(), relation, one.typical.to_string(), one.tail.to_string(), mean]
        })
    }

    fn introduction(&self) -> String {
        let [a, b] = &self.labels;
        format!(
            "{}. A is {a}, B is {b}; in brackets 99 % intervals; what lies within ±{} % is of no \
             interest. {}",
            self.sentence(),
            self.rule.effect * 100.0,
            self.counted
        )
    }

    /// A table for terminals.
    pub fn text(&self) -> String {
        let mut out = format!("{}\n", self.introduction());
        let heads = ["", "verdict", "typical frame, B over A", "p99, B over A", "A, ms"];
        for [name, relation, typical, tail, mean] in
            std::iter::once(heads.map(str::to_owned)).chain(self.rows())
        {
            writeln!(out, "{name:<18}{relation:<14}{typical:<32}{tail:<32}{mean:>10}")
                .expect("a text grows");
        }
        out
    }

    /// A piece of a summary.
    pub fn markdown(&self) -> String {
        let mut out = format!(
            "{}\n\n| | verdict | typical frame, B over A | p99, B over A | A, ms |\n\
             |---|---|---|---|---:|\n",
            self.introduction().replace('|', "/")
        );
        for cells in self.rows() {
            writeln!(out, "| {} |", cells.join(" | ")).expect("a text grows");
        }
        out
    }

    /// A piece of a page.
    pub fn html(&self) -> String {
        let mut out = format!(
            "<h2>A against B</h2>\n<p>{}</p>\n<table><tr><th class=\"l\"></th><th class=\"l\">\
             verdict</th><th>typical frame, B over A</th><th>p99, B over A</th><th>A, ms</th>\
             </tr>\n",
            escaped(&self.introduction())
        );
        for [name, relation, typical, tail, mean] in self.rows() {
            writeln!(
                out,
                "<tr><td class=\"l\">{name}</td><td class=\"l\">{relation}</td><td>{typical}</td>\
                 <td>{tail}</td><td>{mean}</td></tr>"
            )
            .expect("a text grows");
        }
        out.push_str("</table>\n");
        out
    }

    /// One object, format `overfly-comparison-1`; bounds that are not known are null.
    pub fn json(&self) -> String {
        let interval =
            |of: &Interval| json!({"estimate": of.estimate, "low": of.low, "high": of.high});
        let one = |of: &Comparison| -> Value {
            json!({
                "of": of.name,
                "relation": of.relation.word(),
                "typical": interval(&of.typical),
                "p99": interval(&of.tail),
                "mean_ms": of.mean_ms,
            })
        };
        json!({
            "format": "overfly-comparison-1",
            "labels": self.labels,
            "pairs": self.pairs,
            "effect": self.rule.effect,
            "seed": self.rule.seed,
            "calibrates": self.calibrates,
            "interrupted": self.interrupted,
            "counted": self.counted,
            "compared": self.compared.iter().map(one).collect::<Vec<_>>(),
        })
        .to_string()
    }
}

/// A folder of this process, gone when it is dropped.
struct Folder {
    path: PathBuf,
}

impl Folder {
    fn create() -> Result<Self, Failure> {
        let path = std::env::temp_dir().join(format!("overfly-budget-{}", std::process::id()));
        std::fs::create_dir_all(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(Self { path })
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What cannot be removed stays in the system's folder for such things.
        let _ = std::fs::remove_dir_all(&self.path);
    }
}
