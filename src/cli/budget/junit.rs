//! Verdicts as JUnit XML, which every CI reads: one test case a line.
//!
//! In:    verdicts, comparisons.
//! Out:   XML.
//! Keeps: nothing.
//! Not here: what a verdict is (`overfly::replay::budget`).
//!
//! What nobody knows is `skipped` with its reason: JUnit has no third answer. Warnings pass; what
//! they and all other lines have to say stands in the suite's `system-out`. There are two schemas,
//! Jenkins' and that of Ant's reports: the file is meant for both, so the root has no attributes,
//! the suite has all, and a case holds what went wrong or nothing.

use super::reports::Report;
use overfly::replay::budget::{Relation, Status};
use std::fmt::Write;

/// One test case.
struct Case {
    class: &'static str,
    name: String,
    status: Status,
    sentence: String,
}

fn cases(report: &Report) -> Vec<Case> {
    let of_line = |verdict: &overfly::replay::budget::Verdict| Case {
        class: "budget",
        name: format!("{} {}", verdict.of, verdict.statistic),
        status: verdict.status,
        sentence: verdict.sentence.clone(),
    };
    let mut cases: Vec<Case> = report.verdicts.iter().map(of_line).collect();
    let compared = report.versus.map_or(&[][..], |versus| &versus.compared);
    cases.extend(compared.iter().map(|one| Case {
        class: "comparison",
        name: format!("{} typical", one.name),
        status: match one.relation {
            Relation::Slower => Status::Fail,
            Relation::Inconclusive => Status::Inconclusive,
            Relation::TooShort => Status::Skipped,
            Relation::Same | Relation::Faster => Status::Pass,
        },
        sentence: format!("{} {}: {}", one.name, one.relation.word(), one.typical),
    }));
    cases
}

/// The file's text.
pub fn text(report: &Report) -> String {
    let cases = cases(report);
    let count = |status| cases.iter().filter(|case| case.status == status).count();
    let (failed, skipped) =
        (count(Status::Fail), count(Status::Skipped) + count(Status::Inconclusive));
    let (all, name) = (cases.len(), escaped(&format!("overfly budget {}", report.flight)));
    let mut out = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n\
         <testsuite id=\"0\" package=\"overfly\" name=\"{name}\" timestamp=\"{}\" \
         hostname=\"localhost\" tests=\"{all}\" failures=\"{failed}\" errors=\"0\" \
         skipped=\"{skipped}\" time=\"0\">\n<properties/>\n",
        timestamp()
    );
    let mut said = String::new();
    for Case { class, name, status, sentence } in &cases {
        let (name, sentence) = (escaped(name), escaped(sentence));
        let inside = match status {
            Status::Fail => {
                format!("<failure type=\"budget\" message=\"{sentence}\">{sentence}</failure>")
            }
            Status::Inconclusive => format!("<skipped message=\"inconclusive: {sentence}\"/>"),
            Status::Skipped => format!("<skipped message=\"{sentence}\"/>"),
            Status::Warn | Status::Pass => String::new(),
        };
        writeln!(said, "{}: {sentence}", status.word()).expect("a text grows");
        writeln!(
            out,
            "<testcase classname=\"{class}\" name=\"{name}\" time=\"0\">{inside}</testcase>"
        )
        .expect("a text grows");
    }
    write!(out, "<system-out>{said}</system-out>\n<system-err/>\n</testsuite>\n</testsuites>\n")
        .expect("a text grows");
    out
}

/// Now, to the second, in UTC; the schemas want no zone.
fn timestamp() -> String {
    let now = humantime::format_rfc3339_seconds(std::time::SystemTime::now()).to_string();
    now.trim_end_matches('Z').to_owned()
}

/// Text as XML 1.0 takes it in attributes and elements; characters that it cannot have at all, as
/// those of terminals, become spaces.
fn escaped(text: &str) -> String {
    let clean =
        |c: char| if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') { ' ' } else { c };
    let clean: String = text.chars().map(clean).collect();
    crate::cli::trade::plot::escaped(&clean).replace('\'', "&apos;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_xml_cannot_have_is_escaped_or_left_out() {
        assert_eq!(
            escaped("a<b & \"c\" 'd'\u{1b}[0m\n"),
            "a&lt;b &amp; &quot;c&quot; &apos;d&apos; [0m "
        );
    }
}
