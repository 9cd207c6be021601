//! `overfly probe`: heights of places as CSV and JSON.
//!
//! In:    the built binary, an archive of hills.
//! Out:   passes or fails.
//! Keeps: a folder for each test, thrown away.
//! Not here: what heights are right (`grounds`, `rainier_agl`).

use super::command_line::{Outcome, overfly};
use super::hills::Hills;
use overfly::core::datasource::PageKey;

fn probe(arguments: &[&str]) -> Outcome {
    overfly(&[&["probe"], arguments].concat())
}

/// Cells of a line of the output, by title.
fn cells(out: &str, line: usize) -> std::collections::BTreeMap<String, String> {
    let lines: Vec<&str> = out.lines().collect();
    let split = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    split(lines[0]).into_iter().zip(split(lines[line])).collect()
}

#[test]
fn places_in_the_south_and_west_are_places_and_not_options() {
    let hills = Hills::new();
    let name = hills.scene_name();
    let places = ["--at", "20,45", "-33.5,-70", "-90,0", "--level", "exact:17", "--scene", &name];
    let done = probe(&places);
    assert_eq!((done.code, done.out.lines().count()), (0, 4), "{done:?}");
    let row = cells(&done.out, 2);
    for (title, value) in [
        ("lat_deg", "-33.500000000"),
        ("lon_deg", "-70.000000000"),
        ("level", "17"),
        ("status", "ok"),
        ("origin", "procedural"),
        ("sea_level_m", "0.0000"),
    ] {
        assert_eq!(row[title], value, "{row:?}");
    }
    assert_eq!(row["height_m"], row["height_above_sea_m"]);
    assert_eq!(cells(&done.out, 1)["origin"], "measured");
    let flat = probe(&["--at", "20,45", "--scene", &name]);
    assert_eq!(cells(&flat.out, 1)["level"], "16", "the data's own level");
}

#[test]
fn tables_keep_names_and_order_and_json_holds_the_same() {
    let hills = Hills::new();
    let (name, folder) = (hills.scene_name(), hills.folder());
    let table = folder.join("places.csv");
    let output = folder.join("heights.csv");
    // Enough for several threads, in no order.
    let spots = (0..500).map(|i| (i * 37 % 180 - 90, i * 101 % 360 - 180));
    let lines: String =
        spots.enumerate().map(|(i, (lat, lon))| format!("{lon},p{i},{lat}\n")).collect();
    std::fs::write(&table, format!("lng,Name,latitude\n{lines}")).unwrap();
    let (table, path) = (table.display().to_string(), output.display().to_string());
    let done = probe(&["--csv", &table, "--scene", &name, "--output", &path]);
    assert_eq!((done.code, done.out.as_str()), (0, ""), "{done:?}");
    let text = std::fs::read_to_string(&output).unwrap();
    let json = probe(&["--csv", &table, "--scene", &name, "--format", "json"]);
    let json: serde_json::Value = serde_json::from_str(&json.out).unwrap();
    assert_eq!(json["format"], "overfly-probe-1");
    for line in 1..=500 {
        let row = cells(&text, line);
        let object = &json["places"][line - 1];
        assert_eq!(row["Name"], format!("p{}", line - 1));
        assert_eq!(object["Name"], row["Name"]);
        let height_m: f64 = row["height_m"].parse().unwrap();
        assert!((object["height_m"].as_f64().unwrap() - height_m).abs() < 1e-4);
        assert_eq!(row["status"], "ok");
    }
    let refused = probe(&["--csv", &table, "--scene", &name, "--output", &table]);
    assert!(refused.code == 2 && refused.err.contains("is an input"), "{refused:?}");
}

#[test]
fn faults_name_file_line_field_and_value_and_leave_no_output() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("places.csv");
    std::fs::write(&table, "lat,lon\n1,2\n-91,2\n").unwrap();
    let output = folder.path().join("heights.csv").display().to_string();
    let table = table.display().to_string();
    for (arguments, part) in [
        (vec!["--csv", &table, "--output", &output], "places.csv:3: latitude `-91`"),
        (vec!["--at", "-91,0"], "-90 to 90"),
        (vec!["--at", "1"], "LAT,LON"),
        (vec!["--at", "1,2", "--level", "exact:57"], "0 to 56"),
        (vec!["--at", "1,2", "--level", "within:-1"], "within:M"),
        (vec![], "--at"),
        (vec!["--csv", "no/such.csv"], "no/such.csv"),
    ] {
        let done = probe(&[&["--scene", "small"], &arguments[..]].concat());
        assert_eq!(done.code, 2, "{arguments:?}: {done:?}");
        assert!(done.err.contains(part), "{arguments:?}: {done:?}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "only the table is left");
}

#[test]
fn data_that_cannot_be_read_is_answered_coarser_and_named() {
    let bad = |key: PageKey| key.depth() == 2;
    let hills = Hills::with(bad, 1);
    let done = probe(&["--at", "20,45", "-20,-45", "--scene", &hills.scene_name()]);
    assert_eq!(done.code, 0, "{done:?}");
    let row = cells(&done.out, 1);
    assert_eq!((row["status"].as_str(), row["level"].as_str()), ("coarser", "14"), "{done:?}");
    assert_eq!(cells(&done.out, 2)["status"], "ok");
    assert_eq!(done.err.matches("hills.pmtiles").count(), 1, "{done:?}");
}

#[test]
fn help_of_probe_teaches() {
    let help = probe(&["--help"]);
    for word in ["--at", "--csv", "exact:N", "within:M", "2·(6 + d)", "Examples", "slope"] {
        assert!(help.out.contains(word), "{help:?} lacks {word}");
    }
}
