//! `overfly trade` and `overfly recommend`, end to end over a small planet.
//!
//! In:    the built binary.
//! Out:   passes or fails.
//! Keeps: a folder, thrown away.
//! Not here: points, fronts, slopes and choices (`overfly_replay::trade`).

use super::command_line::{Outcome, overfly};
use serde_json::Value;
use std::path::Path;

const TINY: [&str; 12] = [
    "--scene",
    "small",
    "--frames",
    "0..8",
    "--every",
    "8",
    "--clip",
    "8",
    "--size",
    "96x54",
    "--repeats",
    "1",
];

/// `trade` or `recommend` over eight small frames.
fn run(command: &str, folder: &Path, more: &[&str]) -> Outcome {
    let out = folder.display().to_string();
    let few = ["--rays", "1000", "--cell-px", "8", "--out", &out];
    overfly(&[&[command, "rainier"], &TINY[..], &few, more].concat())
}

fn sweep(folder: &Path, text: &str) -> String {
    let file = folder.join("sweep.ron");
    std::fs::write(&file, text).unwrap();
    file.display().to_string()
}

/// What must be the same in every run: all but times.
fn timeless(folder: &Path) -> Value {
    let text = std::fs::read_to_string(folder.join("trade.json")).unwrap();
    let mut value: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(value["format"], "overfly-trade-1");
    for point in value["points"].as_array_mut().unwrap() {
        let times = point.as_object_mut().unwrap().remove("times").unwrap();
        assert!(times["stages_ms"]["frame"]["p50"].as_f64().unwrap() > 0.0, "{times}");
    }
    value
}

#[test]
fn a_trade_repeats_but_for_times_goes_on_where_it_was_and_advises() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
    let few = sweep(folder.path(), "Sweep(triangles_max: [2000])");
    for place in [&a, &b] {
        let done = run("trade", place, &["--sweep", &few]);
        assert!(done.code == 0 && done.out.contains("0 results were kept"), "{done:?}");
    }
    assert_eq!(timeless(&a), timeless(&b), "two runs differ in more than times");
    let points = timeless(&a)["points"].as_array().unwrap().clone();
    assert_eq!(points.len(), 2);
    assert_eq!(points[1]["name"], "triangles_max 2000");
    let error_px = |at: usize| points[at]["metrics"]["e1_p999_px"].as_f64().unwrap();
    assert!(error_px(1) > error_px(0));

    let page = std::fs::read_to_string(a.join("trade.html")).unwrap();
    assert!(page.contains("<svg") && !page.contains("<script") && !page.contains("http"));
    let table = std::fs::read_to_string(a.join("trade.csv")).unwrap();
    assert_eq!(table.lines().count(), 3);

    // One clip and one pass a point: of two known points four results, of a new one two.
    let other = sweep(folder.path(), "Sweep(triangles_max: [4000, 2000])");
    let more = run("trade", &a, &["--sweep", &other]);
    assert!(more.out.contains("4 results were kept from before, 2 are new"), "{more:?}");

    let scene = folder.path().join("chosen.ron").display().to_string();
    let advised = run("recommend", &a, &["--error-px", "1e6", "-o", &scene]);
    assert!(advised.code == 0 && advised.out.contains("the promise is kept"), "{advised:?}");
    let text = std::fs::read_to_string(&scene).unwrap();
    assert!(text.starts_with("// Recommended by overfly"), "{text}");
    assert_eq!(overfly(&["check", &scene]).code, 0);
    let impossible = run("recommend", &a, &["--budget-ms", "1e-7", "--verify", "off"]);
    assert_eq!(impossible.code, 1, "{impossible:?}");
    assert!(impossible.err.contains("the nearest is"), "{impossible:?}");
}

#[test]
fn faults_of_sweeps_and_goals_name_field_value_and_range() {
    let folder = tempfile::tempdir().unwrap();
    let odd = sweep(folder.path(), "Sweep(patch_depth: [3], triangle_max: [9])");
    let done = run("trade", folder.path(), &["--sweep", &odd]);
    assert_eq!(done.code, 2, "{done:?}");
    for part in ["sweep.ron:1:", "patch_depth[0]: is 3, allowed is 0, 2, 4, 6, 8", "triangles_max?"]
    {
        assert!(done.err.contains(part), "{done:?}");
    }
    let apart = sweep(folder.path(), "Sweep(triangles_max: [64])");
    let done = run("trade", folder.path(), &["--sweep", &apart]);
    assert!(done.code == 2 && done.err.contains("is 64, allowed is 128 to 16000000"), "{done:?}");
    let both = run("recommend", folder.path(), &["--error-px", "1", "--budget-ms", "1"]);
    assert_eq!(both.code, 2, "{both:?}");
    let neither = overfly(&["recommend", "rainier"]);
    assert!(neither.code == 2 && neither.err.contains("--error-px"), "{neither:?}");
    let none = run("recommend", folder.path(), &["--error-px", "0"]);
    assert!(none.err.contains("is not a number above 0"), "{none:?}");
    let beyond = overfly(&["trade", "rainier", "--frames", "0..99999", "--scene", "small"]);
    assert!(beyond.code == 2 && beyond.err.contains("0..36001"), "{beyond:?}");
}
