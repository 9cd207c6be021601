//! Layers of an archive: which is seen where, how they blend, odd shapes, voids, datums.
//!
//! In:    rasters of constant or simple ground, one over another.
//! Out:   pass or fail.
//! Keeps: nothing.
//! Not here: bounds (`bounds`), borders of pages (`pages`, `seams`).

use crate::atlas::{Atlas, EARTH, Scene, at, build, even, verify};
use crate::rasters::{Sheet, VOID, options, rugged_m};
use crate::tiff_file::{Number, Packing, TiffFile};
use overfly_core::datasource::facts::Datum;
use overfly_core::datasource::page::Origin;
use overfly_core::geodesy::Geodetic;
use overfly_core::ground::{Height, Place, Query};
use overfly_ingest::{BuildOptions, IngestError};
use std::path::Path;

/// Ground of archives alone.
const BARE: Scene = Scene { detail: None, sea: false, ..EARTH };

/// A GTX grid: south, west and both steps in degrees; rows and columns.
pub fn gtx(header: [f64; 4], [rows, columns]: [i32; 2], node: impl Fn(usize) -> f32) -> Vec<u8> {
    let mut bytes: Vec<u8> = header.iter().flat_map(|number| number.to_be_bytes()).collect();
    bytes.extend([rows, columns].iter().flat_map(|count| count.to_be_bytes()));
    bytes.extend((0..(rows * columns) as usize).flat_map(|at| node(at).to_be_bytes()));
    bytes
}

/// Levels below the data at which triangles hardly sag below the ellipsoid.
const BEYOND: u8 = 8;

/// The ground at a place, below the last level of the data, where it is linear between its points.
fn ground(atlas: &Atlas, place: Geodetic) -> Height {
    let depth = atlas.depth() + BEYOND;
    let mut ground = atlas.bare();
    ground.insert(atlas.page(Place::of(place.normal()).page(depth)));
    ground.height(place, Query::Exact(even(depth))).ok().unwrap()
}

fn opened(folder: &Path, built: &BuildOptions) -> Atlas {
    build(built).unwrap();
    assert!(std::fs::read_dir(folder).unwrap().all(|entry| {
        let name = entry.unwrap().file_name().into_string().unwrap();
        !name.ends_with(".part")
    }));
    Atlas::open(&[&built.output], BARE)
}

#[test]
fn a_finer_inset_wins_inside_blends_evenly_and_ends() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let world = Sheet::world(1.0);
    let low = world.write_whole(&path("w.tif"), |_, _| 100.0);
    let inset = Sheet::new([20.0, 10.0], 0.025, [161, 161]);
    let high = inset.write_whole(&path("i.tif"), |_, _| 1000.0);
    let built = options(&[high, low], &path("a.pmtiles"));
    let report = build(&built).unwrap();
    let [base, fine] = &report.facts.layers[..] else { panic!("two layers") };
    assert_eq!((base.sources[0].as_str(), fine.sources[0].as_str()), ("w.tif", "i.tif"));
    let atlas = Atlas::open(&[&built.output], BARE);
    let low_m = ground(&atlas, at(-40.0, 100.0)).height_m;
    assert!((low_m - 100.0).abs() <= base.quantum_m / 2.0 + 0.3, "{low_m}");
    // South of it, from well inside to beyond the blend: 0.2° wide, the first quarter still full.
    let (mut last_m, mut halves) = (1000.0, 0);
    for step in 0..=400 {
        let lat = 6.1 - 0.001 * f64::from(step);
        let height_m = ground(&atlas, at(lat, 22.0)).height_m;
        assert!(height_m <= last_m + 0.1, "{lat}: {height_m} after {last_m}");
        let outside = 6.0 - lat;
        if outside <= 0.0 {
            assert!((height_m - 1000.0).abs() < 1.0, "{lat}: {height_m}");
        } else if outside > 0.23 {
            assert!((height_m - low_m).abs() < 0.3, "{lat}: {height_m}");
        } else if (0.124..0.126).contains(&outside) {
            assert!((height_m - 0.5 * (1000.0 + low_m)).abs() < 15.0, "{lat}: {height_m}");
            halves += 1;
        }
        last_m = height_m;
    }
    assert!(halves > 0);
    // Postings of the world under the inset or its blend are hidden, all others compared.
    let places = (0..180).flat_map(|row| (0..360).map(move |column| (column, row)));
    let hidden = places.filter(|&(column, row)| {
        let [lon, lat] = world.place_deg(column, row);
        (5.8..10.2).contains(&lat) && (19.8..24.2).contains(&lon)
    });
    let hidden = hidden.count() as u64;
    let found = verify(&built);
    assert_eq!((found[0].hidden, found[0].compared), (hidden, 360 * 180 - hidden));
    assert_eq!((found[1].hidden, found[1].compared), (0, 161 * 161));
}

#[test]
fn of_two_insets_of_one_spacing_the_first_is_seen_and_the_other_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let west = Sheet::new([10.0, 10.0], 0.01, [101, 101]);
    let west = west.write_whole(&path("w.tif"), |_, _| 200.0);
    let east = Sheet::new([10.5, 10.0], 0.01, [101, 101]);
    let east = east.write_whole(&path("e.tif"), |_, _| 800.0);
    let built = options(&[west, east], &path("a.pmtiles"));
    let atlas = opened(folder.path(), &built);
    let mut last_m = 0.0;
    for step in 0..=130 {
        let lon = 10.1 + 0.01 * f64::from(step);
        let height_m = ground(&atlas, at(9.5, lon)).height_m;
        assert!(height_m >= last_m - 0.5, "{lon}: {height_m} after {last_m}");
        // The west one is seen up to the blend from its end.
        let wanted = [(10.0, 10.9, 200.0), (11.01, 12.0, 800.0)];
        for (from, to, wanted_m) in wanted {
            let is_there = lon > from && lon < to;
            assert!(!is_there || (height_m - wanted_m).abs() < 1.5, "{lon}: {height_m}");
        }
        last_m = height_m;
    }
    let found = verify(&built);
    let all: u64 = found.iter().map(|found| found.compared + found.hidden).sum();
    assert_eq!(all, 2 * 101 * 101);
    assert!(found.iter().all(|found| found.max_m < 6.0 && found.compared > 5000), "{found:?}");
}

#[test]
fn voids_are_filled_from_around_and_say_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let sheet = Sheet::new([10.0, 46.25], 0.0025, [101, 101]);
    let ground_m = |lon: f64, lat: f64| 1000.0 + 2000.0 * (lon - 10.0) + 1000.0 * (lat - 46.0);
    let hollow = |lon: f64, lat: f64| {
        let hole = (lon - 10.1).abs() < 0.011 && (lat - 46.1).abs() < 0.011;
        if hole { VOID } else { ground_m(lon, lat) }
    };
    let built = options(&[sheet.write_whole(&path("a.tif"), hollow)], &path("a.pmtiles"));
    let atlas = opened(folder.path(), &built);
    let (mut filled, mut measured) = (0, 0);
    for step in 0..60 * 60 {
        let [north, east] = [step / 60, step % 60].map(|i| 0.0006 * f64::from(i - 30));
        let found = ground(&atlas, at(46.1 + north, 10.1 + east));
        let wanted_m = ground_m(10.1 + east, 46.1 + north);
        assert!((found.height_m - wanted_m).abs() < 40.0, "{found:?}, not {wanted_m}");
        let (inner, outer) = (0.010, 0.0135);
        let within = |most: f64| north.abs() < most && east.abs() < most;
        match found.origin {
            Origin::Filled => filled += 1,
            Origin::Measured => measured += 1,
            Origin::Procedural => panic!("{north} {east}"),
        }
        assert!(!within(inner) || found.origin == Origin::Filled, "{north} {east} {found:?}");
        assert!(within(outer) || found.origin == Origin::Measured, "{north} {east} {found:?}");
    }
    assert!(filled > 500 && measured > 500, "{filled} {measured}");
}

#[test]
fn a_raster_of_voids_alone_is_flat_and_filled() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let sheet = Sheet::new([10.0, 46.25], 0.01, [26, 26]);
    let built = options(&[sheet.write_whole(&path("a.tif"), |_, _| VOID)], &path("a.pmtiles"));
    let atlas = opened(folder.path(), &built);
    let found = ground(&atlas, at(46.1, 10.1));
    assert_eq!((found.height_m.abs() < 0.01, found.origin), (true, Origin::Filled), "{found:?}");
    assert_eq!(verify(&built)[0].compared, 0);
}

#[test]
fn rasters_of_one_and_of_four_postings_are_ground() {
    for (size, step_deg) in [([1, 1], 1.0), ([2, 2], 1.0), ([2, 2], 0.01), ([1, 5], 0.1)] {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let sheet = Sheet::new([10.0, 46.0], step_deg, size);
        let built = options(&[sheet.write_whole(&path("a.tif"), |_, _| 700.0)], &path("a.pmtiles"));
        let atlas = opened(folder.path(), &built);
        let height_m = ground(&atlas, at(46.0, 10.0)).height_m;
        let quantum_m = Atlas::open(&[&built.output], BARE).quantum_m(0);
        assert!((height_m - 700.0).abs() <= 0.5 * quantum_m + 5.0, "{size:?}: {height_m}");
    }
}

#[test]
fn a_world_of_postings_too_wide_for_whole_metres_is_ground() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let world = Sheet::world(10.0).write_whole(&path("w.tif"), |_, _| 700.0);
    let atlas = opened(folder.path(), &options(&[world], &path("a.pmtiles")));
    let height_m = ground(&atlas, at(46.0, 10.0)).height_m;
    assert!((height_m - 700.0).abs() <= 60.0, "{height_m}");
}

#[test]
fn a_world_has_poles_whether_or_not_a_row_lies_on_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let on_pole = Sheet { first_deg: [-180.0, 90.0], step_deg: [2.0; 2], size: [180, 91] };
    for sheet in [Sheet::world(2.0), on_pole] {
        let slope_m = |_: f64, lat: f64| 3000.0 + 20.0 * lat;
        let atlas = opened(
            folder.path(),
            &options(&[sheet.write_whole(&path("w.tif"), slope_m)], &path("a")),
        );
        let quantum_m = atlas.quantum_m(0);
        for (lat, wanted_m) in [(90.0, 4790.0), (-90.0, 1210.0), (45.0, 3900.0)] {
            for lon in [-180.0, -90.0, 0.0, 77.0, 180.0] {
                let found = ground(&atlas, at(lat, lon));
                assert!(
                    (found.height_m - wanted_m).abs() < 1.5 * quantum_m,
                    "{lat} {lon} {found:?}"
                );
                assert_eq!(found.origin, Origin::Measured);
            }
        }
    }
}

#[test]
fn a_raster_over_180_degrees_comes_back_on_both_sides() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for first in [179.875, -180.125] {
        let sheet = Sheet::new([first, -16.0], 0.0025, [101, 101]);
        let wavy = |lon: f64, lat: f64| rugged_m((lon + 360.0) % 360.0, lat).max(1.0);
        let built = options(&[sheet.write_whole(&path("a.tif"), wavy)], &path("a.pmtiles"));
        opened(folder.path(), &built);
        let found = &verify(&built)[0];
        assert_eq!((found.compared, found.hidden), (101 * 101, 0), "{first}");
        assert!(found.rms_m < 3.0, "{found:?}");
    }
}

#[test]
fn a_mercator_world_leaves_its_poles_to_what_lies_beneath() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let half_m = std::f64::consts::PI * 6_378_137.0;
    let file = TiffFile {
        packing: Packing::Deflate,
        scale: vec![2.0 * half_m / 256.0, 2.0 * half_m / 256.0, 0.0],
        tie: vec![0.0, 0.0, 0.0, -half_m, half_m, 0.0],
        keys: vec![[1024, 1], [1025, 1], [3072, 3857], [3076, 9001]],
        ..TiffFile::new([256, 256], vec![2000.0; 256 * 256])
    };
    std::fs::write(path("m.tif"), file.bytes()).unwrap();
    build(&options(&[path("m.tif")], &path("m.pmtiles"))).unwrap();
    let world = Sheet::world(3.0).write_whole(&path("w.tif"), |_, _| 500.0);
    build(&options(&[path("m.tif"), world], &path("both.pmtiles"))).unwrap();
    for (archive, polar_m) in [("m.pmtiles", 0.0), ("both.pmtiles", 500.0)] {
        let atlas = Atlas::open(&[&path(archive)], BARE);
        let wanted = [(90.0, polar_m), (-90.0, polar_m), (0.0, 2e3), (70.0, 2e3), (-80.0, 2e3)];
        for (at, (lat, wanted_m)) in (0..25).map(|i| (i / 5, wanted[i % 5])) {
            let lon = [-180.0, -60.0, 0.0, 100.0, 180.0][at];
            let height_m = ground(&atlas, crate::atlas::at(lat, lon)).height_m;
            assert!((height_m - wanted_m).abs() < 60.0, "{archive} {lat} {lon}: {height_m}");
        }
    }
}

#[test]
fn fractions_of_metres_are_kept_to_a_tenth_and_nothing_is_above_an_ellipsoid() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let sheet = Sheet::new([10.0, 46.25], 0.0025, [51, 51]);
    let fine = |lon: f64, lat: f64| 100.0 + 40.0 * (lon - 10.0) + 31.0 * (lat - 46.0);
    let built = options(&[sheet.write(&path("a.tif"), Number::F32, fine)], &path("a.pmtiles"));
    let atlas = opened(folder.path(), &built);
    let found = ground(&atlas, at(46.2, 10.05));
    assert_eq!((found.sea_level_m, atlas.quantum_m(0)), (0.0, 0.1));
    assert!((found.height_m - fine(10.05, 46.2)).abs() < 0.1, "{found:?}");
    let off = &verify(&built)[0];
    assert!(off.max_m < 0.11 && off.rms_m < 0.05, "{off:?}");
}

#[test]
fn the_sea_lies_on_the_geoid_that_is_given() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("g.gtx"), gtx([40.0, 5.0, 5.0, 5.0], [3, 3], |_| 48.5)).unwrap();
    let sheet = Sheet::new([10.0, 46.25], 0.0025, [51, 51]);
    let built = options(&[sheet.write_whole(&path("a.tif"), |_, _| 300.0)], &path("a.pmtiles"));
    let built = BuildOptions { datum: Datum::Egm96, geoid: Some(path("g.gtx")), ..built };
    let found = ground(&opened(folder.path(), &built), at(46.2, 10.05));
    assert!((found.sea_level_m - 48.5).abs() < 0.02 && (found.height_m - 348.5).abs() < 0.6);
}

#[test]
fn a_geoid_that_does_not_cover_the_data_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("g.gtx"), gtx([0.0, 0.0, 1.0, 1.0], [3, 3], |_| 10.0)).unwrap();
    let sheet = Sheet::new([10.0, 46.25], 0.0025, [51, 51]);
    let built = options(&[sheet.write_whole(&path("a.tif"), |_, _| 300.0)], &path("a.pmtiles"));
    let built = BuildOptions { datum: Datum::Egm96, geoid: Some(path("g.gtx")), ..built };
    let error = build(&built).unwrap_err();
    assert!(matches!(error, IngestError::GeoidLacks { .. }), "{error}");
    assert!(!built.output.exists());
}

#[test]
fn a_blend_may_be_as_narrow_as_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let sheet = Sheet::new([10.0, 46.25], 0.0025, [51, 51]);
    let input = sheet.write_whole(&path("a.tif"), |_, _| 300.0);
    for blend_m in [1.0, 0.0] {
        let built = options(std::slice::from_ref(&input), &path("a.pmtiles"));
        let atlas = opened(folder.path(), &BuildOptions { blend_m: Some(blend_m), ..built });
        let found = ground(&atlas, at(46.2, 10.05));
        assert!((found.height_m - 300.0).abs() < 0.6, "blend {blend_m}: {found:?}");
    }
}
