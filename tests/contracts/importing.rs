//! Flights of other programs on the command line: imported, or flown as they are.
//!
//! In:    the built binary, short files written here; the ten encodings where they are at hand.
//! Out:   passes or fails.
//! Keeps: a folder for each test, thrown away.
//! Not here: the formats themselves (`overfly_tracks`).

use super::command_line::{Outcome, command, overfly};
use overfly::replay::{Ending, Flight};
use std::fmt::Write;
use std::path::Path;

/// Twelve seconds over the hills, at 30 m/s.
fn igc(seconds: impl IntoIterator<Item = u32>) -> String {
    let mut text = "AXXX001\nHFDTEDATE:150724,01\nHFALGALTGPS:ELL\n".to_owned();
    for second in seconds {
        let (minute, rest) = (second / 60, second % 60);
        let north = 30_000 + 16 * second;
        writeln!(text, "B09{minute:02}{rest:02}46{north:05}N01115000EA0200002000").unwrap();
    }
    text
}

fn written(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

#[test]
fn an_import_is_a_flight_that_replays_like_the_file_itself() {
    let folder = tempfile::tempdir().unwrap();
    let file = written(folder.path(), "a.igc", &igc(0..12));
    let output = folder.path().join("made/a.ovf");
    let name = output.display().to_string();
    let done = overfly(&["import", &file, "-o", &name]);
    assert_eq!(done.code, 0, "{done:?}");
    assert!(
        done.err.contains("IGC, altitudes are above the ellipsoid: HFALG says ELL"),
        "{done:?}"
    );
    assert!(done.out.contains("2024-07-15 09:00:00") && done.out.contains("estimated"), "{done:?}");
    assert!(done.out.contains("661 poses at 60 Hz"), "{done:?}");
    assert!(!folder.path().join("made/a.ovf.part").exists());
    let (flight, ending) = Flight::read(&output).unwrap();
    assert!(matches!(ending, Ending::Complete) && flight.poses.len() == 661);
    assert!((flight.poses[300].at.height_m - 2000.0).abs() < 1e-3);
    let replay = |name: &str| {
        let done = overfly(&["replay", name, "--no-render", "--scene", "small"]);
        assert_eq!(done.code, 0, "{done:?}");
        done
    };
    let [direct, imported] = [replay(&file), replay(&name)];
    assert_eq!(direct.digest(), imported.digest());
    assert_eq!(direct.err.matches("HFALG").count(), 1, "{direct:?}");
}

#[test]
fn a_file_of_several_flights_is_imported_one_by_one() {
    let folder = tempfile::tempdir().unwrap();
    let file = written(folder.path(), "b.igc", &igc((0..12).chain(300..330)));
    let done = command().args(["import", &file]).current_dir(folder.path()).output().unwrap();
    assert!(done.status.success());
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(said.contains("line 16: cut, since there is no fix for 289.0 s"), "{said}");
    for (name, poses) in [("b-1.ovf", 661), ("b-2.ovf", 1741)] {
        assert_eq!(Flight::read(&folder.path().join(name)).unwrap().0.poses.len(), poses);
    }
    let frames = |name: &str, frames: &str| {
        let frames = ["--no-render", "--scene", "small", "--frames", frames];
        overfly(&[&["replay", name][..], &frames].concat())
    };
    let longest = frames(&file, "0..2000");
    assert!(longest.code == 2 && longest.err.contains("0..1741"), "{longest:?}");
    assert!(longest.err.contains("flight 2 of 2 is flown"), "{longest:?}");
    let first = frames(&format!("{file}#1"), "0..2000");
    assert!(first.err.contains("0..661"), "{first:?}");
    let third = frames(&format!("{file}#3"), "0..5");
    assert!(third.code == 2 && third.err.contains("flights 1 to 2, not 3"), "{third:?}");
    let listed = overfly(&["import", &file, "--list"]);
    assert!(listed.code == 0 && listed.out.lines().count() == 3, "{listed:?}");
    let one = overfly(&["import", &file, "--flight", "3", "--list"]);
    assert!(one.code == 2 && one.err.contains("flights 1 to 2"), "{one:?}");
}

#[test]
fn tables_take_the_column_map_beside_them() {
    let folder = tempfile::tempdir().unwrap();
    let mut rows = String::new();
    for i in 0..20 {
        writeln!(rows, "{i};{};11.25;6000", 46.5 + 2e-4 * f64::from(i)).unwrap();
    }
    let file = written(folder.path(), "log.csv", &rows);
    let refused = overfly(&["import", &file, "--list"]);
    assert!(refused.code == 2 && refused.err.contains("column map"), "{refused:?}");
    let map = "Columns(separator: ';', titles: false, time: (column: 1), latitude: 2, longitude: 3,\n\
               altitude: (column: 4, unit: Feet))";
    written(folder.path(), "log.csv.columns.ron", map);
    let asked = overfly(&["import", &file, "--list"]);
    assert!(asked.code == 2 && asked.err.contains("--altitude msl"), "{asked:?}");
    let done = overfly(&["import", &file, "--list", "--altitude", "ellipsoid"]);
    assert_eq!(done.code, 0, "{done:?}");
    let broken = written(folder.path(), "map.ron", &map.replace("Feet", "Yards"));
    let refused = overfly(&["import", &file, "--columns", &broken]);
    assert!(
        refused.code == 2 && refused.err.contains("map.ron: column map: line 2"),
        "{refused:?}"
    );
}

#[test]
fn a_lift_keeps_the_eye_above_the_ground_of_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    let low = igc(0..12).replace("0200002000", "-0500-0500");
    let file = written(folder.path(), "c.igc", &low);
    let output = folder.path().join("c.ovf");
    let name = output.display().to_string();
    let done = overfly(&["import", &file, "-o", &name, "--lift", "2", "--scene", "small"]);
    assert_eq!(done.code, 0, "{done:?}");
    assert!(done.out.contains("to stay 2 m above the ground"), "{done:?}");
    let (flight, _) = Flight::read(&output).unwrap();
    assert!(flight.poses.iter().all(|pose| pose.at.height_m > -499.0));
}

#[test]
fn what_cannot_be_imported_is_refused_by_file_line_and_field() {
    let folder = tempfile::tempdir().unwrap();
    let text = written(folder.path(), "d.txt", "hello\n");
    let bad =
        written(folder.path(), "e.csv", "utc,lat_deg,lon_deg,alt_msl_m\n0,91,0,0\n1,92,0,0\n");
    let good = written(folder.path(), "f.igc", &igc(0..12));
    for (arguments, part) in [
        (vec!["import", "nowhere.igc"], "nowhere.igc"),
        (vec!["import", &text], "in none of the formats IGC, GPX"),
        (vec!["replay", &text], "in none of the formats IGC, GPX"),
        (vec!["import", &bad], "e.csv: line 2, column 3: latitude is \"91\", expected -90 to 90"),
        (vec!["import", &good, "--rate", "0"], "0.1 to 1000"),
        (vec!["import", &good, "--gap", "x"], "1 to 3600"),
        (vec!["import", &good, "-o", &good], "is an input or another output"),
        (vec!["import", &good, "--altitude", "qnh"], "pressure"),
        (vec!["import", &good, "--lift", "2", "--scene", "venus"], "venus"),
    ] {
        let Outcome { code, err, .. } = overfly(&arguments);
        assert_eq!(code, 2, "{arguments:?}: {err}");
        assert!(err.contains(part), "{arguments:?}: {err} lacks {part}");
    }
    let help = overfly(&["import", "--help"]);
    for part in ["IGC", "column map", "--altitude", "--lift", "flight.igc#2"] {
        assert!(help.out.contains(part), "{help:?}");
    }
}
