//! `overfly measure`: what it writes, how it ends, what it refuses.
//!
//! In:    the built binary, the planet of 1 km radius.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: that faults are found (`replay/tests/measure.rs`).

use super::command_line::overfly;

#[test]
fn a_measured_flight_has_a_table_a_vector_columns_and_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (json, out) = (path("measured.json"), path("pictures"));
    let mut arguments = vec!["measure", "poles", "--scene", "small", "--frames", "0..4"];
    arguments.extend(["--every", "2", "--rays", "1500", "--size", "160x90", "--workers", "1"]);
    arguments.extend(["--triangles-max", "6000", "--json", &json, "--out", &out]);
    let done = overfly(&arguments);
    assert_eq!(done.code, 0, "{done:?}");
    assert!(done.out.contains("one in 2 measured, 2 in all"), "{done:?}");
    for word in ["E1 radial error, px", "E5 max", "cracks: C1 edges 0", "worst at", "error-map"] {
        assert!(done.out.contains(word), "{word}: {done:?}");
    }
    let text = std::fs::read_to_string(&json).unwrap();
    let object: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(object["format"], "overfly-measure-1");
    assert_eq!(object["columns"]["frame"], serde_json::json!([0.0, 2.0]));
    assert!(object["vector"]["e5_max"].as_f64().unwrap() <= 1.0);
    assert!(object["vector"]["e1_rms_px"].as_f64().unwrap() > 0.0);
    assert!(object["vector"]["h1_max_m"].as_f64().unwrap() <= 1e-8);
    for name in ["error-view.png", "error-flight.png", "error-map.png"] {
        let picture = image::open(folder.path().join("pictures").join(name)).unwrap().to_rgb8();
        let colours: std::collections::BTreeSet<_> = picture.pixels().map(|p| p.0).collect();
        assert!(colours.len() > 8, "{name} has {} colours", colours.len());
    }
    // A second run with other threads has the same numbers to the last bit.
    let again = path("again.json");
    let at = arguments.iter().position(|&word| word == "--workers").unwrap();
    arguments[at + 1] = "3";
    let at = arguments.iter().position(|&word| word == json).unwrap();
    arguments[at] = &again;
    assert_eq!(overfly(&arguments).code, 0);
    assert_eq!(std::fs::read_to_string(&again).unwrap(), text);
}

#[test]
fn bad_knobs_are_refused_by_option_value_and_range() {
    for (option, value, part) in [
        ("--tolerance-px", "0", "--tolerance-px: is 0.0, allowed is 0.01 to 1000000"),
        ("--tolerance-px", "nan", "--tolerance-px"),
        ("--triangles-max", "5", "--triangles-max: is 5, allowed is 8 to"),
        ("--patch-depth", "3", "--patch-depth: is 3, allowed is 0, 2, 4, 6 or 8"),
        ("--morph-s", "-1", "--morph-s: is -1.0, allowed is 0 to 10"),
        ("--frames", "0..99999999", "--frames: 0..99999999 goes beyond the"),
        ("--cell-px", "0", "0.05 to 64"),
    ] {
        let done = overfly(&["measure", "poles", "--scene", "small", option, value]);
        assert_eq!(done.code, 2, "{done:?}");
        assert!(done.err.contains(part), "{done:?}");
    }
    let help = overfly(&["measure", "--help"]);
    for word in ["docs/accuracy.md", "Exit codes", "--patch-depth", "--loader-delay-ms"] {
        assert!(help.out.contains(word), "{help:?}");
    }
}
