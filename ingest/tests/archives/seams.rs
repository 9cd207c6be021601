//! The surface of a level has no step, wherever pages, rasters or quadrants meet.
//!
//! In:    grounds of pages over archives; places on borders.
//! Out:   pass, or the greatest step.
//! Keeps: nothing.
//! Not here: heights at lattice points (`pages`).

use crate::atlas::{Atlas, EARTH, Scene, at, build, even, place_at, place_of, unit};
use crate::rasters::{Sheet, options, rugged_m, world_m};
use crate::shared_data;
use glam::DVec3;
use overfly_core::datasource::PageKey;
use overfly_core::geodesy::Geodetic;
use overfly_core::ground::{Ground, Place, Query};
use overfly_core::lattice::fold;
use std::path::Path;

/// To both sides of a border: 64 µm on the Earth, so that slopes do not look like steps.
const ASIDE_RAD: f64 = 1e-11;
const STEP_MOST_M: f64 = 1e-3;
/// Of levels from this on.
const LEVEL: u8 = 20;

/// Height of the surface at a normal.
fn height_m(ground: &Ground, normal: DVec3, level: u8) -> f64 {
    ground.height(place_of(normal.normalize()), Query::Exact(level)).ok().unwrap().height_m
}

/// The greatest step of the surface across a place, both ways along `across`.
fn step_m(atlas: &Atlas, normal: DVec3, across: DVec3, depth: u8) -> f64 {
    let sides = [ASIDE_RAD, -ASIDE_RAD].map(|aside| (normal + across * aside).normalize());
    let mut ground = atlas.bare();
    for side in sides {
        ground.insert(atlas.page(Place::of(place_of(side).normal()).page(depth)));
    }
    let levels = [even(depth) - 1, even(depth)].into_iter().filter(|&level| level >= LEVEL);
    let steps = levels.map(|level| {
        let [a, b] = sides.map(|side| height_m(&ground, side, level));
        (a - b).abs()
    });
    steps.fold(0.0, f64::max)
}

/// Steps across all four sides of the pages around a place, down to below the data.
fn check_sides(atlas: &Atlas, site: Geodetic) {
    for depth in LEVEL / 2 - 6..=atlas.depth() + 4 {
        let key = Place::of(site.normal()).page(depth);
        for seed in 0..24_u64 {
            let (normal, across) = border(key, seed);
            let step_m = step_m(atlas, normal, across, depth);
            let there = place_of(normal);
            assert!(step_m <= STEP_MOST_M, "{step_m} m at {there:?}, side {seed} of {key:?}");
        }
    }
}

/// A place on a side of a page, and the way across.
fn border(key: PageKey, seed: u64) -> (DVec3, DVec3) {
    let (u0, v0) = key.origin();
    let along = (unit(seed ^ key.bits()) * f64::from(key.side() - 2)) as i32 + 1;
    let other = if seed & 1 == 0 { 0 } else { key.side() };
    let point = |along: i32| {
        let (u, v) = if seed & 2 == 0 { (along, other) } else { (other, along) };
        place_at(fold(key.quadrant(), u0 + u, v0 + v)).normal()
    };
    let (normal, next) = (point(along), point(along - 1));
    (normal, normal.cross(next - normal).normalize())
}

/// Steps across lines of latitude and longitude, and at the poles all around.
fn check_line(atlas: &Atlas, places: &[Geodetic]) {
    for depth in LEVEL / 2 - 6..=atlas.depth() + 4 {
        for place in places {
            let axes = place.enu_axes();
            for across in [axes.x_axis, axes.y_axis, axes.x_axis + axes.y_axis] {
                let step_m = step_m(atlas, place.normal(), across, depth);
                assert!(step_m <= STEP_MOST_M, "{step_m} m at {place:?}, depth {depth}");
            }
        }
    }
}

fn atlas(folder: &Path, scene: Scene) -> Atlas {
    let path = |name: &str| folder.join(name);
    let world = Sheet::world(2.0).write_whole(&path("w.tif"), world_m);
    let inset = Sheet::new([179.875, 0.1], 0.0025, [101, 81]);
    let inset = inset.write_whole(&path("i.tif"), rugged_m);
    let output = path("a.pmtiles");
    build(&options(&[world, inset], &output)).unwrap();
    Atlas::open(&[&output], scene)
}

#[test]
fn no_step_at_180_degrees_at_the_poles_and_between_quadrants() {
    let folder = tempfile::tempdir().unwrap();
    for scene in [EARTH, Scene { detail: None, sea: false, ..EARTH }] {
        let atlas = atlas(folder.path(), scene);
        let line: Vec<_> = (0..24).map(|i| at(f64::from(i) * 7.3 - 84.0, 180.0)).collect();
        check_line(&atlas, &line);
        check_line(&atlas, &[at(90.0, 0.0), at(-90.0, 0.0), at(0.0, 0.0), at(0.0, 90.0)]);
        let line: Vec<_> = (0..24).map(|i| at(0.0, f64::from(i) * 15.1 - 180.0)).collect();
        check_line(&atlas, &line);
        for site in [at(90.0, 0.0), at(-89.999, 40.0), at(0.0, 180.0), at(30.0, -180.0)] {
            check_sides(&atlas, site);
        }
    }
}

#[test]
fn no_step_across_the_edge_of_an_inset_on_180_degrees() {
    let folder = tempfile::tempdir().unwrap();
    let atlas = atlas(folder.path(), EARTH);
    // Its southern border, the far side of its blend, its eastern border, and its middle.
    let line = |lat: f64| (0..12).map(move |i| at(lat, 179.87 + 0.0225 * f64::from(i)));
    for lat in [-0.1, -0.12, -0.11, 0.1, 0.12, 0.0] {
        check_line(&atlas, &line(lat).collect::<Vec<_>>());
    }
    let line: Vec<_> = (0..12).map(|i| at(-0.12 + 0.02 * f64::from(i), -179.875)).collect();
    check_line(&atlas, &line);
    for site in [at(-0.1, 180.0), at(-0.115, 179.9), at(0.0, 179.95), at(0.3, 180.0)] {
        check_sides(&atlas, site);
    }
}

#[test]
fn no_step_where_srtm_tiles_meet_and_end() {
    let Some(data) = shared_data("no_step_where_srtm_tiles_meet_and_end") else { return };
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("a.pmtiles");
    let inputs = ["N49E011", "N50E011"].map(|name| data.join(format!("dem/{name}.hgt.zip")));
    build(&options(&inputs, &output)).unwrap();
    let atlas = Atlas::open(&[&output], EARTH);
    let line: Vec<_> = (0..40).map(|i| at(50.0, 11.0 + 0.0256 * f64::from(i))).collect();
    check_line(&atlas, &line);
    for site in [at(50.0, 11.4), at(49.0, 11.5), at(50.4, 12.003), at(51.0, 11.0)] {
        check_sides(&atlas, site);
    }
}
