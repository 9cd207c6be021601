//! Odd recordings: midnight, leap seconds, the antimeridian, poles, standing still, times that go
//! back, several flights, landings; what is said of altitudes and of faults.
//!
//! In:    short files written here.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: files that are damaged at random (`mutations`), real ones (`rainier`).

mod samples;

use overfly_core::geodesy::{Ellipsoid, Geodetic, trig};
use overfly_tracks::{Altitude, Curve, Datum, Format, Import, Options, import};

const HEAD: &str = "utc,lat_deg,lon_deg,alt_msl_m\n";

fn of(text: &str, file: &str) -> Import {
    import(text.as_bytes(), file, &Options::default(), &|_, _| 0.0)
        .unwrap_or_else(|error| panic!("{error}"))
}

fn table(rows: impl IntoIterator<Item = (f64, f64, f64, f64)>) -> Import {
    let row = |(t, lat, lon, m): (f64, f64, f64, f64)| format!("{t:.2},{lat:.7},{lon:.7},{m:.2}\n");
    of(&(HEAD.to_owned() + &rows.into_iter().map(row).collect::<String>()), "a.csv")
}

fn error(text: &str, file: &str) -> String {
    import(text.as_bytes(), file, &Options::default(), &|_, _| 0.0).unwrap_err().to_string()
}

/// Speeds between poses at 20 Hz in m/s, as places in space.
fn speeds(curve: &Curve) -> Vec<f64> {
    let places: Vec<_> =
        curve.poses(20.0).map(|pose| Ellipsoid::WGS84.ecef_from_geodetic(pose.at).0).collect();
    places.windows(2).map(|pair| pair[0].distance(pair[1]) * 20.0).collect()
}

fn spread(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, 0.0), |(least, most), &v| (v.min(least), v.max(most)))
}

#[test]
fn every_format_gives_the_same_climb() {
    for (file, bytes, format) in [
        ("a.igc", samples::igc().into_bytes(), Format::Igc),
        ("a.gpx", samples::gpx().into_bytes(), Format::Gpx),
        ("a.kml", samples::kml().into_bytes(), Format::Kml),
        ("b.kml", samples::placemarks().into_bytes(), Format::Kml),
        ("a.kmz", samples::zipped("doc.kml", &samples::kml()), Format::Kml),
        ("a.fdr", samples::fdr_4().into_bytes(), Format::Fdr),
        ("b.fdr", samples::fdr_3().into_bytes(), Format::Fdr),
        ("a.acmi", samples::acmi().into_bytes(), Format::Acmi),
        ("a.zip.acmi", samples::zipped("a.txt.acmi", &samples::acmi()), Format::Acmi),
        ("a.nmea", samples::nmea().into_bytes(), Format::Nmea),
        ("a.csv", samples::flightgear().into_bytes(), Format::FlightGear),
        ("b.csv", samples::adsb_csv().into_bytes(), Format::AdsbCsv),
        ("a.json", samples::adsb_json().into_bytes(), Format::AdsbJson),
        ("c.csv", samples::own_csv().into_bytes(), Format::Csv),
    ] {
        // Neither name nor ending is needed to know a format.
        for name in [file, "recording"] {
            let found = import(&bytes, name, &Options::default(), &|_, _| 48.5).unwrap();
            assert_eq!(found.format, format, "{file}");
            is_the_climb(&found, file);
        }
    }
}

fn is_the_climb(found: &Import, file: &str) {
    let curve = &found.flights[0];
    assert_eq!((found.flights.len(), curve.fixes), (1, 12), "{file}: {:?}", found.notes);
    // Half a step of 25 ft is 3.8 m, one of 0.001 minutes 0.9 m.
    let allowed_m = if found.format == Format::AdsbCsv { 4.5 } else { 1.4 };
    for second in 0..samples::SECONDS {
        let (lat, lon, height) = samples::place(second);
        let wanted = Geodetic::from_degrees(lat, lon, height + 48.5);
        let at = curve.place(f64::from(second));
        let body = Ellipsoid::WGS84;
        let off_m = body.ecef_from_geodetic(at).0.distance(body.ecef_from_geodetic(wanted).0);
        assert!(off_m < allowed_m, "{file}: {off_m} m off at {second} s");
    }
}

#[test]
fn attitudes_of_a_file_are_kept_and_others_are_those_of_a_coordinated_turn() {
    let pose = of(&samples::fdr_4(), "a.fdr").flights[0].pose(5.0);
    assert!((pose.heading.to_degrees() - 340.0).abs() < 0.3);
    assert!((pose.pitch.to_degrees() - 3.0).abs() < 0.3 && pose.roll.0.abs() < 0.005);
    // 60 m/s round a circle in 60 s: a bank of atan(v·2π/(60 s·g)) = 32.6°, to the right.
    let rate = std::f64::consts::TAU / 60.0;
    let radius_deg = 60.0 / rate / 111_195.0;
    let found = table((0..120).map(|i| {
        let t = f64::from(i);
        let (sin, cos) = (trig::sin(rate * t), trig::cos(rate * t));
        (t, radius_deg * sin, -radius_deg * cos, 1000.0)
    }));
    let curve = &found.flights[0];
    assert!(curve.estimated);
    for t in [20.0, 45.3, 71.7, 100.0] {
        let pose = curve.pose(t);
        let heading = (rate * t).to_degrees() % 360.0;
        assert!((pose.heading.to_degrees() - heading).abs() < 2.0, "{pose:?} at {t}");
        assert!((pose.roll.to_degrees() - 32.6).abs() < 1.5, "{pose:?} at {t}");
        assert!(pose.pitch.to_degrees().abs() < 0.5);
    }
}

#[test]
fn night_and_leap_seconds_pass_at_the_speed_of_time() {
    let times = ["235957", "235958", "235959", "235960", "000000", "000001", "000002"];
    let row = |(i, time): (usize, &&str)| {
        format!("B{time}46{:05}N01115000EA0200002000\n", 30000 + 20 * i)
    };
    let rows: String = times.iter().enumerate().map(row).collect();
    let found = of(&format!("AXXX\nHFDTE311216\nHFALG:GEO\n{rows}"), "a.igc");
    assert!(found.notes.is_empty(), "{:?}", found.notes);
    let (least, most) = spread(&speeds(&found.flights[0]));
    assert!(least > 35.0 && most < 39.0, "{least} to {most} m/s");
    assert_eq!(found.flights[0].duration_s(), 6.0);
    // The same in a file with whole dates.
    let row = |(i, time): (usize, &str)| format!("{time},46.{:06},11.25,2000\n", 500_000 + 300 * i);
    let times = ["2016-12-31T23:59:59Z", "2016-12-31T23:59:60Z", "2017-01-01T00:00:00Z"];
    let rows: String = times.into_iter().enumerate().map(row).collect();
    assert_eq!(of(&(HEAD.to_owned() + &rows), "a.csv").flights[0].duration_s(), 2.0);
}

#[test]
fn the_antimeridian_is_crossed_without_a_bump() {
    let found = table((0..40).map(|i| {
        let lon = 179.99 + 0.001 * f64::from(i);
        (f64::from(i), -17.0, if lon > 180.0 { lon - 360.0 } else { lon }, 300.0)
    }));
    assert!(found.notes.is_empty());
    let (least, most) = spread(&speeds(&found.flights[0]));
    assert!(most - least < 0.5 && most < 107.0, "{least} to {most} m/s");
    let heading = found.flights[0].pose(20.0).heading.to_degrees();
    assert!((heading - 90.0).abs() < 0.1, "{heading}");
}

#[test]
fn a_pole_is_flown_over_in_a_straight_line() {
    let found = table((0..41).map(|i| {
        let north = 0.02 - 0.001 * f64::from(i);
        (f64::from(i), 90.0 - north.abs(), if north > 0.0 { 30.0 } else { -150.0 }, 300.0)
    }));
    let curve = &found.flights[0];
    assert!(found.notes.is_empty(), "{:?}", found.notes);
    let (least, most) = spread(&speeds(curve));
    assert!(most - least < 1.0, "{least} to {most} m/s");
    let wings = |t: f64| {
        let pose = curve.pose(t);
        let axes = pose.at.enu_axes();
        let (sin, cos) = (trig::sin(pose.heading.0), trig::cos(pose.heading.0));
        axes.x_axis * sin + axes.y_axis * cos
    };
    // The nose keeps its direction in space, while the heading turns from north to south.
    assert!(wings(5.0).dot(wings(35.0)) > 0.9999, "{} {}", wings(5.0), wings(35.0));
    assert!(wings(19.9).dot(wings(20.1)) > 0.9999);
}

#[test]
fn who_stands_still_keeps_place_and_heading() {
    let east = |i: u32| match i {
        0..30 => f64::from(i),
        30..90 => 30.0,
        _ => f64::from(i) - 60.0,
    };
    let found = table((0..120).map(|i| (f64::from(i), 10.0, 20.0 + 1e-4 * east(i), 50.0)));
    let curve = &found.flights[0];
    assert_eq!((found.flights.len(), curve.fixes), (1, 120));
    let (a, b) = (curve.pose(45.0), curve.pose(75.0));
    let body = Ellipsoid::WGS84;
    let off_m = body.ecef_from_geodetic(a.at).0.distance(body.ecef_from_geodetic(b.at).0);
    assert!(off_m < 0.02, "{off_m} m");
    assert!((a.heading.to_degrees() - 90.0).abs() < 1.0, "{a:?}");
    assert!((b.heading.0 - a.heading.0).abs() < 1e-3 && b.roll.0.abs() < 0.01);
}

#[test]
fn fixes_of_one_time_and_times_that_go_back_are_left_out_and_counted() {
    let row = |i: u32| (f64::from(i), 10.0 + 3e-4 * f64::from(i), 20.0, 500.0);
    let mut rows: Vec<_> = (0..60).map(row).collect();
    rows.insert(20, rows[19]);
    rows.insert(40, row(30));
    rows.insert(50, (9000.0, 10.0, 20.0, 500.0));
    let found = table(rows);
    let said: Vec<_> = found.notes.iter().map(ToString::to_string).collect();
    for (part, line) in [("same time", 22), ("goes back", 42), ("runs ahead", 52)] {
        let note = said.iter().find(|note| note.contains(part)).expect(part);
        assert!(note.ends_with(&format!("line {line}")), "{note}");
    }
    assert_eq!((found.flights.len(), found.flights[0].fixes), (1, 60));
    let (least, most) = spread(&speeds(&found.flights[0]));
    assert!(least > 32.0 && most < 34.5, "{least} to {most} m/s");
}

#[test]
fn gaps_jumps_and_new_days_cut_a_file_into_flights() {
    let flight = |start: f64, lat: f64| {
        (0..50).map(move |i| (start + f64::from(i), lat + 3e-4 * f64::from(i), 20.0, 500.0))
    };
    let found = table(flight(0.0, 10.0).chain(flight(200.0, 10.1)).chain(flight(250.0, 11.0)));
    assert_eq!(found.flights.len(), 3);
    assert!(found.flights.iter().all(|flight| flight.fixes == 50));
    let said: String = found.notes.iter().map(|note| format!("{note}\n")).collect();
    assert!(said.contains("line 52: cut, since there is no fix for 151.0 s"), "{said}");
    assert!(said.contains("line 102: cut, since it jumps"), "{said}");
    let found = table(flight(500.0, 10.0).chain(flight(0.0, 10.0)));
    assert_eq!(found.flights.len(), 2);
    assert!(found.notes[0].to_string().contains("time goes back by 549.0 s"), "{:?}", found.notes);
    let options = Options { gap_s: Some(300.0), ..Options::default() };
    let rows: String = (0..40).map(|i| format!("{},{},20,500\n", i * 200, 10.0)).collect();
    let text = HEAD.to_owned() + &rows;
    let found = import(text.as_bytes(), "a.csv", &options, &|_, _| 0.0).unwrap();
    assert_eq!(found.flights.len(), 1);
}

#[test]
fn a_stray_fix_is_left_out() {
    let found = table((0..60).map(|i| {
        let lat = if i == 30 { 0.0 } else { 10.0 + 3e-4 * f64::from(i) };
        (f64::from(i), lat, 20.0, if i == 40 { 5000.0 } else { 500.0 })
    }));
    assert_eq!((found.flights.len(), found.flights[0].fixes), (1, 59));
    let height_m = found.flights[0].place(40.0).height_m;
    assert!((height_m - 500.0).abs() < 0.1, "{height_m}");
    assert_eq!(found.notes.len(), 2, "{:?}", found.notes);
}

#[test]
fn steps_of_a_metre_do_not_shake_the_eye() {
    let climb = |t: f64| 500.0 + 0.3 * t + 8.0 * trig::sin(t / 25.0);
    let row = |i: u32| {
        let t = f64::from(i);
        let (minutes, seconds) = (i / 60, i % 60);
        let lat = 46.0 * 60.0 + 30.0 + 0.0162 * t;
        format!(
            "B10{minutes:02}{seconds:02}46{:05.0}N01115000EA00000{:05.0}\n",
            (lat - 46.0 * 60.0) * 1000.0,
            climb(t)
        )
    };
    let rows: String = (0..600).map(row).collect();
    let found = of(&format!("AXXX\nHFDTE150724\nHFALG:GEO\n{rows}"), "a.igc");
    let curve = &found.flights[0];
    let heights: Vec<f64> = curve.poses(10.0).map(|pose| pose.at.height_m).collect();
    let bends = heights.windows(3).map(|h| (h[0] - 2.0 * h[1] + h[2]) * 100.0);
    let squares: Vec<f64> = bends.map(|bend| bend * bend).collect();
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    // The true climb bends by 0.009 m/s² rms; numbers taken as they stand by more than 1.
    assert!(rms < 0.08, "{rms} m/s²");
    for (i, height) in heights.iter().enumerate() {
        assert!((height - climb(i as f64 / 10.0)).abs() < 0.75, "{height} at {i}");
    }
    let (least, most) = spread(&speeds(curve));
    assert!(least > 29.5 && most < 30.8, "{least} to {most} m/s");
}

#[test]
fn a_landing_does_not_sink_into_the_runway() {
    for (sink_mps, step_s) in [(3.0, 0.1), (3.0, 1.0), (15.0, 2.0)] {
        let found = table((0..100).map(|i| {
            let t = step_s * f64::from(i);
            let left_s = (step_s * 50.0 - t).max(0.0);
            (t, 10.0 + 5e-4 * t, 20.0, 100.0 + sink_mps * left_s)
        }));
        let heights = found.flights[0].poses(50.0).map(|pose| pose.at.height_m);
        let lowest = heights.fold(f64::INFINITY, f64::min);
        assert!(lowest > 99.89, "{lowest} m at {sink_mps} m/s");
    }
}

#[test]
fn a_lift_keeps_clear_of_the_ground_and_moves_nothing_else() {
    let mut found =
        table((0..200).map(|i| (f64::from(i), 10.0 + 5e-4 * f64::from(i), 20.0, 100.0)));
    let ground = |at: Geodetic| {
        let along_deg = at.lat_rad.to_degrees() - 10.05;
        if along_deg.abs() < 0.01 { 103.0 - along_deg.abs() * 200.0 } else { 0.0 }
    };
    let curve = &mut found.flights[0];
    let before = curve.clone();
    let most_m = curve.lift_over(1.5, [0.25, 4.0], &mut |at| ground(at));
    assert!((most_m - 4.5).abs() < 0.1, "{most_m}");
    for pose in curve.poses(4.0) {
        assert!(pose.at.height_m - ground(pose.at) > 1.5 - 1e-3, "{pose:?}");
    }
    assert_eq!(curve.place(10.0), before.place(10.0));
    assert_eq!(curve.lift_over(1.5, [0.25, 4.0], &mut |_| f64::NAN), 0.0);
}

#[test]
fn what_altitudes_are_above_is_declared_assumed_or_asked_for() {
    let undulation = |_, _| 48.5;
    let at = |text: &str, file: &str, altitude| {
        let options = Options { altitude, ..Options::default() };
        import(text.as_bytes(), file, &options, &undulation)
            .map(|found| (found.flights[0].place(0.0).height_m.round(), found.assumed))
    };
    let igc = samples::igc();
    let cases = [
        (igc.clone(), Altitude::Auto, 2049.0, "HFALG says GEO"),
        (igc.replace(":GEO", ":ELL"), Altitude::Auto, 2000.0, "HFALG says ELL"),
        (igc.replace("HFALGALTGPS:GEO", "HFPLT:X"), Altitude::Auto, 2049.0, "no approved maker"),
        (
            igc.replace("HFALGALTGPS:GEO", "HFPLT:X").replace("AXXX", "ALXN"),
            Altitude::Auto,
            2000.0,
            "approved recorders",
        ),
        (igc.clone(), Altitude::Above(Datum::Ellipsoid), 2000.0, "--altitude says so"),
        (igc.clone(), Altitude::Above(Datum::Pressure), 2029.0, "--altitude says so"),
    ];
    for (text, altitude, height_m, why) in cases {
        let (found, assumed) = at(&text, "a.igc", altitude).unwrap();
        assert!((found - height_m).abs() <= 1.0 && assumed.contains(why), "{found}: {assumed}");
    }
    let table = samples::own_csv();
    let unknown = table.replace("alt_msl_m", "altitude_m");
    let asked = at(&unknown, "a.csv", Altitude::Auto).unwrap_err().to_string();
    assert!(asked.contains("--altitude msl, ellipsoid or pressure"), "{asked}");
    assert_eq!(at(&unknown, "a.csv", Altitude::Above(Datum::Msl)).unwrap().0, 2049.0);
    let ellipsoid = table.replace("alt_msl_m", "alt_ellipsoid_m");
    assert_eq!(at(&ellipsoid, "a.csv", Altitude::Auto).unwrap().0, 2000.0);
    let relative = samples::kml().replace("absolute", "relativeToGround");
    let asked = at(&relative, "a.kml", Altitude::Auto).unwrap_err().to_string();
    assert!(asked.contains("relativeToGround"), "{asked}");
}

#[test]
fn faults_name_line_column_field_value_and_what_is_allowed() {
    let row = "09:00:05.00, 11.2, 96.5, 6600, 340, 3, 0";
    for (text, file, parts) in [
        (
            samples::with_line(&samples::fdr_4(), 8, row),
            "a.fdr",
            ["line 8, column 20", "latitude", "\"96.5\"", "-90 to 90"],
        ),
        (
            HEAD.to_owned() + "0,1,2,3\n1,1,2,high\n",
            "a.csv",
            ["line 3, column 7", "height", "\"high\"", "a number"],
        ),
        (
            "AXXX\nHFDTE150724\nHFALG:GEO\nB1000004660000N01115000EA0000000000\n".into(),
            "a.igc",
            ["line 4, column 8", "latitude", "\"4660000\"", "DDMMmmm"],
        ),
        (
            samples::adsb_json().replace("46.50020", "\"x\""),
            "a.json",
            ["line 3, column", "latitude", "\"x\"", "-90 to 90"],
        ),
        (samples::kml()[..400].into(), "a.kml", ["line 12", "XML", "", "well-formed"]),
        ("time,lat\n".into(), "a.csv", ["line 1, column 1", "title", "time,lat", "longitudes"]),
    ] {
        let few = if file == "a.fdr" {
            text.lines().take(10).collect::<Vec<_>>().join("\n")
        } else {
            text
        };
        let found = if file == "a.json" {
            let json = few.split("},").take(3).collect::<Vec<_>>().join("},") + "}]";
            error(&json, file)
        } else {
            error(&few, file)
        };
        for part in parts {
            assert!(found.contains(part), "{file}: {found} lacks {part}");
        }
    }
}

#[test]
fn one_bad_record_of_many_is_left_out_and_named() {
    let text =
        samples::with_line(&samples::own_csv(), 6, "2024-07-15T09:00:04.000Z,46.5,x,1,0,0,0");
    let found = of(&text, "a.csv");
    assert_eq!((found.fault_count, found.flights[0].fixes), (1, 11));
    assert_eq!(
        found.faults[0].to_string(),
        "line 6, column 31: longitude is \"x\", expected a number, -180 to 360"
    );
    let nmea = samples::nmea().replacen("*", "1*", 1);
    assert!(of(&nmea, "a.nmea").faults[0].to_string().contains("check sum"));
}

#[test]
fn several_aircraft_in_a_file_are_several_flights() {
    let csv = samples::adsb_csv();
    let rows: String =
        csv.lines().skip(1).map(|row| row.replace("3c6444", "4400ff") + "\n").collect();
    let found = of(&(csv + &rows), "a.csv");
    let names: Vec<_> = found.flights.iter().map(|flight| flight.name.as_str()).collect();
    assert_eq!(names, ["3c6444", "4400ff"]);
    let acmi =
        samples::acmi().replace("#6\n", "b2,T=0.5|0.5|10,Name=Tank\n#6\nb2,T=0.5001|0.5|10\n");
    let found = of(&acmi, "a.acmi");
    assert_eq!(found.flights.len(), 2);
    assert_eq!(found.flights[1].name, "Tank");
    assert_eq!(found.longest(), 0);
}

#[test]
fn other_ways_of_writing_ads_b_are_read_too() {
    let flightradar = (0..20).map(|i| {
        let (lat, feet) = (46.5 + 2e-3 * f64::from(i), 6000 + 100 * i);
        format!(
            "{},2024-07-15T09:00:{i:02}Z,DLH1,\"{lat:.5},11.25\",{feet},300,0\n",
            1_721_034_000 + i
        )
    });
    let head = "Timestamp,UTC,Callsign,Position,Altitude,Speed,Direction\n".to_owned();
    let found = of(&(head + &flightradar.collect::<String>()), "a.csv");
    assert_eq!((found.format, found.flights[0].fixes), (Format::AdsbCsv, 20));
    let at = found.flights[0].place(10.0);
    assert!((at.lat_rad.to_degrees() - 46.52).abs() < 1e-5 && (at.height_m - 2133.6).abs() < 4.0);
    let rows: Vec<_> = (0..20)
        .map(|i| format!("[{},46.5{i:02},11.25,2000.0,0.0,false]", 1_721_034_000 + i))
        .collect();
    let path = format!("{{\"icao24\":\"3c6444\",\"path\":[{}]}}", rows.join(","));
    let found = of(&path, "a.json");
    assert_eq!((found.format, found.flights[0].fixes), (Format::AdsbJson, 20));
    assert!((found.flights[0].place(10.0).height_m - 2000.0).abs() < 0.1);
    let lines = samples::adsb_json().replace(['[', ']'], "").replace("},", "}");
    assert_eq!(of(&lines, "a.json").flights[0].fixes, 12);
}

#[test]
fn what_is_no_flight_is_refused_in_words() {
    assert!(error("Dear diary, it rained.", "a.txt").contains("column of times"));
    assert!(error("hello", "a.txt").contains("none of the formats"));
    assert!(error("", "a.igc").contains("begins with"), "{}", error("", "a.igc"));
    assert!(error("<svg></svg>", "a.svg").contains("none of the formats"));
    let gpx =
        "<gpx><trk><trkseg><trkpt lat=\"1\" lon=\"2\"><ele>3</ele></trkpt></trkseg></trk></gpx>";
    assert!(error(gpx, "a.gpx").contains("has a time"));
    assert!(error("PK\u{3}\u{4}nonsense", "a.zip").contains("zip archive"));
}
