//! Pages over archives: a lattice point has one height, whichever page it is read from.
//!
//! In:    archives over which pages are made, at borders of all kinds.
//! Out:   pass or fail.
//! Keeps: nothing.
//! Not here: the surface between samples (`seams`), bounds (`bounds`).

use crate::atlas::{Atlas, EARTH, Scene, at, build};
use crate::rasters::{Sheet, options, rugged_m, world_m};
use crate::shared_data;
use glam::IVec3;
use overfly_core::datasource::page::Origin;
use overfly_core::datasource::{PAGE_SIDE, Page, PageKey};
use overfly_core::geodesy::Geodetic;
use overfly_core::ground::Place;
use overfly_core::lattice::{RADIUS, signs, unfold};
use std::path::Path;

/// Levels looked at below the last one of the data.
const BEYOND: u8 = 4;

/// All pages of a depth that hold a lattice point.
fn holders(point: IVec3, depth: u8) -> Vec<PageKey> {
    let side = RADIUS >> depth;
    let ends = |along: i32| {
        let (cell, count) = (along / side, 1 << depth);
        let before = (along % side == 0 && cell > 0).then_some(cell - 1);
        before.into_iter().chain((cell < count).then_some(cell)).map(i32::cast_unsigned)
    };
    let mut keys = Vec::new();
    for quadrant in 0..4 {
        let (sx, sy) = signs(quadrant);
        if sx * point.x < 0 || sy * point.y < 0 {
            continue;
        }
        let (u, v) = unfold(quadrant, point);
        keys.extend(
            ends(u).flat_map(|x| ends(v).map(move |y| PageKey::new(quadrant, depth, x, y))),
        );
    }
    keys
}

fn height_bits(page: &Page, point: IVec3) -> (u32, u64) {
    let at = page.sample_index(point);
    (page.heights_m[at].to_bits(), page.sea_level_m(at).to_bits())
}

/// All that neighbours share.
fn look(page: &Page, point: IVec3) -> ((u32, u64), [i16; 2], [u8; 4], Option<Origin>) {
    let at = page.sample_index(point);
    let origin = page.survey.as_ref().map(|survey| survey.origin[at]);
    (height_bits(page, point), page.normals[at], page.layers[at], origin)
}

/// Pages around a place at all depths, against all that touch them and those above them.
fn check_around(atlas: &Atlas, site: Geodetic) {
    let place = Place::of(site.normal());
    for depth in 0..=atlas.depth() + BEYOND {
        let key = place.page(depth);
        let page = atlas.page(key);
        let last = PAGE_SIDE - 1;
        let border = (0..=last).step_by(8).flat_map(|i| [(i, 0), (i, last), (0, i), (last, i)]);
        for (i, j) in border {
            let point = key.sample(i, j);
            let all = holders(point, depth);
            assert!(all.contains(&key), "{key:?} {point}");
            for other in all {
                let (own, theirs) = (look(&page, point), look(&atlas.page(other), point));
                assert_eq!(own, theirs, "{key:?} and {other:?} at {point}, {i} {j}");
            }
        }
        let Some(above) = key.parent() else { continue };
        let above = atlas.page(above);
        for (i, j) in (0..=last).step_by(2).flat_map(|j| (0..=last).step_by(2).map(move |i| (i, j)))
        {
            let point = key.sample(i, j);
            assert_eq!(height_bits(&page, point), height_bits(&above, point), "{key:?} {i} {j}");
        }
    }
}

fn check(archives: &[&Path], scene: Scene, sites: &[Geodetic]) {
    let atlas = Atlas::open(archives, scene);
    sites.iter().for_each(|&site| check_around(&atlas, site));
}

#[test]
fn pages_agree_on_a_world_at_its_poles_and_at_180_degrees() {
    let folder = tempfile::tempdir().unwrap();
    let world = Sheet::world(2.0).write_whole(&folder.path().join("w.tif"), world_m);
    let output = folder.path().join("w.pmtiles");
    build(&options(&[world], &output)).unwrap();
    let sites = [
        at(90.0, 0.0),
        at(-90.0, 0.0),
        at(10.0, 180.0),
        at(-70.0, -180.0),
        at(0.0, 90.0),
        at(0.0, 0.0),
        at(40.0, 33.0),
    ];
    check(&[&output], EARTH, &sites);
    check(&[&output], Scene { detail: None, ..EARTH }, &sites[..4]);
}

#[test]
fn pages_agree_inside_at_the_edge_and_outside_of_an_inset() {
    let folder = tempfile::tempdir().unwrap();
    let world = Sheet::world(2.0).write_whole(&folder.path().join("w.tif"), world_m);
    let inset = Sheet::new([10.0, 46.25], 0.0025, [101, 101]);
    let inset = inset.write_whole(&folder.path().join("i.tif"), rugged_m);
    let path = |name: &str| folder.path().join(name);
    build(&options(&[world.clone(), inset.clone()], &path("both.pmtiles"))).unwrap();
    build(&options(&[world], &path("w.pmtiles"))).unwrap();
    build(&options(&[inset], &path("i.pmtiles"))).unwrap();
    let sites = [
        at(46.1, 10.1),
        at(46.0, 10.13),
        at(45.995, 10.13),
        at(46.25, 10.25),
        at(46.26, 10.259),
        at(46.3, 10.3),
    ];
    check(&[&path("both.pmtiles")], EARTH, &sites);
    check(&[&path("i.pmtiles"), &path("w.pmtiles")], EARTH, &sites);
    check(&[&path("i.pmtiles")], EARTH, &sites);
    check(&[&path("i.pmtiles")], Scene { detail: None, ..EARTH }, &sites);
}

#[test]
fn pages_agree_where_two_srtm_tiles_meet() {
    let Some(data) = shared_data("pages_agree_where_two_srtm_tiles_meet") else { return };
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("a.pmtiles");
    let inputs = ["N49E011", "N50E011"].map(|name| data.join(format!("dem/{name}.hgt.zip")));
    build(&options(&inputs, &output)).unwrap();
    check(&[&output], EARTH, &[at(50.0, 11.3), at(50.0, 11.0), at(50.0, 12.001), at(49.4, 11.7)]);
}

#[test]
fn below_the_data_its_own_points_keep_their_heights_and_without_detail_all_is_linear() {
    let folder = tempfile::tempdir().unwrap();
    let input = Sheet::new([10.0, 46.25], 0.0025, [101, 101]);
    let input = input.write_whole(&folder.path().join("i.tif"), rugged_m);
    let output = folder.path().join("a.pmtiles");
    build(&options(&[input], &output)).unwrap();
    let site = Place::of(at(46.12, 10.11).normal());
    for detail in [1.0, 0.0] {
        let atlas = Atlas::open(&[&output], Scene { detail: Some(detail), ..EARTH });
        let last = atlas.page(site.page(atlas.depth()));
        let mut moved_m = 0.0_f64;
        for beyond in 1..=BEYOND {
            let page = atlas.page(site.page(atlas.depth() + beyond));
            let stride = 1 << beyond;
            // Whole cells of the data's samples, and along their sides.
            for (i, j) in
                (0..64 / stride * 4).map(|at| (at % 4 * stride % (64 - stride), at / 4 * stride))
            {
                let point = page.key.sample(i, j);
                assert_eq!(
                    height_bits(&page, point),
                    height_bits(&last, point),
                    "{beyond} {i} {j}"
                );
                let height_m = |i: usize| f64::from(page.heights_m[j * PAGE_SIDE + i]);
                let middle_m = f64::midpoint(height_m(i), height_m(i + stride));
                moved_m = moved_m.max((height_m(i + stride / 2) - middle_m).abs());
            }
        }
        // Half a bit of f32 at 2400 m.
        let is_linear = moved_m <= 2.5e-4;
        assert_eq!(is_linear, detail == 0.0, "detail {detail} moves the ground by {moved_m} m");
    }
}
