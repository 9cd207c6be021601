//! One flight in ten encodings: each imports to the same track within its own steps.
//!
//! In:    `../shared/data/flights`, beside the repository; skipped by name where it is not there.
//! Out:   passes or fails; errors of each encoding, printed.
//! Keeps: the geoid along the flight.
//! Not here: what cannot be read (`mutations`), odd recordings (`recordings`).

use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_replay::Pose;
use overfly_tracks::{Import, Options, import};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

fn data(test: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let found = folder.is_dir();
    if !found {
        println!("{test} skipped: no ../shared/data");
    }
    found.then_some(folder.join("flights"))
}

/// EGM96 at the corners of squares of a quarter of a degree, bilinear between them, as overfly's
/// own geoid.
struct Geoid(RefCell<BTreeMap<[i32; 2], f64>>);

impl Geoid {
    fn corner(&self, corner: [i32; 2]) -> f64 {
        let [lat, lon] = corner.map(|quarter| f64::from(quarter) / 4.0);
        let summed = || egm96::egm96_compute_altitude_offset(lat, lon);
        *self.0.borrow_mut().entry(corner).or_insert_with(summed)
    }

    #[expect(clippy::cast_possible_truncation, reason = "720 quarters of a degree at most")]
    fn at(&self, lat_rad: f64, lon_rad: f64) -> f64 {
        let [lat, lon] = [lat_rad, lon_rad].map(|angle| angle.to_degrees() * 4.0);
        let [row, column] = [lat, lon].map(|quarters| quarters.floor() as i32);
        let (u, v) = (lon - f64::from(column), lat - f64::from(row));
        let side =
            |row| self.corner([row, column]) * (1.0 - u) + self.corner([row, column + 1]) * u;
        side(row) * (1.0 - v) + side(row + 1) * v
    }
}

/// A row of the log: time, place above the ellipsoid, heading, pitch, roll.
type Row = (f64, Geodetic, [f64; 3]);

fn log(folder: &Path, geoid: &Geoid) -> Vec<Row> {
    let text = fs::read_to_string(folder.join("c172_10hz.csv")).unwrap();
    let row = |(i, line): (usize, &str)| {
        let n: Vec<f64> = line.split(',').skip(1).map(|field| field.parse().unwrap()).collect();
        let at = Geodetic::from_degrees(n[0], n[1], 0.0);
        let height_m = n[2] + geoid.at(at.lat_rad, at.lon_rad);
        let angles = [n[3], n[4], n[5]].map(f64::to_radians);
        (i as f64 / 10.0, Geodetic { height_m, ..at }, angles)
    };
    text.lines().skip(1).enumerate().map(row).collect()
}

/// Root mean squares: north, east, up in metres; heading, pitch, roll in degrees; and the worst of
/// the last three.
#[derive(Debug, Default)]
struct Errors {
    place_m: [f64; 3],
    attitude_deg: [f64; 3],
    worst_deg: f64,
}

fn errors<'r>(import: &Import, rows: impl Iterator<Item = &'r Row>) -> Errors {
    let mut sums = [0.0; 6];
    let (mut count, mut worst_deg) = (0.0_f64, 0.0_f64);
    let start_ns = import.flights[0].start_ns;
    for (time_s, at, angles) in rows {
        let of = |flight: &&overfly_tracks::Curve| {
            let begin_s = (flight.start_ns - start_ns) as f64 / 1e9;
            (begin_s - 1e-9..=begin_s + flight.duration_s() + 1e-9).contains(time_s)
        };
        let Some(flight) = import.flights.iter().find(of) else { continue };
        let Pose { at: found, heading, pitch, roll, .. } =
            flight.pose(time_s - (flight.start_ns - start_ns) as f64 / 1e9);
        let body = Ellipsoid::WGS84;
        let off = body.ecef_from_geodetic(found).0 - body.ecef_from_geodetic(*at).0;
        let local = at.enu_axes().transpose() * off;
        for (sum, off) in sums.iter_mut().zip([local.y, local.x, local.z]) {
            *sum += off * off;
        }
        for (i, (found, wanted)) in [heading.0, pitch.0, roll.0].into_iter().zip(angles).enumerate()
        {
            let off = (found - wanted).to_degrees();
            let off = off - 360.0 * (off / 360.0).round();
            sums[3 + i] += off * off;
            worst_deg = worst_deg.max(off.abs());
        }
        count += 1.0;
    }
    let rms = |i: usize| (sums[i] / count).sqrt();
    assert!(count > 100.0, "only {count} rows compared");
    Errors {
        place_m: core::array::from_fn(rms),
        attitude_deg: core::array::from_fn(|i| rms(i + 3)),
        worst_deg,
    }
}

/// File, seconds between its fixes, half steps of latitude, longitude (in degrees) and height (in
/// metres), whether it has attitudes.
type Encoding = (&'static str, usize, [f64; 3], bool);

const MINUTE_DEG: f64 = 1.0 / 60.0;
const FOOT_M: f64 = 0.3048;

/// The log has steps of its own, 1e-8° and 1 mm, which an encoding cannot undercut.
const ENCODINGS: [Encoding; 10] = [
    ("c172_10hz.csv", 1, [0.5e-8, 0.5e-8, 0.5e-3], true),
    ("flight_ell.igc", 10, [0.5e-3 * MINUTE_DEG, 0.5e-3 * MINUTE_DEG, 0.5], false),
    ("flight_geo.igc", 10, [0.5e-3 * MINUTE_DEG, 0.5e-3 * MINUTE_DEG, 0.5], false),
    ("flight.gpx", 10, [0.5e-8, 0.5e-8, 0.5e-3], false),
    ("flight.kml", 10, [0.5e-8, 0.5e-8, 0.5e-3], true),
    ("flight_v4.fdr", 1, [0.5e-8, 0.5e-8, 0.5e-3], true),
    ("flight.txt.acmi", 1, [0.5e-7, 0.5e-7, 0.5e-2], true),
    ("flight.nmea", 10, [0.5e-5 * MINUTE_DEG, 0.5e-5 * MINUTE_DEG, 0.05], false),
    ("flight_fg_generic.csv", 1, [0.5e-8, 0.5e-8, 0.5e-3], true),
    ("flight_adsb.csv", 50, [0.5e-5, 0.5e-5, 12.5 * FOOT_M], false),
];

#[test]
fn the_ten_encodings_of_rainier_import_to_one_track_within_their_own_half_steps() {
    let test = "the_ten_encodings_of_rainier_import_to_one_track_within_their_own_half_steps";
    let Some(folder) = data(test).map(|folder| folder.join("rainier")) else { return };
    let geoid = Geoid(RefCell::default());
    let log = log(&folder, &geoid);
    assert_eq!(log.len(), 6001);
    for (file, every, half, has_attitudes) in ENCODINGS {
        let bytes = fs::read(folder.join(file)).unwrap();
        let undulation = |lat, lon| geoid.at(lat, lon);
        let found = import(&bytes, file, &Options::default(), &undulation).unwrap();
        println!("{file}: {}; {:?}", found.assumed, found.notes);
        let fixes: Vec<f64> = found
            .flights
            .iter()
            .flat_map(|f| {
                let begin_s = (f.start_ns - found.flights[0].start_ns) as f64 / 1e9;
                f.times_s().iter().map(move |t| begin_s + t)
            })
            .collect();
        // A file with gaps has fewer fixes than the log has rows for it.
        let is_fix = |time_s: f64| fixes.iter().any(|fix| (fix - time_s).abs() < 1e-6);
        let at_fixes = errors(&found, log.iter().step_by(every).filter(|row| is_fix(row.0)));
        let between = errors(&found, log.iter());
        println!("  at fixes {at_fixes:.4?}\n  between  {between:.4?}");
        let metre = [111_200.0, 76_500.0, 1.0];
        for axis in 0..3 {
            let half_m = half[axis] * metre[axis];
            let rms = at_fixes.place_m[axis];
            assert!(rms <= half_m, "{file}: axis {axis}: rms {rms} m, half {half_m} m");
        }
        assert_eq!(found.flights.iter().all(|flight| !flight.estimated), has_attitudes, "{file}");
        if has_attitudes {
            assert!(at_fixes.worst_deg <= 0.5, "{file}: {at_fixes:?}");
        } else {
            let [heading, pitch, roll] = at_fixes.attitude_deg;
            assert!(heading < 3.0 && pitch < 5.0 && roll < 4.0, "{file}: {at_fixes:?}");
        }
    }
}

/// Root mean squares of accelerations at 10 Hz: along the vertical, and in space.
fn accelerations(flight: &overfly_tracks::Curve) -> (f64, f64) {
    let poses: Vec<Pose> = flight.poses(10.0).collect();
    let body = Ellipsoid::WGS84;
    let (mut vertical, mut whole) = (0.0, 0.0);
    for near in poses.windows(3) {
        let [a, b, c] = [0, 1, 2].map(|i| body.ecef_from_geodetic(near[i].at).0);
        let bend = ((c - b) - (b - a)) * 100.0;
        let up = bend.dot(near[1].at.normal());
        vertical += up * up;
        whole += bend.length_squared();
    }
    let count = (poses.len() - 2) as f64;
    ((vertical / count).sqrt(), (whole / count).sqrt())
}

#[test]
fn all_real_igc_files_import() {
    let Some(folder) = data("all_real_igc_files_import") else { return };
    let mut files: Vec<_> =
        fs::read_dir(folder.join("igc")).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert_eq!(files.len(), 6);
    for path in files {
        let file = path.file_name().unwrap().to_string_lossy().into_owned();
        let bytes = fs::read(&path).unwrap();
        let found = import(&bytes, &file, &Options::default(), &|_, _| 48.0).unwrap();
        println!("{file}: {}", found.assumed);
        for note in &found.notes {
            println!("  {note}");
        }
        for fault in &found.faults {
            println!("  {fault}");
        }
        for flight in &found.flights {
            let (vertical, whole) = accelerations(flight);
            let (fixes, seconds) = (flight.fixes, flight.duration_s());
            println!(
                "  {fixes} fixes, {seconds:.0} s, rms {vertical:.2} up, {whole:.2} m/s² in all"
            );
            // Gliders circle with banks of up to 35°, which is 6.9 m/s².
            let is_real = fixes > 100;
            assert!(
                !is_real || (vertical < 1.0 && whole < 6.9),
                "{file}: {vertical}, {whole} m/s²"
            );
        }
        assert_eq!(found.fault_count, 0, "{file}: {:?}", found.faults);
        let expected = match file.as_str() {
            "flight_with_middle_landing.igc" => 3,
            "bad-line.igc" => 2,
            _ => 1,
        };
        assert_eq!(found.flights.len(), expected, "{file}");
    }
}
