//! What the bundled flights promise: where they go, that they are smooth, that they repeat.
//!
//! In:    flights over made-up grounds and bodies of several sizes.
//! Out:   assertions.
//! Keeps: nothing.
//! Not here: the file format (`format`).

use core::f64::consts::{FRAC_PI_2, PI};
use glam::{DQuat, DVec3};
use overfly_core::camera::orientation_from_attitude;
use overfly_core::geodesy::trig::{cos, sin};
use overfly_core::geodesy::{Ellipsoid, Geodetic};
use overfly_core::settings::LensSettings;
use overfly_core::units::Radians;
use overfly_replay::resample::{flight_from_csv, rows_from_csv};
use overfly_replay::{BUNDLED, Flight, Frame, Pose, Reader, bundled, flight, view_of};
use std::path::Path;

const TINY: Ellipsoid = Ellipsoid { a_m: 1000.0, f: 0.0 };
const BODIES: [Ellipsoid; 4] = [Ellipsoid::WGS84, Ellipsoid::MOON, Ellipsoid::MARS, TINY];

/// Hills, coasts and bumps; in proportion to the body, but for the bumps.
fn ground(body: Ellipsoid) -> impl Fn(Geodetic) -> f64 {
    move |at| {
        let n = at.normal();
        let wave = |k: f64| sin(k * n.x + 1.0) + sin(k * n.y + 2.0) + sin(k * n.z + 3.0);
        let bumps_m = 0.02 * sin(at.lat_rad * body.a_m / 0.7);
        body.a_m / 6.4e6 * (400.0 * wave(5.0) + 300.0 * wave(200.0) + 20.0 * wave(3000.0)) + bumps_m
    }
}

fn ecef(pose: &Pose, body: &Ellipsoid) -> DVec3 {
    body.ecef_from_geodetic(pose.at).0
}

fn orientation(pose: &Pose) -> DQuat {
    orientation_from_attitude(pose.at, pose.heading, pose.pitch, pose.roll)
}

/// The angle between two orientations in radians, exact for small ones.
fn angle_between(a: DQuat, b: DQuat) -> f64 {
    let between = a.conjugate() * b;
    2.0 * DVec3::new(between.x, between.y, between.z).length()
}

#[test]
fn every_bundled_flight_has_a_name_and_unknown_names_have_none() {
    for name in BUNDLED {
        let flight = bundled(name).unwrap();
        assert_eq!((flight.name.as_str(), flight.rate_hz), (name, 60.0));
    }
    assert!(bundled("nowhere").is_none());
}

#[test]
fn every_flight_is_finite_and_smooth_on_every_body() {
    for body in BODIES {
        for name in BUNDLED {
            let flight = flight(name, &body, &ground(body)).unwrap();
            check_smooth(&flight, &body);
        }
    }
}

fn check_smooth(flight: &Flight, body: &Ellipsoid) {
    let name = &flight.name;
    for (i, pose) in flight.poses.iter().enumerate() {
        let at = pose.at;
        for value in
            [at.lat_rad, at.lon_rad, at.height_m, pose.heading.0, pose.pitch.0, pose.roll.0]
        {
            assert!(value.is_finite(), "{name} {i}: {pose:?}");
        }
        assert!(at.lat_rad.abs() <= FRAC_PI_2 && at.lon_rad.abs() <= PI && pose.roll.0.abs() < 0.6);
        assert_eq!(pose.time_s, i as f64 / 60.0);
    }
    for (i, pair) in flight.poses.windows(3).enumerate() {
        let [a, b, c] = [0, 1, 2].map(|k| ecef(&pair[k], body));
        // 0.07 of the radius a second, 450 km/s on the Earth, is the descent at its fastest.
        assert!((b - a).length() < 0.07 / 60.0 * body.a_m, "{name} {i}");
        let bend = (c - b - (b - a)).length();
        assert!(bend < 2e-5 * body.a_m, "{name} {i}: {bend} m a frame²");
        let turn = angle_between(orientation(&pair[0]), orientation(&pair[1]));
        assert!(turn < 0.03, "{name} {i}: {turn} rad a frame");
    }
}

#[test]
fn the_descent_goes_from_orbit_to_two_metres_and_rolls() {
    for body in BODIES {
        let ground = ground(body);
        let flight = flight("descent", &body, &ground).unwrap();
        let above_m = |i: usize| flight.poses[i].at.height_m - ground(flight.poses[i].at);
        assert_eq!(flight.poses.len(), 10_801);
        let top_m = (0.0627 * body.a_m).min(400_000.0);
        assert!((above_m(0) / top_m - 1.0).abs() < 0.05, "{} of {top_m} m", above_m(0));
        let end_m = above_m(10_800);
        assert!((1.999..2.1).contains(&end_m), "ends {end_m} m above the ground");
        let lowest = (0..10_801).map(above_m).fold(f64::INFINITY, f64::min);
        assert!(lowest > 1.99, "{lowest} m");
        let highest = (9_600..10_801).map(above_m).fold(0.0, f64::max);
        assert!(highest < 4.0, "{highest} m above the ground in the roll");
        let roll_mps = (0.002 * body.a_m).min(10.0);
        for i in 9_600..10_800 {
            let [a, b] = [i, i + 1].map(|k| {
                let at = Geodetic { height_m: 0.0, ..flight.poses[k].at };
                body.ecef_from_geodetic(at).0
            });
            assert!(((b - a).length() * 60.0 / roll_mps - 1.0).abs() < 0.05);
        }
        let pitch_deg = flight.poses[10_800].pitch.to_degrees();
        assert!((pitch_deg + 6.0).abs() < 1e-9);
    }
}

#[test]
fn the_descent_comes_down_on_land_by_the_sea() {
    let ground = ground(Ellipsoid::WGS84);
    let flight = flight("descent", &Ellipsoid::WGS84, &ground).unwrap();
    let end = flight.poses[10_800].at;
    assert!((50.0..1600.0).contains(&ground(end)), "{} m", ground(end));
    let sea = (0..3600).any(|i| {
        let (side, distance) = (f64::from(i % 36) * PI / 18.0, f64::from(i / 36) * 300.0 / 6.37e6);
        let lon_rad = end.lon_rad + distance * sin(side) / cos(end.lat_rad);
        let lat_rad = end.lat_rad + distance * cos(side);
        ground(Geodetic { lat_rad, lon_rad, height_m: 0.0 }) < 0.0
    });
    assert!(sea, "no sea within 30 km of {end:?}");
}

#[test]
fn the_poles_are_passed_and_the_antimeridian_crossed() {
    for body in BODIES {
        let flight = flight("poles", &body, &ground(body)).unwrap();
        let miss = |z: f64| {
            let pole = DVec3::new(0.0, 0.0, z);
            let away = |pose: &Pose| (pose.at.normal() - pole).length() * body.a_m;
            flight.poses.iter().map(away).fold(f64::INFINITY, f64::min)
        };
        assert!(miss(1.0) < 10.0 && miss(-1.0) < 10.0, "{} m, {} m", miss(1.0), miss(-1.0));
        let crossings = flight
            .poses
            .windows(2)
            .filter(|pair| {
                let [a, b] = [pair[0].at, pair[1].at];
                a.lat_rad.abs() < 1.5 && (a.lon_rad - b.lon_rad).abs() > PI
            })
            .count();
        assert!(crossings >= 2, "{crossings}");
        let heights: Vec<f64> =
            flight.poses.iter().map(|pose| pose.at.height_m - flight.raised_m).collect();
        let least = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let most = heights.iter().copied().fold(0.0, f64::max);
        let top_m = (0.0094 * body.a_m).min(60_000.0);
        assert!(least > 0.49 * top_m && most <= 1.001 * top_m, "{least} m to {most} m");
    }
}

#[test]
fn rainier_keeps_its_distance_from_any_ground() {
    let bare = bundled("rainier").unwrap();
    assert_eq!((bare.poses.len(), bare.raised_m), (36_001, 0.0));
    let high = flight("rainier", &Ellipsoid::WGS84, &|_| 4000.0).unwrap();
    assert!((high.clearance_m(60, &|_| 4000.0) - 300.0).abs() < 1e-9);
    assert!((high.poses[7].at.height_m - bare.poses[7].at.height_m - high.raised_m).abs() < 1e-9);
    let moon = flight("rainier", &Ellipsoid::MOON, &|_| 0.0).unwrap();
    let scale = Ellipsoid::MOON.a_m / Ellipsoid::WGS84.a_m;
    assert_eq!(moon.poses[9].at.height_m, bare.poses[9].at.height_m * scale);
}

#[test]
fn flights_repeat_bit_for_bit() {
    for name in ["descent", "poles"] {
        let once = flight(name, &Ellipsoid::MARS, &ground(Ellipsoid::MARS)).unwrap();
        assert_eq!(Some(once), flight(name, &Ellipsoid::MARS, &ground(Ellipsoid::MARS)));
    }
}

#[test]
fn a_lens_looks_to_its_side_of_the_nose() {
    let pose = Pose {
        time_s: 0.0,
        at: Geodetic::from_degrees(10.0, 20.0, 500.0),
        heading: Radians::from_degrees(300.0),
        pitch: Radians(0.0),
        roll: Radians(0.0),
    };
    let lens = LensSettings {
        name: "right".into(),
        field_of_view: Radians(1.0),
        yaw: Radians::from_degrees(60.0),
        pitch: Radians::from_degrees(90.0),
        near_m: 0.5,
    };
    let body = Ellipsoid::WGS84;
    let up = view_of(&pose, &lens, [4, 3], &body);
    assert!((up.orientation * DVec3::NEG_Z - pose.at.normal()).length() < 1e-12);
    let level = view_of(&pose, &LensSettings { pitch: Radians(0.0), ..lens }, [4, 3], &body);
    let north = pose.at.enu_axes().y_axis;
    assert!((level.orientation * DVec3::NEG_Z - north).length() < 1e-12);
    assert_eq!((level.eye, level.size_px, level.near_m), (up.eye, [4, 3], 0.5));
}

/// The log that the bundled file was made from, where it is at hand.
fn rainier_csv() -> Option<Vec<u8>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    std::fs::read(root.join("shared/data/flights/rainier/c172_10hz.csv")).ok()
}

#[test]
fn rainier_passes_through_every_row_of_its_log() {
    let Some(csv) = rainier_csv() else {
        println!("rainier_passes_through_every_row_of_its_log: skipped: no ../shared/data");
        return;
    };
    let rows = rows_from_csv(&csv).unwrap();
    let flight = bundled("rainier").unwrap();
    assert_eq!(rows.len(), 6001);
    for (i, row) in rows.iter().enumerate() {
        let pose = &flight.poses[i * 6];
        assert!((pose.time_s - row.time_s).abs() < 1e-9);
        let body = Ellipsoid::WGS84;
        let away_m = (ecef(pose, &body) - ecef(row, &body)).length();
        assert!(away_m < 1e-3, "row {i}: {away_m} m");
        let turned = angle_between(orientation(pose), orientation(row));
        assert!(turned < 1e-4, "row {i}: {turned} rad");
    }
}

#[test]
fn the_bundled_file_is_what_the_example_makes_from_the_log() {
    let Some(csv) = rainier_csv() else {
        println!(
            "the_bundled_file_is_what_the_example_makes_from_the_log: skipped: no ../shared/data"
        );
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rainier.ovf");
    flight_from_csv(&csv, "rainier", 60.0).unwrap().write(&path).unwrap();
    let committed = include_bytes!("../flights/rainier.ovf");
    assert!(std::fs::read(&path).unwrap() == committed, "make it again with the example resample");
}

#[test]
fn the_bundled_file_is_whole() {
    let committed = include_bytes!("../flights/rainier.ovf");
    let mut reader = Reader::from_bytes(committed, "rainier.ovf").unwrap();
    let poses = reader.by_ref().filter(|frame| matches!(frame, Ok(Frame::Pose(_)))).count();
    assert_eq!((poses, reader.complete()), (36_001, true));
    assert_eq!(reader.header().frames, 36_001);
    assert!(committed.len() < 1_200_000, "{} bytes", committed.len());
}
