//! The geoid from harmonics and from a grid.
//!
//! In:    `../shared/data/dem/egm96_15.gtx`, and small grids written here.
//! Out:   pass or fail, or a line that it was skipped.
//! Keeps: nothing.
//! Not here: heights of the ground.

use crate::shared_data;
use overfly_ingest::geoid::{Geoid, NodeSpacing};

/// Measured at 1000 random nodes: at most 0.13 mm.
const NODE_ERROR_M: f64 = 2.0e-4;

fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 33) as f64 / (1_u64 << 31) as f64
}

#[test]
fn the_harmonics_agree_with_the_official_grid_at_200_nodes() {
    let Some(data) = shared_data("the_harmonics_agree_with_the_official_grid_at_200_nodes") else {
        return;
    };
    let official = Geoid::from_gtx(&data.join("dem/egm96_15.gtx")).unwrap();
    let ours = Geoid::egm96();
    let mut seed = 42;
    for _ in 0..200 {
        let lat = (-90.0 + (random(&mut seed) * 721.0).floor() * 0.25).to_radians();
        let lon = (-180.0 + (random(&mut seed) * 1440.0).floor() * 0.25).to_radians();
        let difference_m = ours.undulation_m(lat, lon) - official.undulation_m(lat, lon);
        assert!(difference_m.abs() < NODE_ERROR_M, "{lat} {lon}: {difference_m}");
    }
}

#[test]
fn wider_nodes_are_the_same_nodes_where_they_coincide() {
    let (fine, coarse) = (Geoid::egm96(), Geoid::egm96_spaced(NodeSpacing::Degree1));
    for (lat_deg, lon_deg) in [(47.0_f64, 8.0_f64), (-33.0, 151.0), (90.0, 17.0), (-90.0, 0.0)] {
        let (lat, lon) = (lat_deg.to_radians(), lon_deg.to_radians());
        let difference_m = fine.undulation_m(lat, lon) - coarse.undulation_m(lat, lon);
        assert!(difference_m.abs() < 1e-6, "{lat_deg} {lon_deg}: {difference_m}");
    }
}

#[test]
fn the_antimeridian_and_the_poles_have_no_step() {
    let geoid = Geoid::egm96_spaced(NodeSpacing::Degree1);
    let at =
        |lat_deg: f64, lon_deg: f64| geoid.undulation_m(lat_deg.to_radians(), lon_deg.to_radians());
    assert!((at(12.3, 180.0) - at(12.3, -180.0)).abs() < 1e-9);
    assert!((at(12.3, 179.999_999) - at(12.3, -179.999_999)).abs() < 1e-4);
    assert_eq!(at(90.0, 0.0), at(90.0, 123.4));
    assert!((at(-89.999_999, 10.0) - at(-90.0, 250.0)).abs() < 1e-4);
    // 13.606 m is the official grid's value at the north pole.
    assert!((at(90.0, 0.0) - 13.606).abs() < 1e-3, "{}", at(90.0, 0.0));
}

#[test]
fn threads_get_the_same_undulations_whoever_computes_them() {
    let geoid = Geoid::egm96();
    let walk = || {
        let at = |step: i32| geoid.undulation_m(0.8 + f64::from(step) * 1e-3, 0.2);
        (0..40).map(|step| at(step).to_bits()).collect::<Vec<_>>()
    };
    let (one, other) = std::thread::scope(|scope| {
        let (one, other) = (scope.spawn(walk), scope.spawn(walk));
        (one.join().unwrap(), other.join().unwrap())
    });
    assert_eq!(one, other);
    assert!(one.iter().all(|bits| f64::from_bits(*bits).is_finite()));
}

fn gtx(header: [f64; 4], size: [i32; 2], values: &[f32]) -> Vec<u8> {
    let mut bytes: Vec<u8> = header.iter().flat_map(|number| number.to_be_bytes()).collect();
    bytes.extend(size.iter().flat_map(|count| count.to_be_bytes()));
    bytes.extend(values.iter().flat_map(|value| value.to_be_bytes()));
    bytes
}

#[test]
fn a_regional_grid_is_bilinear_inside_and_nothing_outside() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("region.gtx");
    let values = [1.0, 2.0, 3.0, 4.0, 5.0, -88.8888];
    std::fs::write(&path, gtx([45.0, 5.0, 0.5, 0.25], [2, 3], &values)).unwrap();
    let geoid = Geoid::from_gtx(&path).unwrap();
    let at =
        |lat_deg: f64, lon_deg: f64| geoid.undulation_m(lat_deg.to_radians(), lon_deg.to_radians());
    assert!((at(45.25, 5.125) - 3.0).abs() < 1e-9);
    assert!((at(45.0, 5.5) - 3.0).abs() < 1e-6);
    assert!(at(45.25, 5.4).is_nan(), "a void node was used");
    assert!(at(44.9, 5.1).is_nan() && at(45.1, 4.9).is_nan() && at(f64::NAN, 0.0).is_nan());
}

#[test]
fn damaged_grids_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.gtx");
    let sound = gtx([45.0, 5.0, 0.5, 0.25], [1, 2], &[1.0, 2.0]);
    let mut wrong = vec![sound[..39].to_vec(), sound[..47].to_vec(), Vec::new()];
    wrong.push(gtx([45.0, 5.0, 0.5, 0.25], [i32::MAX, i32::MAX], &[1.0]));
    wrong.push(gtx([45.0, 5.0, 0.5, 0.25], [-1, -1], &[1.0]));
    wrong.push(gtx([45.0, 5.0, f64::NAN, 0.25], [1, 1], &[1.0]));
    wrong.push(gtx([89.0, 5.0, 0.5, 0.25], [9, 1], &[1.0; 9]));
    for bytes in wrong {
        std::fs::write(&path, &bytes).unwrap();
        assert!(Geoid::from_gtx(&path).is_err(), "{} bytes", bytes.len());
    }
}
