//! Regions of the ground: bounds, pages, readiness, collision patches.
//!
//! In:    discs over procedural mountains, poles and corners of the equator.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: heights (`ground`), rays (`ground_lines`).

mod ground_rig;

use glam::DVec3;
use ground_rig::*;
use overfly_core::datasource::PageKey;
use overfly_core::geodesy::{Ecef, Enu, Geodetic};
use overfly_core::ground::*;
use std::collections::{BTreeMap, BTreeSet};

fn discs() -> Vec<Region> {
    let mut all = vec![disc(mountain(&generator()), 3_000.0)];
    let centres = [(90.0, 0.0), (-90.0, 0.0), (0.0, 0.0), (0.0, 90.0), (0.0, 180.0), (30.0, 180.0)];
    all.extend(centres.map(|(lat, lon)| disc(at(lat, lon), 2_000.0)));
    all.extend([
        disc(at(0.0, 45.0), 1_000.0),
        disc(at(-35.2, 0.0), 900.0),
        disc(at(45.0, 7.0), 0.0),
    ]);
    all
}

#[test]
fn the_pages_of_a_region_serve_every_place_of_it() {
    let ground = Ground::new(EARTH, true);
    for region in discs().into_iter().chain([disc(at(50.0, 10.0), 3.0e6)]) {
        for level in [0, 11, 14, 21, 26] {
            let level = if region.radius_m > 1e6 { level.min(18) } else { level };
            let pages = ground.pages_of(region, level, 100_000).unwrap();
            assert!(pages.is_sorted());
            for page in &pages {
                let there = |parent: PageKey| pages.binary_search(&parent).is_ok();
                assert!(page.parent().is_none_or(there), "{page:?} comes without its parent");
            }
            for seed in 0..300 {
                let place = Place::of(place_in(region, seed).normal());
                let page = place.triangle(level).0.page();
                assert!(pages.binary_search(&page).is_ok(), "{region:?} needs {page:?}");
            }
            let extent_m = 1e7 / f64::from(1_u32 << pages.last().unwrap().depth());
            let widths = 2.0 * region.radius_m / extent_m + 4.0;
            let deepest = pages.iter().filter(|p| p.depth() == pages.last().unwrap().depth());
            assert!((deepest.count() as f64) < 4.0 * widths * widths, "too many pages");
        }
    }
    let fault = ground.pages_of(disc(at(0.0, 0.0), 1e5), 40, 1_000);
    assert_eq!(fault, Err(RegionFault::TooLarge { pages_max: 1_000 }));
    for radius_m in [-1.0, f64::NAN, f64::INFINITY] {
        let fault = ground.pages_of(disc(at(0.0, 0.0), radius_m), 4, 10);
        assert_eq!(fault, Err(RegionFault::Refused));
    }
    assert_eq!(ground.pages_of(disc(at(0.0, 0.0), 1.0), 57, 10), Err(RegionFault::Refused));
}

#[test]
fn readiness_grows_with_the_pages_and_names_the_worst_level() {
    let generator = generator();
    let region = disc(mountain(&generator), 1_000.0);
    let mut ground = Ground::new(EARTH, true);
    let pages = ground.pages_of(region, 30, 1_000).unwrap();
    let ready = ground.readiness(region, 30).unwrap();
    assert_eq!((ready.fraction, ready.worst_level), (0.0, None));
    assert_eq!(ready.missing as usize, pages.len());
    let mut before = ready;
    for &key in &pages {
        ground.insert(generator.page(key));
        let ready = ground.readiness(region, 30).unwrap();
        assert!(ready.fraction > before.fraction && ready.worst_level >= before.worst_level);
        assert_eq!(ready.missing + 1, before.missing);
        before = ready;
    }
    assert_eq!(before, Readiness { fraction: 1.0, worst_level: Some(30), missing: 0 });
    remove(&mut ground, *pages.last().unwrap());
    assert_eq!(ground.readiness(region, 30).unwrap().worst_level, Some(28));
}

#[test]
fn bounds_of_a_region_enclose_every_height_in_it() {
    let generator = generator();
    let mut tightest = f64::INFINITY;
    for (region, sea) in discs().into_iter().flat_map(|region| [(region, true), (region, false)]) {
        let pages = pages_of(&generator, region, 28);
        for (count, level) in [(pages.len(), 28), (pages.len() / 2, 0)] {
            let ground = ground_of(&pages[..count], sea);
            let bounds = ground.min_max(region).ok().expect("the roots are there");
            assert!(level == 0 || bounds.level == 28, "{bounds:?}");
            let floor_m = if sea { 0.0 } else { f64::NEG_INFINITY };
            let heights_m = (0..500).map(|seed| place_in(region, seed)).flat_map(|place| {
                let planet_m = generator.planet().unwrap().sample(place.normal()).height_m;
                let height = ground.height(place, Query::BestResident).ok().unwrap();
                [planet_m.max(floor_m), height.height_m]
            });
            let (low_m, high_m) = heights_m
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), m| {
                    (low.min(m), high.max(m))
                });
            assert!(bounds.low_m <= low_m && high_m <= bounds.high_m, "{bounds:?} {region:?}");
            if level == 28 && region.radius_m == 3_000.0 {
                tightest = tightest.min((bounds.high_m - bounds.low_m) / (high_m - low_m));
            }
        }
    }
    println!("bounds are {tightest:.2} times as wide as the heights");
    assert!(tightest < 10.0, "{tightest}: the bounds say nothing");
    assert_eq!(Ground::new(EARTH, true).min_max(discs()[0]), Answer::NotReady);
    assert_eq!(Ground::new(EARTH, true).min_max(disc(at(0.0, 0.0), -1.0)), Answer::Refused);
}

/// Each edge once in each direction, but for the rim; the rim is one closed line.
fn assert_watertight(patch: &CollisionPatch) {
    let mut edges = BTreeSet::new();
    for &[a, b, c] in &patch.triangles {
        for edge in [(a, b), (b, c), (c, a)] {
            assert!(edges.insert(edge), "edge {edge:?} is used twice in one direction");
        }
    }
    let rim: BTreeMap<u32, u32> =
        edges.iter().filter(|&&(a, b)| !edges.contains(&(b, a))).copied().collect();
    let open = edges.iter().filter(|&&(a, b)| !edges.contains(&(b, a))).count();
    assert_eq!(rim.len(), open, "a corner of the rim is passed twice");
    let inner = edges.len() - open;
    let (v, e, f) = (patch.vertices.len(), inner / 2 + open, patch.triangles.len());
    assert_eq!(v + f, e + 1, "V − E + F of a disc is 1");
    let (&start, &(mut at)) = rim.iter().next().expect("a patch has a rim");
    let mut length = 1;
    while at != start {
        (at, length) = (rim[&at], length + 1);
    }
    assert_eq!(length, open, "the rim is in pieces");
}

#[test]
fn collision_patches_are_watertight_cover_their_disc_and_equal_the_heights() {
    let generator = generator();
    for region in discs() {
        let region = Region { radius_m: region.radius_m.min(1_500.0), ..region };
        let ground = ground_of(&pages_of(&generator, region, 27), true);
        for level in [27, 26] {
            let patch = ground.collision_patch(region, level, 10_000).unwrap();
            assert_watertight(&patch);
            let contacts = patch.vertices.iter().step_by(7).filter_map(|local| {
                let local = Enu(DVec3::from_array(local.map(f64::from)));
                ground.agl(local.to_ecef(patch.origin, &EARTH), Query::Exact(level)).ok()
            });
            let worst_m = contacts.map(|contact| contact.agl_m.abs()).fold(0.0, f64::max);
            assert!(worst_m < 2e-3, "a vertex is {worst_m} m off");
            for seed in 0..100 {
                assert_covered(&ground, &patch, place_in(region, seed));
            }
        }
    }
}

/// The vertical of a place meets one triangle of the patch, at the height of the place.
fn assert_covered(ground: &Ground, patch: &CollisionPatch, place: Geodetic) {
    let height = ground.height(place, Query::Exact(patch.level)).ok().unwrap();
    let point = EARTH.ecef_from_geodetic(Geodetic { height_m: height.height_m, ..place });
    let local = Enu::from_ecef(Ecef(point.0), patch.origin, &EARTH).0;
    let up = patch.origin.enu_axes().transpose() * place.normal();
    let corner = |i: u32| DVec3::from_array(patch.vertices[i as usize].map(f64::from));
    let nearest = patch.triangles.iter().filter_map(|three| {
        let [a, b, c] = three.map(corner);
        let plane = (b - a).cross(c - a);
        let within = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|&(from, to)| (to - from).cross(up).dot(local - from) <= 1e-3 * plane.length());
        within.then(|| ((local - a).dot(plane) / up.dot(plane)).abs())
    });
    let off_m = nearest.fold(f64::INFINITY, f64::min);
    assert!(off_m < 2e-3, "{off_m} m off at {place:?}");
}

#[test]
fn patches_name_the_same_triangles_alike_wherever_they_begin() {
    let generator = generator();
    for region in discs() {
        let region = Region { radius_m: 1_000.0, ..region };
        let ground = ground_of(&pages_of(&generator, disc(region.centre, 4_000.0), 28), true);
        let other = disc(beside(region.centre, 400.0, 300.0), 900.0);
        let mut names = BTreeMap::new();
        let mut again = CollisionPatch::new();
        let mut shared = 0;
        for (region, level) in [(region, 27), (region, 28), (other, 27), (other, 28)] {
            ground.fill_patch(region, level, 10_000, &mut again).unwrap();
            assert_eq!(again, ground.collision_patch(region, level, 10_000).unwrap());
            let ids: BTreeSet<_> = again.triangle_ids.iter().collect();
            assert_eq!(ids.len(), again.triangle_ids.len(), "two triangles share an id");
            for (id, three) in again.triangle_ids.iter().zip(&again.triangles) {
                let corners = three.map(|i| again.vertex_ids[i as usize]);
                shared += u32::from(names.contains_key(id));
                assert_eq!(*names.entry(*id).or_insert(corners), corners);
            }
        }
        assert!(shared > 10, "{shared}");
    }
}

#[test]
fn patches_that_cannot_be_are_refused() {
    let generator = generator();
    let region = disc(mountain(&generator), 500.0);
    let ground = ground_of(&pages_of(&generator, region, 26), true);
    let fault = ground.collision_patch(region, 26, 3).unwrap_err();
    assert_eq!(fault, PatchFault::TooLarge { triangles_max: 3 });
    let fault = ground.collision_patch(region, 30, 1_000_000).unwrap_err();
    assert!(matches!(fault, PatchFault::NotReady { page } if page.depth() == 9), "{fault}");
    for (radius_m, level) in [(-1.0, 20), (f64::NAN, 20), (1.0, 57)] {
        let fault = ground.collision_patch(disc(region.centre, radius_m), level, 10);
        assert_eq!(fault, Err(PatchFault::Refused));
    }
    let whole = disc(at(12.0, 30.0), 3e7);
    let all: Vec<_> = (0..4).map(|q| generator.page(PageKey::root(q))).collect();
    let ground = ground_of(&all, true);
    for level in [0, 1, 2, 7, 12] {
        let patch = ground.collision_patch(whole, level, 100_000).unwrap();
        let (v, f) = (patch.vertices.len(), patch.triangles.len());
        assert_eq!((f, v), (8 << level, f / 2 + 2), "a closed surface");
    }
}
