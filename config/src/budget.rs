//! Budget files: what a flight's frames may cost, line by line.
//!
//! In:    the text of a `budget.ron`, the names of what is counted and timed.
//! Out:   [`BudgetSettings`], or every fault of the file at once.
//! Keeps: nothing.
//! Not here: holding a run against a budget (`overfly_replay::budget`).

use crate::fault::SceneFaults;
use crate::fields::{Group, Reader, Shape};
use crate::node::{Kind, Node};
use crate::{FaultKind, tree};

const BUDGET: Shape = Shape { name: "Budget", fields: &["lines"] };
const LINE: Shape =
    Shape { name: "Line", fields: &["of", "statistic", "over", "limit", "severity"] };
/// More lines than this are a mistake.
const LINES_MAX: usize = 1000;
const NUMBERS: std::ops::RangeInclusive<f64> = 0.0..=1e18;
const SEVERITIES: [&str; 2] = ["fail", "warn"];

/// What a line takes of a column of frames.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Statistic {
    /// Sum over all frames.
    Sum,
    /// Arithmetic mean.
    Mean,
    /// Percentile by nearest rank, in tenths of a percent: 999 is p99.9.
    Percentile(u32),
    /// The largest.
    Max,
    /// Frames above `over`, as a share of all: 0 to 1.
    ShareOver,
    /// Most frames in a row above `over`.
    LongestRunOver,
    /// Frames above `over` in a minute of the flight.
    HitchesPerMinute,
    /// Frames that differ from the baseline's.
    Changed,
}

impl Statistic {
    /// Every statistic with its name, in the order in which help lists them.
    pub const ALL: [(&'static str, Self); 11] = [
        ("sum", Self::Sum),
        ("mean", Self::Mean),
        ("p50", Self::Percentile(500)),
        ("p95", Self::Percentile(950)),
        ("p99", Self::Percentile(990)),
        ("p99.9", Self::Percentile(999)),
        ("max", Self::Max),
        ("share_over", Self::ShareOver),
        ("longest_run_over", Self::LongestRunOver),
        ("hitches_per_min", Self::HitchesPerMinute),
        ("changed", Self::Changed),
    ];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        let found = Self::ALL.into_iter().find(|(_, known)| *known == self);
        found.map_or("percentile", |(name, _)| name)
    }

    /// Whether it counts frames above a number of its own.
    pub fn needs_over(self) -> bool {
        matches!(self, Self::ShareOver | Self::LongestRunOver | Self::HitchesPerMinute)
    }
}

/// What becomes of a line that does not hold.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Severity {
    /// The budget is broken.
    Fail,
    /// It is said, and changes nothing.
    Warn,
}

/// One line of a budget.
#[derive(Clone, PartialEq, Debug)]
pub struct BudgetLine {
    /// A counter, a stage, a metric or a digest.
    pub of: &'static str,
    /// What is taken of its frames.
    pub statistic: Statistic,
    /// Where a frame begins to count, for statistics that need it; milliseconds for times.
    pub over: Option<f64>,
    /// The statistic may be as large as this; milliseconds for times.
    pub limit: f64,
    /// What becomes of it otherwise.
    pub severity: Severity,
}

/// All lines of a budget file.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct BudgetSettings {
    /// In the order of the file.
    pub lines: Vec<BudgetLine>,
}

/// What a budget may name.
#[derive(Clone, Copy, Debug)]
pub struct BudgetNames<'n> {
    /// Columns of numbers that are the same in every run.
    pub counters: &'n [&'static str],
    /// Columns of times.
    pub times: &'n [&'static str],
    /// Columns that can only be the same or not.
    pub digests: &'n [&'static str],
}

impl BudgetNames<'_> {
    fn all(&self) -> Vec<&'static str> {
        [self.counters, self.times, self.digests].concat()
    }

    /// The statistics of what `of` names.
    fn statistics(&self, of: &str) -> Vec<&'static str> {
        let changed = Statistic::Changed.name();
        let all = Statistic::ALL.map(|(name, _)| name).into_iter();
        if self.digests.contains(&of) {
            vec![changed]
        } else if self.times.contains(&of) {
            all.filter(|name| *name != changed).collect()
        } else {
            all.collect()
        }
    }
}

/// The lines of a budget file's text. `file` is only for the faults to name.
///
/// # Errors
/// Every unknown name, statistic and field, wrong type and value out of range, all at once.
pub fn read_budget(
    text: &str,
    file: &str,
    names: &BudgetNames,
) -> Result<BudgetSettings, SceneFaults> {
    let (root, syntax) = tree::parse(text);
    let mut reader = Reader::new(text);
    for fault in syntax {
        reader.fault(fault.at, "", FaultKind::Syntax { what: fault.what });
    }
    let settings = root.as_ref().and_then(|root| budget(&mut reader, root, names));
    let faults = reader.into_faults();
    match settings {
        Some(settings) if faults.is_empty() => Ok(settings),
        _ => Err(SceneFaults { file: file.to_owned(), faults }),
    }
}

fn budget<'t>(
    reader: &mut Reader<'t>,
    root: &'t Node,
    names: &BudgetNames,
) -> Option<BudgetSettings> {
    let group = reader.group(root, "", &BUDGET)?;
    let expected = "a list of lines, as in [(of: \"triangles\", statistic: \"p99\", limit: 1e5)]";
    if group.get("lines").is_none() {
        reader.missing(&group, "lines", expected);
    }
    let nodes = reader.list(&group, "lines", expected).unwrap_or_default();
    reader.counted(&group, "lines", nodes.len(), [1, LINES_MAX]);
    let numbered = nodes.iter().enumerate();
    let lines = numbered.filter_map(|(i, node)| line(reader, node, &format!("lines[{i}]"), names));
    Some(BudgetSettings { lines: lines.collect() })
}

fn line<'t>(
    reader: &mut Reader<'t>,
    node: &'t Node,
    path: &str,
    names: &BudgetNames,
) -> Option<BudgetLine> {
    let group = &reader.group(node, path, &LINE)?;
    let of = name(reader, group, "of", names.all());
    let known = of.map_or(Statistic::ALL.map(|(name, _)| name).into(), |of| names.statistics(of));
    let statistic = name(reader, group, "statistic", known);
    let statistic = statistic.and_then(|name| {
        Statistic::ALL.into_iter().find(|(known, _)| *known == name).map(|(_, it)| it)
    });
    let over = statistic.and_then(|statistic| over(reader, group, statistic));
    let limit = reader.required_number(group, "limit", NUMBERS);
    let severity = match group.get("severity") {
        None => Some(SEVERITIES[0]),
        Some(_) => name(reader, group, "severity", SEVERITIES.into()),
    };
    let severity =
        severity.map(|name| if name == "warn" { Severity::Warn } else { Severity::Fail });
    Some(BudgetLine {
        of: of?,
        statistic: statistic?,
        over: over?,
        limit: limit?,
        severity: severity?,
    })
}

/// The number above which frames count: where it is needed, and nowhere else.
fn over(reader: &mut Reader, group: &Group, statistic: Statistic) -> Option<Option<f64>> {
    if statistic.needs_over() {
        return reader.required_number(group, "over", NUMBERS).map(Some);
    }
    let Some(node) = group.get("over") else { return Some(None) };
    let counting = Statistic::ALL.into_iter().filter(|(_, it)| it.needs_over());
    let counting: Vec<&str> = counting.map(|(name, _)| name).collect();
    let allowed = format!("only with {}", counting.join(", "));
    reader.out_of_range(node, &group.path_of("over"), allowed);
    None
}

/// One of some names, with or without quotes: `p99.9` and `lod.refine` cannot do without.
fn name(
    reader: &mut Reader,
    group: &Group,
    field: &str,
    known: Vec<&'static str>,
) -> Option<&'static str> {
    let path = group.path_of(field);
    let Some(node) = group.get(field) else {
        reader.missing(group, field, &format!("one of {}", known.join(", ")));
        return None;
    };
    let (Kind::Word(name) | Kind::Text(name)) = &node.kind else {
        reader.wrong_type(node, &path, &format!("one of {}", known.join(", ")));
        return None;
    };
    let found = known.iter().find(|known| *known == name).copied();
    if found.is_none() {
        reader.fault(node.at, path, FaultKind::UnknownVariant { name: name.clone(), known });
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: BudgetNames<'static> = BudgetNames {
        counters: &["triangles", "splits"],
        times: &["frame", "lod.refine"],
        digests: &["digest.mesh"],
    };

    #[test]
    fn lines_are_read_with_and_without_quotes() {
        let text = "Budget(lines: [
            (of: triangles, statistic: max, limit: 100000),
            (of: \"lod.refine\", statistic: \"p99.9\", limit: 2.5, severity: warn),
            (of: \"frame\", statistic: \"share_over\", over: 16.6, limit: 0.01),
            (of: \"digest.mesh\", statistic: \"changed\", limit: 0),
        ])";
        let lines = read_budget(text, "b.ron", &NAMES).unwrap().lines;
        assert_eq!(lines.len(), 4);
        assert_eq!((lines[0].of, lines[0].statistic), ("triangles", Statistic::Max));
        assert_eq!(lines[1].statistic, Statistic::Percentile(999));
        assert_eq!((lines[1].severity, lines[0].severity), (Severity::Warn, Severity::Fail));
        assert_eq!((lines[2].over, lines[2].limit), (Some(16.6), 0.01));
        assert_eq!(lines[3].statistic.name(), "changed");
    }

    #[test]
    fn faults_name_file_line_value_and_what_is_allowed_all_at_once() {
        let text = "Budget(lines: [
(of: \"trianglez\", statistic: \"max\", limit: 1),
(of: \"frame\", statistic: \"p98\", limit: 1, severty: fail),
(of: \"frame\", statistic: \"changed\", limit: 1),
(of: \"splits\", statistic: \"max\", limit: -1),
(of: \"splits\", statistic: \"max\", over: 3, limit: 1),
(of: \"splits\", statistic: \"share_over\", limit: 1),
(of: \"digest.mesh\", statistic: \"max\", limit: 0, severity: fatal),
(statistic: \"max\", limit: \"x\"),
])";
        let faults = read_budget(text, "my.ron", &NAMES).unwrap_err().to_string();
        for part in [
            "my.ron:2:6: lines[0].of: unknown variant trianglez, did you mean triangles?",
            "my.ron:3:26: lines[1].statistic: unknown variant p98, did you mean p9",
            "lines[1].severty: unknown field severty, did you mean severity?",
            "my.ron:4:26: lines[2].statistic: unknown variant changed, known here: sum, mean, p50",
            "lines[3].limit: is -1, allowed is 0 to 1000000000000000000",
            "lines[4].over: is 3, allowed is only with share_over, longest_run_over, hitches_per",
            "lines[5].over: is missing, expected is a number",
            "lines[6].statistic: unknown variant max, known here: changed",
            "lines[6].severity: unknown variant fatal, ",
            "lines[7].of: is missing, expected is one of triangles, splits, frame",
            "lines[7].limit: is the text \"x\", expected is a number",
        ] {
            assert!(faults.contains(part), "{part} is not in:\n{faults}");
        }
        let empty = read_budget("Budget(lines: [])", "b.ron", &NAMES).unwrap_err().to_string();
        assert!(empty.contains("is a list of 0, allowed is a list of 1 to 1000"), "{empty}");
        assert!(read_budget("Budget(line: [])", "b.ron", &NAMES).is_err());
    }
}
