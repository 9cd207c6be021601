//! What programs and receivers make of the formats in their own ways; archives, encodings.
//!
//! In:    short files in the style of each, written here.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: odd times and places (`recordings`), damaged files (`mutations`), real ones (`rainier`).

mod samples;

use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_tracks::{Format, Import, Options, import};

fn of(bytes: &[u8]) -> Import {
    import(bytes, "recording", &Options::default(), &|_, _| 48.5)
        .unwrap_or_else(|error| panic!("{error}"))
}

fn error(bytes: &[u8]) -> String {
    import(bytes, "recording", &Options::default(), &|_, _| 48.5).unwrap_err().to_string()
}

fn is_the_climb(bytes: &[u8], format: Format) {
    let found = of(bytes);
    let curve = &found.flights[found.longest()];
    let what = format!("{format:?}: {} {:?} {:?}", found.assumed, found.notes, found.faults);
    assert_eq!((found.format, curve.fixes, found.fault_count), (format, 12, 0), "{what}");
    for second in 0..samples::SECONDS {
        let (lat, lon, height) = samples::place(second);
        let wanted = Geodetic::from_degrees(lat, lon, height + 48.5);
        let body = Ellipsoid::WGS84;
        let at = body.ecef_from_geodetic(curve.place(f64::from(second))).0;
        let off_m = at.distance(body.ecef_from_geodetic(wanted).0);
        assert!(off_m < 1.4, "{off_m} m off at {second} s; {what}");
    }
    let start_s = curve.start_ns / 1_000_000_000;
    assert!(start_s == 1_721_034_000 || format == Format::FlightGear, "{start_s}; {what}");
}

#[test]
fn writers_have_their_own_ways() {
    is_the_climb(samples::fdr_1().as_bytes(), Format::Fdr);
    is_the_climb(samples::fdr_3().as_bytes(), Format::Fdr);
    is_the_climb(samples::base_station().as_bytes(), Format::BaseStation);
    is_the_climb(samples::snapshots().as_bytes(), Format::AdsbJson);
    is_the_climb(samples::states().as_bytes(), Format::AdsbJson);
    is_the_climb(samples::columns_json().as_bytes(), Format::AdsbJson);
    is_the_climb(samples::gps_dump().as_bytes(), Format::Kml);
    is_the_climb(samples::arrays_kml().as_bytes(), Format::Kml);
    is_the_climb(samples::foreflight().as_bytes(), Format::Csv);
    is_the_climb(samples::g1000().as_bytes(), Format::Csv);
    is_the_climb(samples::semicolons().as_bytes(), Format::Csv);
    is_the_climb(samples::terminal().as_bytes(), Format::Nmea);
    let spans = samples::placemarks()
        .replace("<TimeStamp><when>", "<TimeSpan><begin>")
        .replace("</when></TimeStamp>", "</begin><end>2025-01-01T00:00:00Z</end></TimeSpan>");
    is_the_climb(spans.as_bytes(), Format::Kml);
    let pieces = spans
        .replace("<Point>", "<LineString>")
        .replace("</coordinates></Point>", " 11,46,0</coordinates></LineString>");
    is_the_climb(pieces.as_bytes(), Format::Kml);
    let dashes = samples::igc().replace("HFDTEDATE:150724", "HFDTEDATE: 15-07-24");
    is_the_climb(dashes.replace("\nB", "\n B").as_bytes(), Format::Igc);
}

#[test]
fn archives_and_encodings_are_taken_off() {
    let igc = samples::igc();
    is_the_climb(&samples::gzipped(igc.as_bytes()), Format::Igc);
    let twice =
        [samples::gzipped(&igc.as_bytes()[..200]), samples::gzipped(&igc.as_bytes()[200..])];
    is_the_climb(&twice.concat(), Format::Igc);
    is_the_climb(&samples::gzipped(&samples::zipped("a.igc", &igc)), Format::Igc);
    for mark in ["\u{FEFF}", ""] {
        is_the_climb(&samples::utf_16(&samples::own_csv(), mark), Format::Csv);
        let swapped: Vec<u8> = samples::utf_16(&samples::gpx(), mark)
            .chunks_exact(2)
            .flat_map(|pair| [pair[1], pair[0]])
            .collect();
        is_the_climb(&swapped, Format::Gpx);
    }
    let cut = samples::gzipped(igc.as_bytes());
    assert!(error(&cut[..cut.len() / 2]).starts_with("gzip: "), "{}", error(&cut[..cut.len() / 2]));
}

#[test]
fn what_macs_put_into_archives_is_no_flight() {
    let mut writer = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in [
        ("__MACOSX/._a.igc", &[0_u8, 5, 22, 7][..]),
        ("._a.igc", &[0, 5, 22, 7][..]),
        ("a.igc", samples::igc().as_bytes()),
    ] {
        writer.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        std::io::Write::write_all(&mut writer, bytes).unwrap();
    }
    is_the_climb(&writer.finish().unwrap().into_inner(), Format::Igc);
}

#[test]
fn angles_in_arrays_and_tables_are_those_of_the_file() {
    for text in [samples::arrays_kml(), samples::foreflight(), samples::g1000()] {
        let flight = &of(text.as_bytes()).flights[0];
        let pose = flight.pose(5.0);
        let angles = [pose.heading, pose.pitch, pose.roll].map(|angle| angle.to_degrees());
        let off = angles.iter().zip([340.0, 3.0, -7.0]).map(|(a, b)| (a - b).abs());
        assert!(!flight.estimated && off.fold(0.0, f64::max) < 0.1, "{angles:?}");
    }
}

#[test]
fn a_pitch_and_roll_that_never_change_in_a_climb_are_none() {
    let rows = |roll: &dyn Fn(u32) -> u32| -> String {
        let row = |i: u32| {
            let (lat, metres) = (46.5 + 3e-4 * f64::from(i), 500 + 3 * i);
            format!("{i},{lat:.6},11.25,{metres},0,2,{}\n", roll(i))
        };
        let head = "time_s,lat_deg,lon_deg,alt_msl_m,heading_deg,pitch_deg,roll_deg\n".to_owned();
        head + &(0..60).map(row).collect::<String>()
    };
    assert!(of(rows(&|_| 1).as_bytes()).flights[0].estimated);
    assert!(!of(rows(&|i| i % 2).as_bytes()).flights[0].estimated);
}

#[test]
fn places_that_receivers_repeat_do_not_stop_the_flight() {
    let row = |i: u32| {
        let seen = i - i % 5;
        let lat = 46.5 + 1e-4 * f64::from(seen);
        (seen, format!("{},3c6444,{lat:.5},11.25,2000.0", 1_721_034_000 + i))
    };
    let plain: String = (0..60).map(|i| row(i).1 + "\n").collect();
    let dated: String =
        (0..60).map(|i| format!("{},{}.0\n", row(i).1, 1_721_034_000 + row(i).0)).collect();
    for text in [
        "time,icao24,lat,lon,baroaltitude\n".to_owned() + &plain,
        "time,icao24,lat,lon,baroaltitude,lastposupdate\n".to_owned() + &dated,
    ] {
        let flight = &of(text.as_bytes()).flights[0];
        assert_eq!(flight.fixes, 12);
        let places: Vec<_> = flight.poses(1.0).map(|pose| pose.at.lat_rad.to_degrees()).collect();
        assert!(places.windows(2).all(|pair| (pair[1] - pair[0] - 1e-4).abs() < 2e-5));
    }
    let doubled: String = (0..30)
        .flat_map(|i| [(i, 0), (i, 200)])
        .map(|(i, ms)| {
            let lat = 46.5 + 6e-4 * f64::from(i);
            format!(
                "2024-07-15 09:00:{i:02}Z.{ms:03},3c6444,X,{lat:.5},{:.5},6000\n",
                11.25 + f64::from(ms) * 1e-6
            )
        })
        .collect();
    let found =
        of(("time,hex,callsign,latitude,longitude,altitude\n".to_owned() + &doubled).as_bytes());
    assert_eq!((found.flights[0].fixes, found.fault_count), (30, 0));
}

#[test]
fn transponders_may_be_listed_from_the_last_place_to_the_first() {
    let csv = samples::adsb_csv();
    let (head, rows) = csv.split_once('\n').unwrap();
    let turned: Vec<_> = rows.lines().rev().collect();
    let flight = &of(format!("{head}\r\n{}\r\n", turned.join("\r\n")).as_bytes()).flights[0];
    assert_eq!((flight.fixes, flight.lines), (12, [13, 2]));
    let record = |second: u32| {
        let (lat, lon, height) = samples::place(second);
        let (at, feet) = (1_721_034_000 + second, height / 0.3048);
        format!(
            "{{\"lat\":{lat:.6},\"lng\":{lon:.6},\"alt\":{feet:.0},\"spd\":97,\"ts\":{at},\"hd\":340}}"
        )
    };
    let trail: Vec<_> = (0..samples::SECONDS).rev().map(record).collect();
    let json = format!("{{\"identification\":{{}},\"trail\":[{}]}}", trail.join(","));
    is_the_climb(json.as_bytes(), Format::AdsbJson);
}

#[test]
fn heights_that_lack_follow_the_pressure_altitude() {
    let row = |i: u32| {
        let (lat, feet) = (46.5 + 2e-3 * f64::from(i), 3000 + 50 * i);
        let geometric =
            if (10..30).contains(&i) { "null".to_owned() } else { (feet + 300).to_string() };
        format!("[{i},{lat:.5},11.25,{feet},300,0,0,600,null,\"adsb\",{geometric}]")
    };
    let rows: Vec<_> = (0..40).map(row).collect();
    let json =
        format!("{{\"icao\":\"a\",\"timestamp\":1721034000,\"trace\":[{}]}}", rows.join(","));
    let found = of(json.as_bytes());
    let height_m = found.flights[0].place(20.0).height_m;
    assert!((height_m - 4300.0 * 0.3048).abs() < 1.0, "{height_m}");
    assert!(found.assumed.contains("for 20 that lack"), "{}", found.assumed);
    assert_eq!(found.flights[0].heights_missing, 0);
}

#[test]
fn tacviews_objects_have_names_before_places_and_types() {
    let ship = "#0\nb2,T=0.5|0.5|0,Type=Sea+Watercraft,Name=Ship\n";
    let more = "#300\nb2,T=0.5001|0.5|\n#301\nb2,T=0.5002|0.5|\n";
    let text = samples::acmi()
        .replace("#0\n", &format!("a1,Name=Glider\\, red,Type=Air+FixedWing\n{ship}"))
        .replace(",Name=Glider\\, red,Type=Air+FixedWing\n#1", "\n#1")
        .replace("-a1\n", more);
    let options = Options { gap_s: Some(600.0), ..Options::default() };
    let found = import(text.as_bytes(), "a.acmi", &options, &|_, _| 0.0).unwrap();
    let longest = &found.flights[found.longest()];
    assert_eq!((found.flights.len(), longest.name.as_str()), (2, "Glider, red"));
    let word = samples::acmi().replace("a1,T=", "x0001,T=").replace(",Type", ",Pilot=Ann,Type");
    assert_eq!(of(word.as_bytes()).flights[0].name, "Glider, red, Ann");
    assert!(found.flights.iter().any(|flight| flight.is_aside && flight.duration_s() > 300.0));
    let old = samples::acmi().replace("FileVersion=2.2", "FileVersion=1.5");
    assert!(error(old.as_bytes()).contains("line 2, column 13: FileVersion is \"1.5\""));
}

#[test]
fn a_geoid_that_is_0_throughout_is_none() {
    let zero = samples::nmea().replace(",M,48.5,M,,", ",M,0.0,M,,");
    let bare: String =
        zero.lines().map(|line| line.split('*').next().unwrap().to_owned() + "\n").collect();
    is_the_climb(bare.as_bytes(), Format::Nmea);
    assert!(of(bare.as_bytes()).assumed.contains("EGM96"));
}

#[test]
fn headings_that_are_magnetic_are_said_to_be() {
    let said = |text: String| of(text.as_bytes()).notes.iter().any(|n| n.what.contains("magnetic"));
    assert_eq!(
        [samples::fdr_1(), samples::fdr_3(), samples::fdr_4()].map(said),
        [false, true, true]
    );
}

#[test]
fn positions_without_times_or_heights_are_refused_in_words() {
    let points = "<gpx><wpt lat=\"1\" lon=\"2\"><time>2024-07-15T09:00:00Z</time></wpt></gpx>";
    assert!(error(points.as_bytes()).contains("its 1 waypoints are none"));
    let line = "<kml><Placemark><LineString><coordinates>1,2,3 2,3,4</coordinates></LineString></Placemark></kml>";
    assert!(error(line.as_bytes()).contains("lines and points has a time"));
    let bare: String = samples::terminal()
        .lines()
        .filter(|line| line.contains("RMC"))
        .map(|line| format!("{line}\n"))
        .collect();
    assert!(error(bare.as_bytes()).contains("no fix in it has an altitude"));
}
