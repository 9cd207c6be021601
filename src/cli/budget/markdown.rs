//! Verdicts as Markdown for the summary of a CI job.
//!
//! In:    verdicts, comparisons.
//! Out:   Markdown of at most 900 KiB: services refuse summaries of a mebibyte.
//! Keeps: nothing.
//! Not here: what a verdict is (`overfly::replay::budget`).

use super::reports::{Report, word};
use overfly::replay::budget::change::number;
use overfly::replay::budget::{Status, Verdict};
use std::fmt::Write;

/// Where the text is cut off.
const BYTES_MAX: usize = 900 * 1024;

/// The file's text.
pub fn text(report: &Report) -> String {
    let mut out =
        format!("## overfly budget: {}, {}\n\n", cell(report.flight), word(report.outcome));
    for note in report.notes {
        writeln!(out, "{}\n", cell(note)).expect("a text grows");
    }
    if let Some(versus) = report.versus {
        out.push_str(&versus.markdown());
        out.push('\n');
    }
    if report.verdicts.is_empty() {
        return out;
    }
    out.push_str("| | of | statistic | value | limit | what |\n|---|---|---|---:|---:|---|\n");
    let mut ordered: Vec<&Verdict> = report.verdicts.iter().collect();
    ordered.sort_by_key(|verdict| std::cmp::Reverse(verdict.status));
    let all = ordered.len();
    for (at, verdict) in ordered.into_iter().enumerate() {
        let row = row(verdict);
        if out.len() + row.len() > BYTES_MAX {
            writeln!(out, "\n{} lines more are in the other reports.", all - at).expect("grows");
            break;
        }
        out.push_str(&row);
    }
    out
}

fn row(verdict: &Verdict) -> String {
    let values: Vec<String> = verdict.values.iter().map(|&value| number(value)).collect();
    // What holds needs no sentence.
    let what = if verdict.status == Status::Pass { "" } else { &verdict.sentence };
    format!(
        "| {} | `{}` | {} | {} | {} | {} |\n",
        verdict.status.word(),
        verdict.of,
        verdict.statistic,
        values.join(", "),
        number(verdict.limit),
        cell(what)
    )
}

/// Text that can neither end a cell nor become a tag.
fn cell(text: &str) -> String {
    text.replace('|', "/").replace('<', "&lt;").replace(['\n', '\r'], " ")
}
