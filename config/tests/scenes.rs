//! Scene files: what they resolve to, and that every fault is reported at its place.
//!
//! In:    the presets and small scene texts.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: agreement with the `ron` crate (`ron_agrees`).

use overfly_config::{FaultKind, LoadError, PRESETS, Preset, load, preset, read};
use overfly_core::datasource::procedural::Style;
use overfly_core::geodesy::Ellipsoid;
use overfly_core::settings::{
    DepthFormat, DepthOrder, SceneSettings, SunSettings, VertexPrecision,
};

fn settings(text: &str) -> SceneSettings {
    read(text, "scene.ron").unwrap_or_else(|faults| panic!("{faults}\nin {text}"))
}

/// The report of a text that must have faults.
fn report(text: &str) -> String {
    match read(text, "scene.ron") {
        Ok(_) => panic!("no fault in {text}"),
        Err(faults) => faults.to_string(),
    }
}

/// The report without the file name, of `Scene(body: Moon, <rest>)`.
fn report_of(rest: &str) -> String {
    report(&format!("Scene(body: Moon,\n{rest})")).replace("scene.ron:", "")
}

#[test]
fn presets_load_by_name() {
    for (name, preset_) in PRESETS.into_iter().zip(Preset::ALL) {
        assert_eq!(Preset::named(name), Some(preset_));
        assert_eq!(preset(name), Some(preset_.text()));
        assert_eq!(load(name).unwrap(), settings(preset_.text()));
    }
    assert_eq!(preset("Earth"), None);
    let digests: Vec<u64> = PRESETS.iter().map(|name| load(name).unwrap().digest()).collect();
    assert!(digests[0] != digests[1] && digests[1] != digests[2] && digests[0] != digests[2]);
}

#[test]
fn earth_resolves_to_what_it_says() {
    let earth = load("earth").unwrap();
    assert_eq!(earth.body, Ellipsoid::WGS84);
    let planet = earth.procedural_source().unwrap();
    assert_eq!((planet.seed, planet.style), (2029, Style::Earthlike));
    assert_eq!((planet.relief, planet.finest_m, earth.detail()), (1.0, 0.15, 1.0));
    assert_eq!(earth.sources.len(), 1);
    assert_eq!((earth.lod.tolerance.0, earth.lod.triangles_max), (1.0, 200_000));
    assert_eq!((earth.lod.patch_depth, earth.lod.level_max), (4, 50));
    assert_eq!((earth.lod.splits_max, earth.lod.merges_max), (512, 512));
    assert_eq!(earth.lod.wanted_max, 32);
    assert_eq!((earth.views.len(), earth.views[0].name.as_str()), (1, "front"));
    assert!((earth.views[0].field_of_view.0 - std::f64::consts::FRAC_PI_3).abs() < 1e-15);
    assert_eq!((earth.views[0].yaw.0, earth.views[0].pitch.0), (0.0, 0.0));
    assert_eq!(earth.views[0].near_m, 0.1);
    assert_eq!(earth.lod.morph_s, 0.25);
    assert_eq!(earth.depth.splits_m, [30.0, 10_000.0]);
    assert_eq!(earth.depth.format, DepthFormat::D32F);
    assert_eq!(earth.depth.order, DepthOrder::Reversed);
    assert_eq!((earth.vertices, earth.imagery.len()), (VertexPrecision::TwoFloat, 0));
    assert_eq!(earth.memory.pages_bytes, 256 << 20);
    assert!(earth.sea);
    let Some(SunSettings::Fixed { direction: sun }) = earth.sun else { panic!("{:?}", earth.sun) };
    assert!((sun.length() - 1.0).abs() < 1e-15);
    assert!(sun.x < 0.0 && sun.y > 0.0 && (sun.z - 0.173_648).abs() < 1e-6);
}

#[test]
fn earth_spells_out_the_defaults() {
    let bare = settings("Scene(body: Wgs84)");
    assert_eq!((bare.sea, bare.sun), (false, None), "optional parts are absent");
    let earth = load("earth").unwrap();
    assert_eq!(bare.depth.splits_m, [0.0; 0], "one range is enough");
    let depth = earth.depth.clone();
    let optional = SceneSettings { sea: earth.sea, sun: earth.sun, depth, ..bare };
    assert_eq!(optional, earth);
    let hollow = "(body: Wgs84, sources: [Procedural()], sun: None, lod: (), views: [()], \
                  depth: (), memory: ())";
    assert_eq!(settings(hollow), settings("(body: Wgs84)"));
}

#[test]
fn moon_and_small_are_what_their_names_say() {
    let moon = load("moon").unwrap();
    assert_eq!((moon.body, moon.sea), (Ellipsoid::MOON, false));
    assert_eq!(moon.depth.splits_m, [30.0, 10_000.0]);
    assert_eq!(moon.procedural_source().unwrap().style, Style::Cratered);
    let small = load("small").unwrap();
    assert_eq!((small.body, small.sea), (Ellipsoid { a_m: 1000.0, f: 0.0 }, true));
    assert_eq!(small.depth.splits_m, [10.0, 300.0]);
}

#[test]
fn bodies_and_numbers_may_be_written_in_many_ways() {
    let body = |text: &str| settings(&format!("(body: {text})")).body;
    assert_eq!(body("Mars"), Ellipsoid::MARS);
    assert_eq!(body("Sphere(radius_m: 1_000)"), Ellipsoid { a_m: 1000.0, f: 0.0 });
    assert_eq!(body("Ellipsoid(a_m: +6.4e6, f: -.25,)"), Ellipsoid { a_m: 6.4e6, f: -0.25 });
    let lod = settings("(body: Moon, lod: Lod(splits_max: 0x1_0, merges_max: 0b11)) // end").lod;
    assert_eq!((lod.splits_max, lod.merges_max), (16, 3));
}

#[test]
fn six_different_faults_are_all_reported_at_their_places() {
    let text = r#"Scene(
    body: Sphere(radius_m: 1.0),
    sources: [Procedural(style: Earthlik)],
    sea: "yes",
    lod: (
        tolerence_px: 1.0,
        patch_depth: 3,
        splits_max: 5, splits_max: 6,
    ),
    sun: Some((latitude_deg: 10.0)),
    memory: (pages_mib: 256.5),
)"#;
    let expected = "\
scene.ron:2:28: body.radius_m: is 1.0, allowed is 500 to 1000000000
scene.ron:3:33: sources[0].style: unknown variant Earthlik, did you mean Earthlike?
scene.ron:4:10: sea: is the text \"yes\", expected is true or false
scene.ron:6:9: lod.tolerence_px: unknown field tolerence_px, did you mean tolerance_px?
scene.ron:7:22: lod.patch_depth: is 3, allowed is 0, 2, 4, 6 or 8
scene.ron:8:24: lod.splits_max: is given twice, first at 8:9
scene.ron:10:15: sun.longitude_deg: is missing, expected is a number, -360 to 360
scene.ron:11:25: memory.pages_mib: is the number 256.5, expected is a whole number, 4 to 65536";
    assert_eq!(report(text), expected);
    let faults = read(text, "scene.ron").unwrap_err().faults;
    assert_eq!(faults.len(), 8);
    assert_eq!((faults[4].line, faults[4].column), (7, 22));
    assert!(matches!(faults[5].what, FaultKind::DuplicateField { first_line: 8, first_column: 9 }));
    assert!(matches!(&faults[6].what, FaultKind::Missing { .. }));
}

/// One setting at a time: (what stands in the file, where the fault is, what it must mention).
#[test]
fn each_range_ends_where_the_format_says() {
    let rows = [
        ("sources: [Procedural(seed: -1)]", "2:28: sources[0].seed", "0 to 18446744073709551615"),
        ("sources: [Procedural(relief: 10.1)]", "2:30: sources[0].relief", "0 to 10"),
        ("sources: [Procedural(finest_m: 0)]", "2:32: sources[0].finest_m", "0.01 to 1000"),
        ("sources: [Procedural(detail: 10.5)]", "2:30: sources[0].detail", "0 to 10"),
        ("sources: []", "2:10: sources", "is a list of 0, allowed is a list of 1 to 9"),
        ("sources: [Procedural(), Procedural()]", "2:11: sources[0]", "in the last place"),
        ("sources: [Procedural(), Archive(\"a\")]", "2:11: sources[0]", "in the last place"),
        (
            "sources: [Archive(\"\")]",
            "2:19: sources[0]",
            "is \"\", allowed is a path or an address",
        ),
        ("sources: [Archive(\"a\\nb\")]", "2:19: sources[0]", "control character"),
        ("sources: [Archive(\"s3://a/b\")]", "2:19: sources[0]", "http://… or https://…"),
        ("sun: Some((latitude_deg: 91, longitude_deg: 0))", "2:26: sun.latitude_deg", "-90 to 90"),
        ("sun: Some((latitude_deg: 0, longitude_deg: 361))", "2:44: sun.longitude_deg", "-360"),
        ("lod: (tolerance_px: 0.001)", "2:21: lod.tolerance_px", "0.01 to 1000000"),
        ("lod: (triangles_max: 16000001)", "2:22: lod.triangles_max", "16000000"),
        ("lod: (patch_depth: 10)", "2:20: lod.patch_depth", "0, 2, 4, 6 or 8"),
        ("lod: (splits_max: 0)", "2:19: lod.splits_max", "1 to 65536"),
        ("lod: (merges_max: 65537)", "2:19: lod.merges_max", "1 to 65536"),
        ("lod: (level_max: 57)", "2:18: lod.level_max", "0 to 56"),
        ("lod: (level_max: 300)", "2:18: lod.level_max", "is 300, allowed is 0 to 56"),
        ("lod: (wanted_max: 4097)", "2:19: lod.wanted_max", "1 to 4096"),
        ("views: []", "2:8: views", "allowed is a list of 1 to 8"),
        ("views: [(field_of_view_deg: 180)]", "2:29: views[0].field_of_view_deg", "0.01 to 179"),
        ("views: [(yaw_deg: 400)]", "2:19: views[0].yaw_deg", "-360 to 360"),
        ("views: [(pitch_deg: -91)]", "2:21: views[0].pitch_deg", "-90 to 90"),
        ("views: [(near_m: 0)]", "2:18: views[0].near_m", "0.001 to 1000000"),
        ("views: [(name: \"\")]", "2:16: views[0].name", "1 to 32 of A-Z"),
        ("views: [(name: \"../up\")]", "2:16: views[0].name", "1 to 32 of A-Z"),
        ("memory: (pages_mib: 3)", "2:21: memory.pages_mib", "4 to 65536"),
        ("lod: (tolerance_px: NaN)", "2:21: lod.tolerance_px", "is NaN, allowed is 0.01"),
        ("lod: (tolerance_px: 1e999)", "2:21: lod.tolerance_px", "is 1e999, allowed is 0.01"),
    ];
    for (setting, place, mention) in rows {
        let report = report_of(setting);
        assert!(report.starts_with(&format!("{place}: ")), "{setting}: {report}");
        assert!(report.contains(mention), "{setting}: {report}");
        assert_eq!(report.lines().count(), 1, "{setting}: {report}");
    }
}

#[test]
fn both_ends_of_each_range_are_allowed() {
    for setting in [
        "sources: [Procedural(seed: 18446744073709551615, relief: 0, finest_m: 1000)]",
        "sun: Some((latitude_deg: -90, longitude_deg: 360))",
        "lod: (tolerance_px: 0.01, triangles_max: 16000000, splits_max: 1, merges_max: 65536)",
        "lod: (tolerance_px: 1e6, triangles_max: 8, patch_depth: 0, level_max: 56, wanted_max: 1)",
        "lod: (triangles_max: 2048, patch_depth: 8, level_max: 48, wanted_max: 4096)",
        "views: [(field_of_view_deg: 179, yaw_deg: -360, pitch_deg: 90, near_m: 0.001)]",
        "views: [(near_m: 1e6)], depth: (ranges: [])",
        "views: [(near_m: 1e6)]",
        "views: [(near_m: 1e6)], depth: (format: D24, ranges: 8)",
        "depth: (ranges: [1, 2, 3, 4, 5, 6, 7])",
        "lod: (morph_s: 0)",
        "lod: (morph_s: 10)",
        "imagery: []",
        "imagery: [\"a\", \"b/c\", \"http://d\", \"/e\"]",
        "sun: Some(Clock(utc: \"1850-01-01T00:00:00Z\"))",
        "sun: Some(Clock(utc: \"2149-12-31T23:59:59Z\", runs: false))",
        "memory: (pages_mib: 65536)",
    ] {
        settings(&format!("Scene(body: Moon, {setting})"));
    }
    settings("(body: Sphere(radius_m: 500))");
    settings("(body: Ellipsoid(a_m: 1e9, f: 0.5))");
}

#[test]
fn wrong_types_say_what_was_found_and_expected() {
    let rows = [
        ("sea: 1", "2:6: sea: is the number 1, expected is true or false"),
        ("sea: Yes", "2:6: sea: is Yes, expected is true or false"),
        ("lod: 5", "2:6: lod: is the number 5, expected is Lod(tolerance_px: …, triangles_max"),
        ("lod: Lood()", "2:6: lod: is Lood(…), expected is Lod("),
        ("lod: (splits_max: 1.0)", "2:19: lod.splits_max: is the number 1.0, expected is a whole"),
        (
            "lod: (tolerance_px: 0x1)",
            "2:21: lod.tolerance_px: is the number 0x1, expected is a num",
        ),
        ("lod: (tolerance_px: [1])", "2:21: lod.tolerance_px: is a list, expected is a number"),
        ("sources: Procedural()", "2:10: sources: is Procedural(…), expected is [Archive(\"…\"), "),
        ("sources: [Archive]", "2:11: sources[0]: is Archive, expected is Archive(\"a path or"),
        ("sources: [Archive()]", "2:11: sources[0]: is Archive(…), expected is Archive(\"a path"),
        ("sources: [Archive(\"a\", \"b\")]", "2:11: sources[0]: is Archive(…), expected is"),
        ("sources: [Archive(path: \"a\")]", "2:11: sources[0]: is Archive(…), expected is"),
        ("sources: [Archive(7)]", "2:19: sources[0]: is the number 7, expected is a text"),
        ("sources: [Procedural]", "2:11: sources[0]: is Procedural, expected is Procedural(seed"),
        ("sources: [3]", "2:11: sources[0]: is the number 3, expected is one of Archive, Pro"),
        ("sources: [Procedural(style: Earthlike())]", "2:29: sources[0].style: is Earthlike(…)"),
        ("sun: (latitude_deg: 1)", "2:6: sun: is a struct, expected is None, Some(("),
        ("sun: Some(1)", "2:11: sun: is the number 1, expected is Sun(latitude_deg"),
        ("views: [\"front\"]", "2:9: views[0]: is the text \"front\", expected is View("),
        ("views: [(name: 'c')]", "2:16: views[0].name: is the character 'c', expected is a text"),
    ];
    for (setting, expected) in rows {
        let report = report_of(setting);
        assert!(report.starts_with(expected), "{setting}: {report}");
        assert_eq!(report.lines().count(), 1, "{setting}: {report}");
    }
}

#[test]
fn rules_between_settings_name_both() {
    let rows = [
        (
            "lod: (triangles_max: 100, patch_depth: 8)",
            "2:22: lod.triangles_max: is 100, allowed is 2048 to 16000000 while lod.patch_depth is 8",
        ),
        (
            "lod: (patch_depth: 6, level_max: 51)",
            "2:34: lod.level_max: is 51, allowed is 0 to 50 while lod.patch_depth is 6",
        ),
        (
            "views: [(name: \"a\"), (name: \"b\"), (name: \"a\")]",
            "2:42: views[2].name: is \"a\", allowed is a name that no view before it has",
        ),
        (
            "views: [(), (yaw_deg: 90)]",
            "2:13: views[1].name: is missing, expected is a name that no view before it has",
        ),
    ];
    for (setting, expected) in rows {
        assert_eq!(report_of(setting), expected, "{setting}");
    }
    let flat = report("(body: Ellipsoid(a_m: 500, f: 0.5))");
    assert_eq!(
        flat,
        "scene.ron:1:23: body.a_m: is 500, allowed is 600.000 or more while body.f is 0.5"
    );
}

#[test]
fn the_default_depth_of_levels_gives_way_to_deep_patches() {
    assert_eq!(settings("(body: Moon, lod: (patch_depth: 8))").lod.level_max, 48);
    assert_eq!(settings("(body: Moon, lod: (patch_depth: 0))").lod.level_max, 50);
}

#[test]
fn one_fault_does_not_cause_another() {
    for (setting, count) in [
        ("lod: (patch_depth: 3, triangles_max: 9, level_max: 56)", 1),
        ("views: [3, (name: \"front\")]", 1),
        ("views: [(near_m: -1)], depth: (ranges: [0.002])", 1),
        ("views: [(near_m: -1)], depth: (format: D24)", 1),
        ("depth: (format: D25, order: 3, ranges: No)", 3),
        ("views: [(name: 3, near_m: 50)], depth: (ranges: [30])", 2),
        ("depth: (ranges: [0.05, true])", 2),
        ("lod: 3, memory: 4, depth: 5", 3),
    ] {
        assert_eq!(report_of(setting).lines().count(), count, "{}", report_of(setting));
    }
}

#[test]
fn likely_names_are_suggested_and_others_listed() {
    assert!(report("(body: Wgs48)").contains("unknown variant Wgs48, did you mean Wgs84?"));
    assert!(report("(body: moon)").contains("did you mean Moon?"));
    let unit = report_of("views: [(near: 1.0)]");
    assert!(unit.contains("unknown field near, did you mean near_m?"), "{unit}");
    let stranger = report_of("clouds: true");
    assert_eq!(
        stranger,
        "2:1: clouds: unknown field clouds, known here: body, sources, imagery, sea, sun, \
         lod, views, vertices, depth, memory"
    );
    assert!(report("(body: Pluto)").contains("known here: Wgs84, Moon, Mars, Sphere, Ellipsoid"));
}

#[test]
fn a_scene_without_body_is_told_what_to_write() {
    assert_eq!(
        report("Scene()"),
        "scene.ron:1:1: body: is missing, expected is Wgs84, Moon, Mars, Sphere(radius_m: …) or \
         Ellipsoid(a_m: …, f: …)"
    );
}

#[test]
fn syntax_faults_have_a_place_too() {
    let rows = [
        ("", "1:1: found the end of the file, expected a value"),
        ("Scene(body: Moon", "1:17: found the end of the file, expected `,` or `)`"),
        ("Scene(body Moon)", "1:12: found `M`, expected `,` or `)`"),
        ("Scene(body: Moon\nsea: true)", "2:1: found `s`, expected `,` or `)`"),
        ("Scene(body: Moon, sea true)", "1:23: found `t`, expected `:` after the name of a field"),
        ("Scene(body: Moon))", "1:18: found `)`, expected the end of the file"),
        ("Scene(body: /* Moon)", "1:13: comment without end"),
        ("(body: Moon, views: [(name: \"é\\q\")])", "1:31: unknown escape"),
        ("(body: Moon, views: [(name: \"x)])", "1:29: text without closing `\"`"),
        ("#![enable(implicit_some)](body: Moon)", "1:1: found `#`, expected a value; `#![enable"),
    ];
    for (text, expected) in rows {
        let report = report(text);
        assert!(report.starts_with(&format!("scene.ron:{expected}")), "{text}: {report}");
    }
    let deep = report(&"[".repeat(100_000));
    assert_eq!(deep, "scene.ron:1:33: nested deeper than 32 values");
}

#[test]
fn a_broken_number_hides_no_other_fault() {
    let report = report_of("lod: (splits_max: 1__x, merges_max: 0), sea: 1.2.3, sky: 1");
    let places: Vec<&str> = report.lines().map(|line| &line[..5]).collect();
    assert_eq!(places, ["2:19:", "2:37:", "2:46:", "2:53:"], "{report}");
    assert!(report.contains("2:19: `1__x` is not a number"), "{report}");
}

#[test]
fn faults_stay_on_one_line_however_long_the_value() {
    let report = report_of(&format!("sea: \"a\nb\u{1b}{}\"", "c".repeat(500)));
    assert_eq!(report.lines().count(), 1);
    assert!(report.len() < 120 && report.contains("a b c") && !report.contains('\u{1b}'));
}

#[test]
fn files_load_and_missing_ones_say_which() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    std::fs::write(&path, preset("moon").unwrap()).unwrap();
    let path = path.to_str().unwrap();
    assert_eq!(load(path).unwrap(), load("moon").unwrap());

    std::fs::write(path, "Scene(body: Moon, sea: 2)").unwrap();
    let faults = load(path).unwrap_err();
    assert!(matches!(&faults, LoadError::Faults(faults) if faults.faults.len() == 1));
    assert!(faults.to_string().starts_with(&format!("{path}:1:24: sea: ")));

    let missing = load("no/such/scene.ron").unwrap_err();
    assert!(matches!(missing, LoadError::Read { .. }));
    let sentence = missing.to_string();
    assert!(sentence.starts_with("cannot read scene no/such/scene.ron: "), "{sentence}");
    assert!(sentence.ends_with("(the presets are earth, moon, small)"), "{sentence}");
}

fn archives(scene: &SceneSettings) -> Vec<&str> {
    scene.archives().collect()
}

#[test]
fn archives_come_finest_first_and_the_planet_beneath() {
    let scene = settings(
        "(body: Wgs84, sources: [Archive(\"alps.pmtiles\"), \
         Archive(r\"http://host/planet.pmtiles\",), Procedural(seed: 7, detail: 0)])",
    );
    assert_eq!(archives(&scene), ["alps.pmtiles", "http://host/planet.pmtiles"]);
    assert_eq!((scene.procedural_source().unwrap().seed, scene.detail()), (7, 0.0));
    assert_eq!(scene.sources.len(), 3);
    let alone = settings("(body: Wgs84, sources: [Archive(\"alps.pmtiles\")])");
    assert_eq!((archives(&alone).len(), alone.procedural_source()), (1, None));
}

#[test]
fn eight_archives_and_a_planet_are_the_most() {
    let of =
        |archives: usize| format!("sources: [{}Procedural()]", "Archive(\"a\"), ".repeat(archives));
    assert_eq!(archives(&settings(&format!("(body: Moon, {})", of(8)))).len(), 8);
    let report = report_of(&of(9));
    assert!(report.contains("sources: is a list of 10, allowed is a list of 1 to 9"), "{report}");
    let without = report_of(&of(9).replace(", Procedural()", ""));
    assert_eq!(without.lines().count(), 1, "{without}");
    assert!(without.contains("sources[8]: is Archive(\"a\"), allowed is at most 8 archives"));
}

#[test]
fn relative_paths_of_archives_lead_on_from_the_scene_file() {
    let text = "(body: Moon, sources: [Archive(\"a.pmtiles\"), Archive(\"../b.pmtiles\"), \
                Archive(\"/c.pmtiles\"), Archive(\"HTTP://d/e\")])";
    let written = ["a.pmtiles", "../b.pmtiles", "/c.pmtiles", "HTTP://d/e"];
    assert_eq!(archives(&settings(text)), written);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    std::fs::write(&path, text).unwrap();
    let scene = load(path.to_str().unwrap()).unwrap();
    let inside = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (a, b) = (inside("a.pmtiles"), inside("../b.pmtiles"));
    assert_eq!(archives(&scene), [&a, &b, "/c.pmtiles", "HTTP://d/e"]);
    assert_eq!(scene.digest(), settings(text).digest(), "the folder is not part of the scene");
}
