//! `overfly budget` and `overfly diff`, end to end over a small planet.
//!
//! In:    the built binary.
//! Out:   passes or fails.
//! Keeps: folders, thrown away.
//! Not here: statistics and verdicts (`overfly_replay::budget`).

use super::command_line::{Outcome, command, overfly};
use base64::prelude::{BASE64_STANDARD, Engine};
use overfly::config::read_budget;
use overfly::replay::budget::judge::{budget_names, known_names};
use overfly::replay::budget::record::{counters, times};
use quick_xml::Reader;
use quick_xml::events::Event;
use serde_json::Value;
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Stdio};

const TINY: [&str; 6] = ["--scene", "small", "--frames", "20..100", "--size", "320x180"];

/// `budget rainier` over eighty small frames.
fn budget(more: &[&str]) -> Outcome {
    overfly(&[&["budget", "rainier"], &TINY[..], more].concat())
}

fn path(folder: &Path, name: &str) -> String {
    folder.join(name).display().to_string()
}

fn json(file: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap()
}

#[test]
fn the_same_program_counts_the_same_to_the_last_byte_whatever_its_workers() {
    let folder = tempfile::tempdir().unwrap();
    let files = ["0", "1", "2", "4"].map(|workers| (path(folder.path(), workers), workers));
    for (file, workers) in &files {
        let done =
            budget(&["--counters-only", "--errors", "2", "--workers", workers, "--record", file]);
        assert_eq!(done.code, 0, "{done:?}");
    }
    let texts = files.each_ref().map(|(file, _)| std::fs::read_to_string(file).unwrap());
    for (text, (_, workers)) in texts.iter().zip(&files) {
        assert!(*text == texts[0], "the run with {workers} workers differs");
    }
    let [(a, _), (b, _), ..] = files;
    let run = json(&a);
    assert_eq!(run["format"], "overfly-budget-run-1");
    assert_eq!(run["counters"]["triangles"].as_array().unwrap().len(), 80);
    assert_eq!(run["errors"]["columns"]["e5"].as_array().unwrap().len(), 2);
    assert_eq!(run["times_ns"].as_array().unwrap().len(), 0);

    let held = budget(&["--counters-only", "--errors", "2", "--baseline", &a]);
    assert_eq!(held.code, 0, "{held:?}");
    let same = overfly(&["diff", &a, &b]);
    assert_eq!(same.code, 0, "{same:?}");
    assert!(same.out.contains("no count and no digest differs in 80 frames"), "{same:?}");
}

#[test]
fn decoded_bytes_are_those_of_the_pages_that_arrived_and_steady_frames_allocate_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (file, lines) = (path(folder.path(), "run.json"), path(folder.path(), "budget.ron"));
    let down = ["budget", "descent", "--scene", "small", "--frames", "0..400", "--errors", "0"];
    let budget = |more: &[&str]| overfly(&[&down[..], &["--counters-only"], more].concat());
    let done = budget(&["--record", &file]);
    assert_eq!(done.code, 0, "{done:?}");
    let run = json(&file);
    let column = |name: &str| -> Vec<f64> {
        let values = run["counters"][name].as_array().unwrap().iter();
        values.map(|value| value.as_f64().unwrap()).collect()
    };
    // A page without survey and imagery has 55360 bytes, and each that comes is taken or refused.
    let arrived = column("admitted").into_iter().zip(column("refused"));
    let bytes: Vec<f64> = arrived.map(|(taken, not)| (taken + not) * 55_360.0).collect();
    assert_eq!(column("decoded_bytes"), bytes);
    let total: f64 = bytes.iter().sum();
    assert!(total > 0.0, "no page came in these frames");
    let budget_of = |limit: f64| {
        let line = format!("Budget(lines: [(of: decoded_bytes, statistic: sum, limit: {limit})])");
        std::fs::write(&lines, line).unwrap();
        budget(&["--budget", &lines])
    };
    assert_eq!(budget_of(total).code, 0);
    let over = budget_of(total - 1.0);
    assert!(over.code == 1 && over.out.contains("decoded_bytes sum is"), "{over:?}");
    assert_eq!(column("allocations"), [0.0; 400]);
}

#[test]
fn a_doubled_triangle_count_fails_in_one_run_and_names_frame_and_place() {
    let folder = tempfile::tempdir().unwrap();
    let [base, more, scene] =
        ["base.json", "more.json", "more.ron"].map(|n| path(folder.path(), n));
    let few = ["--counters-only", "--errors", "0"];
    let settings = |triangles: u32| {
        format!(
            "Scene(body: Sphere(radius_m: 1000.0), lod: (tolerance_px: 0.01, triangles_max: \
             {triangles}, patch_depth: 2))"
        )
    };
    std::fs::write(&scene, settings(4000)).unwrap();
    let fly = |more: &[&str]| {
        let common = ["budget", "rainier", "--frames", "20..60", "--scene", &scene];
        overfly(&[&common[..], &few, more].concat())
    };
    let done = fly(&["--record", &base]);
    assert_eq!(done.code, 0, "{done:?}");
    std::fs::write(&scene, settings(8000)).unwrap();
    let failed = fly(&["--baseline", &base, "--record", &more]);
    assert_eq!(failed.code, 1, "{failed:?}");
    let line = failed.out.lines().find(|line| line.contains("triangles differs")).unwrap();
    for part in ["FAIL", "40 of 40 frames", "(+100.0 %)", "first in frame 20 at 4", "most in frame"]
    {
        assert!(line.contains(part), "{part} is not in {line}");
    }
    assert!(failed.out.contains("settings are not those of the baseline"), "{failed:?}");
    let limit = path(folder.path(), "limit.ron");
    std::fs::write(&limit, "Budget(lines: [(of: triangles, statistic: max, limit: 4100)])")
        .unwrap();
    let failed = fly(&["--budget", &limit]);
    assert_eq!(failed.code, 1, "{failed:?}");
    assert!(failed.out.contains("limit 4100; worst in frame "), "{failed:?}");
    let differs = overfly(&["diff", &base, &more]);
    assert_eq!(differs.code, 1, "{differs:?}");
    for part in ["first: frame 20 at ", "stage ", "result: changed", "work: changed", "triangles"] {
        assert!(differs.out.contains(part), "{part} is not in {differs:?}");
    }
}

/// Names of all elements and attributes of an XML text.
fn elements(text: &str) -> Vec<(String, Vec<String>)> {
    let mut reader = Reader::from_str(text);
    let mut found = Vec::new();
    let mut depth = 0_i32;
    loop {
        let event = reader.read_event().unwrap();
        let element = match &event {
            Event::Eof => break,
            Event::End(_) => {
                depth -= 1;
                continue;
            }
            Event::Start(element) => {
                depth += 1;
                element
            }
            Event::Empty(element) => element,
            _ => continue,
        };
        let attributes = element.attributes().map(|one| one.unwrap().key.as_ref().to_owned());
        found.push((element.name().as_ref().to_owned(), attributes.collect()));
    }
    assert_eq!(depth, 0, "elements are closed");
    found
}

#[test]
fn every_report_is_what_its_readers_take() {
    let folder = tempfile::tempdir().unwrap();
    let [out, lines] = ["out", "budget.ron"].map(|name| path(folder.path(), name));
    let init = budget(&["--init", "--budget", &lines, "--errors", "1", "--runs", "1"]);
    assert_eq!(init.code, 0, "{init:?}");
    let again = budget(&["--init", "--budget", &lines]);
    assert!(again.code == 2 && again.err.contains("is there already"), "{again:?}");
    // Limits that hold on any machine, and one that holds on none.
    let text = std::fs::read_to_string(&lines).unwrap();
    let counts =
        text.lines().filter(|line| !line.contains("\"frame\"") && !line.contains("\"lod."));
    let counts = counts.filter(|line| !line.contains("\"mesh.") && !line.contains("\"camera\""));
    let counts = counts.filter(|line| !line.contains("\"datasource."));
    let counts: Vec<&str> = counts.collect();
    let times = "(of: \"frame\", statistic: \"max\", limit: 1e9),
        (of: \"lod.refine\", statistic: \"share_over\", over: 0, limit: 0, severity: warn),\n    ],";
    std::fs::write(&lines, counts.join("\n").replace("    ],", times)).unwrap();
    let done = budget(&["--budget", &lines, "--out", &out, "--errors", "1", "--runs", "2"]);
    assert_eq!(done.code, 0, "{done:?}");
    assert!(done.out.contains("warn") && done.out.contains("rainier: pass"), "{done:?}");
    let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();

    let junit = elements(&read("junit.xml"));
    // What the schemas of Jenkins and of Ant's reports both allow.
    assert_eq!(junit[0], ("testsuites".into(), vec![]));
    let suite = ["id", "package", "name", "timestamp", "hostname", "tests", "failures", "errors"];
    assert_eq!(junit[1].1, [&suite[..], &["skipped", "time"]].concat());
    let names: Vec<&str> = junit[2..].iter().map(|(name, _)| name.as_str()).collect();
    let ends = [names[0], names[names.len() - 2], names[names.len() - 1]];
    assert_eq!(ends, ["properties", "system-out", "system-err"]);
    let within = |name: &&str| ["testcase", "failure", "skipped"].contains(name);
    assert!(names[1..names.len() - 2].iter().all(within), "{names:?}");
    let cases = junit.iter().filter(|(name, _)| name == "testcase").count();
    assert!(cases > 15, "{cases} test cases");

    let page = read("report.html");
    assert!(page.matches("<svg").count() >= 7, "{}", page.matches("<svg").count());
    for word in ["<script", "http", "href=", "@import", "url(", "NaN", ">inf"] {
        assert!(!page.contains(word), "the page has {word}");
    }
    let stills: Vec<&str> = page.split("src=\"data:image/jpeg;base64,").skip(1).collect();
    assert_eq!(stills.len(), page.matches("src=").count(), "everything is in the page");
    if super::pictures::device("every_report_is_what_its_readers_take") {
        assert!((2..=6).contains(&stills.len()), "{} stills", stills.len());
        let still = BASE64_STANDARD.decode(stills[0].split('"').next().unwrap()).unwrap();
        let still = image::load_from_memory(&still).unwrap();
        assert_eq!((still.width(), still.height()), (320, 180));
        let colours: BTreeSet<[u8; 3]> = still.to_rgb8().pixels().map(|pixel| pixel.0).collect();
        assert!(colours.len() > 500, "{} colours", colours.len());
    }
    let summary = read("summary.md");
    assert!(summary.len() < 1 << 20 && summary.contains("| warn | `lod.refine` |"), "{summary}");
    assert!(summary.starts_with("## overfly budget: rainier, pass\n\n| | of "), "{summary}");

    let trace = json(&path(folder.path(), "out/trace.json"));
    assert_overlaps_nowhere(trace["traceEvents"].as_array().unwrap());

    let run = json(&path(folder.path(), "out/run.json"));
    assert_eq!(run["times_ns"].as_array().unwrap().len(), 2);
    assert_eq!(run["cold_starts"].as_array().unwrap().len(), 2);
    assert!(run["times_ns"][1]["frame"].as_array().unwrap().iter().all(|ns| ns.as_u64() > Some(0)));
    let table = read("frames.csv");
    assert_eq!(table.lines().count(), 81);
    let head: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    assert!(head.contains(&"frame_ms_2") && head.contains(&"uploaded_bytes"), "{head:?}");
}

/// Spans of a track lie one after the other or one within the other, or viewers draw nonsense.
fn assert_overlaps_nowhere(events: &[Value]) {
    let mut spans: Vec<(u64, f64, f64)> = Vec::new();
    for event in events.iter().filter(|event| event["ph"] == "X") {
        let number = |name: &str| event[name].as_f64().unwrap();
        spans.push((event["tid"].as_u64().unwrap(), number("ts"), number("ts") + number("dur")));
    }
    assert!(spans.len() > 80 * 4, "{} spans", spans.len());
    // Longer ones first where two begin together.
    spans.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(b.2.total_cmp(&a.2)));
    let mut open: Vec<(u64, f64, f64)> = Vec::new();
    for span in spans {
        // Half a nanosecond: microseconds are written in decimals.
        open.retain(|outer| outer.0 == span.0 && outer.2 > span.1 + 5e-4);
        assert!(open.iter().all(|outer| span.2 <= outer.2 + 5e-4), "{span:?} overlaps {open:?}");
        open.push(span);
    }
}

#[test]
fn a_program_against_itself_is_never_slower_and_says_what_can_be_resolved() {
    let folder = tempfile::tempdir().unwrap();
    let out = path(folder.path(), "out");
    // Whatever the machine does meanwhile: a difference of less than half is of no interest.
    let done =
        budget(&["--calibrate", "--pairs", "3..3", "--runs", "1", "--effect", "50", "--out", &out]);
    assert_eq!(done.code, 0, "{done:?}");
    assert!(done.out.contains("this machine can resolve ±"), "{done:?}");
    assert!(done.out.contains("Both did the same work with the same results"), "{done:?}");
    let compared = json(&path(folder.path(), "out/comparison.json"));
    assert_eq!((&compared["pairs"], &compared["calibrates"]), (&3.into(), &true.into()));
    assert_eq!(compared["compared"][0]["of"], "frame");
    let none = budget(&["--against", "/no/such/overfly"]);
    assert!(none.code == 2 && none.err.contains("cannot run /no/such/overfly"), "{none:?}");
    let not = budget(&["--against", "/bin/false"]);
    assert!(not.code == 2 && not.err.contains("/bin/false ended with"), "{not:?}");
}

#[test]
fn bad_input_names_file_line_value_and_what_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let [odd, run, other] = ["odd.ron", "odd.json", "other.json"].map(|n| path(folder.path(), n));
    std::fs::write(&odd, "Budget(lines: [\n(of: trianglez, statistic: max, limit: 1),\n])")
        .unwrap();
    std::fs::write(&run, "{}").unwrap();
    let made = overfly(&[
        "budget", "poles", "--scene", "small", "--frames", "0..3", "--errors", "0", "--record",
        &other,
    ]);
    assert_eq!(made.code, 0, "{made:?}");
    for (arguments, part) in [
        (
            vec!["--budget", &odd],
            "odd.ron:2:6: lines[0].of: unknown variant trianglez, did you mean",
        ),
        (vec!["--budget", "no/such.ron"], "cannot read budget no/such.ron"),
        (vec!["--baseline", &run], "odd.json: is no run: missing field"),
        (vec!["--baseline", &other, "--errors", "0"], "the flight is rainier, there it is poles"),
        (vec![], "there is nothing to do: give one of --budget FILE"),
        (vec!["--out", &odd], "is there and is not a folder"),
        (vec!["--record", &run, "--baseline", &run], "is no run"),
        (vec!["--calibrate", "--pairs", "2..9"], "3 <= A <= B"),
        (vec!["--calibrate", "--effect", "0"], "is not a number from 0.1 to 100"),
    ] {
        let done = budget(&arguments);
        assert_eq!(done.code, 2, "{arguments:?}: {done:?}");
        assert!(done.err.contains(part), "{arguments:?}: {done:?}");
    }
    let beyond = overfly(&["budget", "rainier", "--frames", "0..99999", "--record", &run]);
    assert!(beyond.code == 2 && beyond.err.contains("0..36001"), "{beyond:?}");
    let diff = overfly(&["diff", &other, &odd]);
    assert!(diff.code == 2 && diff.err.contains("odd.ron: is no run"), "{diff:?}");
    let help = overfly(&["budget", "--help"]);
    for word in ["Exit codes", "Examples", "hitches_per_min", "--calibrate"] {
        assert!(help.out.contains(word), "{help:?}");
    }
}

#[test]
fn the_bundled_budget_has_a_row_for_every_counter_and_every_stage() {
    let names = known_names();
    let text = include_str!("../../replay/flights/budgets.ron");
    let budget = read_budget(text, "budgets.ron", &budget_names(&names)).unwrap();
    for name in counters().into_iter().chain(times()) {
        assert!(budget.lines.iter().any(|line| line.of == name), "{name} has no row");
    }
}

#[test]
fn ctrl_c_keeps_what_was_flown() {
    let folder = tempfile::tempdir().unwrap();
    let file = path(folder.path(), "run.json");
    let mut child = command()
        .args(["budget", "rainier", "--scene", "small", "--errors", "0", "--record", &file])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut out = BufReader::new(child.stdout.take().unwrap());
    let mut said = String::new();
    out.read_line(&mut said).unwrap();
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    out.read_to_string(&mut said).unwrap();
    let done = child.wait().unwrap();
    assert_eq!(done.code(), Some(130), "{said}");
    assert!(said.contains("Interrupted: ") && said.contains("were kept"), "{said}");
    let run = json(&file);
    assert_eq!(run["facts"]["interrupted"], true);
    let frames = run["time_s"].as_array().unwrap().len();
    assert_eq!(run["counters"]["triangles"].as_array().unwrap().len(), frames);
    assert!(frames < 36_001);
}

/// Two frames of the smallest planet: under valgrind each takes a second or so.
#[test]
fn instructions_are_counted_frame_by_frame_where_there_is_valgrind() {
    let folder = tempfile::tempdir().unwrap();
    let [run, lines] = ["run.json", "lines.ron"].map(|name| path(folder.path(), name));
    let line = |limit: f64| {
        format!("Budget(lines: [(of: \"instructions\", statistic: \"max\", limit: {limit})])")
    };
    std::fs::write(&lines, line(1e3)).unwrap();
    let common = ["budget", "rainier", "--scene", "small", "--frames", "20..22", "--errors", "0"];
    let common = [&common[..], &["--counters-only", "--budget", &lines]].concat();
    let unasked = overfly(&common);
    assert_eq!(unasked.code, 2, "{unasked:?}");
    assert!(unasked.err.contains("only --instructions N counts"), "{unasked:?}");

    let counting = [&common[..], &["--instructions", "9", "--record", &run]].concat();
    let without = command().args(&counting).env("PATH", folder.path()).output().unwrap();
    assert_eq!(without.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&without.stderr).contains("apt install valgrind"));
    if Command::new("valgrind").arg("--version").output().is_err() {
        println!("instructions: skipped: no valgrind");
        return;
    }
    let counted = overfly(&counting);
    assert_eq!(counted.code, 1, "a frame takes more than a thousand: {counted:?}");
    assert!(counted.out.contains("instructions max is"), "{counted:?}");
    let run = json(&run);
    let column = run["instructions"]["columns"]["instructions"].as_array().unwrap();
    assert_eq!(column.len(), 2, "no more frames are counted than there are");
    assert!(
        column.iter().all(|count| (1e4..1e10).contains(&count.as_f64().unwrap())),
        "{column:?}"
    );
}
