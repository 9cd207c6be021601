//! Settings of what is drawn, and how: depth, vertices, morphing, imagery, the sun.
//!
//! In:    small scene texts.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: all other settings (`scenes`), agreement with the `ron` crate (`ron_agrees`).

use overfly_config::{load, read};
use overfly_core::settings::{
    DepthFormat, DepthOrder, SceneSettings, SunSettings, VertexPrecision,
};

fn settings(text: &str) -> SceneSettings {
    read(text, "scene.ron").unwrap_or_else(|faults| panic!("{faults}\nin {text}"))
}

/// The report without the file name, of `Scene(body: Moon, <rest>)`, which must have faults.
fn report_of(rest: &str) -> String {
    match read(&format!("Scene(body: Moon,\n{rest})"), "scene.ron") {
        Ok(_) => panic!("no fault in {rest}"),
        Err(faults) => faults.to_string().replace("scene.ron:", ""),
    }
}

/// (What stands in the file, where the fault is, what it must mention.)
#[test]
fn each_range_ends_where_the_format_says() {
    let rows = [
        ("lod: (morph_s: -0.1)", "2:16: lod.morph_s", "is -0.1, allowed is 0 to 10"),
        ("lod: (morph_s: 10.5)", "2:16: lod.morph_s", "is 10.5, allowed is 0 to 10"),
        ("depth: (ranges: [1, 2, 3, 4, 5, 6, 7, 8])", "2:17: depth.ranges", "list of 0 to 7"),
        ("depth: (ranges: [1, 2, 2])", "2:24: depth.ranges[2]", "more than 2, the one before"),
        ("depth: (ranges: [inf])", "2:18: depth.ranges[0]", "is inf, allowed is 0.001"),
        ("depth: (ranges: 0)", "2:17: depth.ranges", "is 0, allowed is 1 to 8"),
        ("depth: (ranges: 9)", "2:17: depth.ranges", "is 9, allowed is 1 to 8"),
        ("depth: (ranges: auto)", "2:17: depth.ranges", "variant auto, did you mean Auto?"),
        ("depth: (format: D16)", "2:17: depth.format", "unknown variant D16, known here: D32F"),
        (
            "depth: (order: Backward)",
            "2:16: depth.order",
            "unknown variant Backward, known here: Reversed, F",
        ),
        (
            "depth: (splits_m: [3])",
            "2:9: depth.splits_m",
            "field splits_m, it is called ranges now",
        ),
        ("vertices: F32", "2:11: vertices", "unknown variant F32, known here: TwoFloat, EyeF64"),
        ("imagery: [\"a\", \"\"]", "2:16: imagery[1]", "is \"\", allowed is a path or an address"),
        ("imagery: [\"ftp://a\"]", "2:11: imagery[0]", "http://… or https://…"),
        (
            "imagery: [\"a\", \"b\", \"c\", \"d\", \"e\"]",
            "2:10: imagery",
            "is a list of 5, allowed is a list of 0 to 4",
        ),
        (
            "sun: Some(Clock(utc: \"2026-02-29T12:00:00Z\"))",
            "2:22: sun.utc",
            "is \"2026-02-29T12:00:00Z\", allowed is a time like \"2026-06-21T12:00:00Z\", of the \
             years 1850 to 2149",
        ),
    ];
    for (setting, place, mention) in rows {
        let report = report_of(setting);
        assert!(report.starts_with(&format!("{place}: ")), "{setting}: {report}");
        assert!(report.contains(mention), "{setting}: {report}");
        assert_eq!(report.lines().count(), 1, "{setting}: {report}");
    }
}

#[test]
fn wrong_types_say_what_was_found_and_expected() {
    let rows = [
        ("lod: (patch_depth: (4))", "2:20: lod.patch_depth: is a tuple, expected is a whole"),
        ("depth: (ranges: {1: 2})", "2:17: depth.ranges: is a map, expected is Auto, a whole"),
        (
            "depth: (ranges: 1.5)",
            "2:17: depth.ranges: is the number 1.5, expected is Auto, a whole",
        ),
        ("depth: (ranges: Auto())", "2:17: depth.ranges: is Auto(…), expected is the name alone"),
        ("depth: (ranges: [true])", "2:18: depth.ranges[0]: is true, expected is a number"),
        ("depth: (format: 24)", "2:17: depth.format: is the number 24, expected is one of D32F, D"),
        ("depth: (order: Forward(1))", "2:16: depth.order: is Forward(…), expected is the name al"),
        ("vertices: true", "2:11: vertices: is true, expected is one of TwoFloat, EyeF64"),
        ("imagery: \"a\"", "2:10: imagery: is the text \"a\", expected is a list of texts"),
        ("imagery: [Archive(\"a\")]", "2:11: imagery[0]: is Archive(…), expected is a text"),
        ("sun: Some(Clock)", "2:11: sun: is Clock, expected is Clock(utc: …, runs: …)"),
        ("sun: Some(Clock())", "2:11: sun.utc: is missing, expected is a time like \"2026-06-"),
        ("sun: Some(Clock(utc: 12))", "2:22: sun.utc: is the number 12, expected is a text like"),
        ("lod: (morph_s: \"1\")", "2:16: lod.morph_s: is the text \"1\", expected is a number"),
    ];
    for (setting, expected) in rows {
        let report = report_of(setting);
        assert!(report.starts_with(expected), "{setting}: {report}");
        assert_eq!(report.lines().count(), 1, "{setting}: {report}");
    }
}

#[test]
fn every_range_begins_beyond_every_near_plane() {
    let rows = [
        (
            "views: [(near_m: 10)], depth: (ranges: [5, 100])",
            "2:41: depth.ranges[0]: is 5, allowed is more than 10, as views[0].near_m is",
        ),
        (
            "depth: (ranges: [0.05])",
            "2:18: depth.ranges[0]: is 0.05, allowed is more than 0.1, as views[0].near_m is",
        ),
        (
            "views: [(name: \"a\", near_m: 0.1), (name: \"b\", near_m: 50)], depth: (ranges: 3)",
            "2:55: views[1].near_m: is 50, allowed is less than 46.416, where the first of \
             depth.ranges ends",
        ),
        (
            "views: [(name: \"a\", near_m: 0.001), (name: \"b\")], depth: (ranges: 8)",
            "2:37: views[1].near_m: is 0.1, allowed is less than 0.018, where the first of \
             depth.ranges ends",
        ),
    ];
    for (setting, expected) in rows {
        assert_eq!(report_of(setting), expected, "{setting}");
    }
}

fn splits_m(rest: &str) -> Vec<f64> {
    settings(&format!("(body: Wgs84, {rest})")).depth.splits_m
}

/// Rounded to three digits.
fn rounded(metres: &[f64]) -> Vec<String> {
    metres.iter().map(|border_m| format!("{border_m:.2e}")).collect()
}

#[test]
fn auto_takes_as_many_ranges_as_the_depth_buffer_needs() {
    for reversed in ["", "depth: ()", "depth: (format: D32F, order: Reversed, ranges: Auto)"] {
        assert_eq!(splits_m(reversed), [0.0; 0], "{reversed}");
    }
    let coarse = ["format: D24", "format: D24, order: Forward", "order: Forward, ranges: Auto"];
    for coarse in coarse.map(|coarse| format!("depth: ({coarse})")) {
        assert_eq!(rounded(&splits_m(&coarse)), ["1.79e1", "3.19e3", "5.71e5"], "{coarse}");
    }
    // A near plane further out, or a smaller body, needs fewer.
    let far = "views: [(near_m: 5000)], depth: (format: D24)";
    assert_eq!(rounded(&splits_m(far)), ["7.14e5"]);
    let high = "(body: Sphere(radius_m: 500), views: [(near_m: 100)], depth: (format: D24))";
    assert_eq!(settings(high).depth.splits_m, [0.0; 0]);
    // And one that lies beyond everything has nothing to resolve.
    let beyond = high.replace("100)", "1e6)");
    assert_eq!(settings(&beyond).depth.splits_m, [0.0; 0]);
}

/// Whatever the scene: the ratio within a range is at most 300, where D24 resolves 1e-4.
#[test]
fn no_automatic_range_is_deeper_than_the_depth_buffer_resolves() {
    for radius_m in [500.0, 1e5, 6.4e6, 1e9] {
        for near_m in [0.001, 0.1, 3.0, 1e4, 1e6] {
            let scene = settings(&format!(
                "(body: Sphere(radius_m: {radius_m}), views: [(near_m: {near_m})], \
                 depth: (format: D24, order: Forward))"
            ));
            let mut borders = vec![near_m];
            borders.extend(scene.depth.splits_m);
            borders.push(16.0 * radius_m);
            for pair in borders.windows(2) {
                assert!(pair[1] <= 300.0 * pair[0] * (1.0 + 1e-12), "{borders:?}");
            }
        }
    }
}

#[test]
fn a_number_of_ranges_is_spread_evenly_over_what_is_looked_at() {
    assert_eq!(splits_m("depth: (ranges: 1)"), [0.0; 0]);
    assert_eq!(rounded(&splits_m("depth: (ranges: 3)")), ["4.64e1", "2.15e4"]);
    assert_eq!(splits_m("depth: (ranges: 8)").len(), 7);
    let views = "views: [(name: \"a\", near_m: 10), (name: \"b\", near_m: 1)]";
    assert_eq!(rounded(&splits_m(&format!("{views}, depth: (ranges: 2)"))), ["3.16e3"]);
    // A small body ends sooner: 16 of its radii.
    let small = settings("(body: Sphere(radius_m: 1000), depth: (ranges: 3))");
    assert_eq!(rounded(&small.depth.splits_m), ["5.43e0", "2.95e2"]);
    // The borders do not depend on the format: a host may count on them.
    assert_eq!(splits_m("depth: (format: D24, ranges: 3)"), splits_m("depth: (ranges: 3)"));
}

#[test]
fn depth_vertices_and_morphing_are_what_is_written() {
    let scene = settings(
        "(body: Moon, depth: (format: D24, order: Forward, ranges: [1, 20.5]), \
         vertices: EyeF64, lod: (morph_s: 1.5))",
    );
    assert_eq!((scene.depth.format, scene.depth.order), (DepthFormat::D24, DepthOrder::Forward));
    assert_eq!(scene.depth.splits_m, [1.0, 20.5]);
    assert_eq!((scene.vertices, scene.lod.morph_s), (VertexPrecision::EyeF64, 1.5));
    let bare = settings("(body: Moon)");
    assert_eq!((bare.vertices, bare.lod.morph_s), (VertexPrecision::TwoFloat, 0.25));
    assert_eq!((bare.depth.format, bare.depth.order), (DepthFormat::D32F, DepthOrder::Reversed));
}

#[test]
fn a_clock_for_a_sun_keeps_its_time_and_runs_unless_told_not_to() {
    let sun = |clock: &str| settings(&format!("(body: Mars, sun: Some(Clock({clock})))")).sun;
    let start_unix_s = 1_782_043_200.0;
    let running = SunSettings::Clock { start_unix_s, runs: true };
    assert_eq!(sun("utc: \"2026-06-21T12:00:00Z\""), Some(running));
    assert_eq!(sun("runs: true, utc: r\"2026-06-21T12:00:00Z\""), Some(running));
    let stands = Some(SunSettings::Clock { start_unix_s, runs: false });
    assert_eq!(sun("utc: \"2026-06-21T12:00:00Z\", runs: false"), stands);
    let overhead = running.direction_at(0.0);
    assert!((overhead.z - 0.3977).abs() < 1e-4, "the tropic");
    assert!(overhead.y.abs() < 0.01 && overhead.x > 0.91, "noon at Greenwich");
}

#[test]
fn relative_paths_of_imagery_lead_on_from_the_scene_file_too() {
    let text = "(body: Moon, imagery: [\"a.pmtiles\", \"/c.pmtiles\", \"https://d/e\"])";
    assert_eq!(settings(text).imagery, ["a.pmtiles", "/c.pmtiles", "https://d/e"]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    std::fs::write(&path, text).unwrap();
    let scene = load(path.to_str().unwrap()).unwrap();
    let a = folder.path().join("a.pmtiles").to_str().unwrap().to_owned();
    assert_eq!(scene.imagery, [&a, "/c.pmtiles", "https://d/e"]);
}
