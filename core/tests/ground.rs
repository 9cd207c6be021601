//! Heights of the ground: pure, continuous, the mesh's own, within their bounds.
//!
//! In:    procedural pages around mountains, shores, borders and poles; settled meshes.
//! Out:   passes or fails, and what was measured.
//! Keeps: nothing.
//! Not here: rays and sights (`ground_lines`), regions and patches (`ground_regions`).

mod ground_rig;

use glam::{DVec3, IVec3};
use ground_rig::*;
use overfly_core::datasource::generate::Generator;
use overfly_core::datasource::page::Origin;
use overfly_core::datasource::{Page, PageKey};
use overfly_core::digest::{Chain, mix};
use overfly_core::geodesy::{Ecef, Geodetic};
use overfly_core::ground::{Answer, Ground, Height, LEVEL_MAX, Place, Query};
use overfly_core::lattice::{key_of, middle, normal_of};
use overfly_core::lod::audit::triangles;
use overfly_core::settings::SceneSettings;
use overfly_core::units::Metres;
use std::sync::Arc;

fn bits_of(answer: &Answer) -> u64 {
    let mut chain = Chain::default();
    let (kind, height) = match answer {
        Answer::Ok(height) => (1, Some(height)),
        Answer::Coarser(height) => (2, Some(height)),
        Answer::NotReady => (3, None),
        Answer::Refused => (4, None),
    };
    chain.add(kind);
    if let Some(h) = height {
        let numbers = [h.height_m, h.sea_level_m, h.normal.x, h.normal.y, h.normal.z, h.bound_m];
        numbers.into_iter().for_each(|x| chain.add(x.to_bits()));
        chain.add(u64::from(h.level) << 16 | (h.origin as u64) << 8 | u64::from(h.water));
    }
    chain.0
}

fn exact(ground: &Ground, place: Geodetic, level: u8) -> Height {
    ground.height(place, Query::Exact(level)).ok().expect("the page is resident")
}

/// Halves a triangle, right angle first, as often as told.
fn bisect([apex, start, end]: [IVec3; 3], times: u8, visit: &mut impl FnMut([IVec3; 3])) {
    if times == 0 {
        return visit([apex, start, end]);
    }
    let between = middle(start, end);
    bisect([between, apex, start], times - 1, visit);
    bisect([between, end, apex], times - 1, visit);
}

#[test]
fn every_leaf_of_a_mesh_and_every_half_of_it_is_found_with_its_own_three_points() {
    let mut levels = 0_u64;
    for (patch_depth, height_m) in [(0, 900.0), (0, 20_000.0), (4, 2_000.0), (8, 9_000.0)] {
        let mut rig = Rig::new(&scene(patch_depth, 40_000), 0);
        let place = Geodetic { height_m, ..at(20.0, 30.0) };
        rig.settle(&[view(&EARTH, place, 40.0, -20.0)]);
        let (lod, patches) = (rig.terrain.lod(), rig.terrain.patches());
        let diamonds = &lod.mesh.diamonds;
        let mut checked = 0;
        let sides = diamonds.ids().flat_map(|id| [(id, 0), (id, 1)]);
        for (id, side) in sides.filter(|&(id, side)| lod.cover.patches[id][side].is_some()) {
            let level = diamonds[id].level() + patch_depth;
            levels |= 1 << level;
            bisect(diamonds.shape(id).triangle(side), patch_depth, &mut |three| {
                assert_found(three, level);
                checked += 1;
            });
        }
        assert_eq!(checked, triangles(diamonds, &lod.cover, &patches).len());
        assert!(checked > 30_000, "{checked}");
    }
    println!("levels {levels:b}");
    assert!(levels.count_ones() >= 25, "{levels:b}");
}

fn assert_found(three: [IVec3; 3], level: u8) {
    let middle = (three[0].as_dvec3() + three[1].as_dvec3() + three[2].as_dvec3()).normalize();
    let (cell, corners, weights) = Place::of(middle).triangle(level);
    let keys = |points: [IVec3; 3]| {
        let mut keys = points.map(key_of);
        keys.sort_unstable();
        keys
    };
    let found = corners.map(|corner| cell.point(corner));
    assert_eq!(keys(three), keys(found), "level {level}: {three:?}, not {found:?}");
    // The finest triangles are 4 units wide, on a grid of doubles of 2⁻²².
    assert!(weights.iter().all(|w| (w - 1.0 / 3.0).abs() < 1e-6), "{weights:?}");
}

#[test]
fn heights_at_the_vertices_of_a_mesh_are_those_of_the_mesh() {
    for patch_depth in [0, 4] {
        let mut rig = Rig::new(&scene(patch_depth, 30_000), 0);
        let place = mountain(&rig.generator);
        let eye = Geodetic { height_m: 6_000.0, ..place };
        rig.settle(&[view(&EARTH, eye, 30.0, -35.0)]);
        let ground = ground_of(&resident_pages(&rig), true);
        let (lod, patches) = (rig.terrain.lod(), rig.terrain.patches());
        let (mut worst_m, mut checked) = (0.0_f64, 0);
        let diamonds = &lod.mesh.diamonds;
        let slots = diamonds.ids().flat_map(|id| {
            let level = diamonds[id].level() + patch_depth;
            lod.cover.patches[id].into_iter().flatten().map(move |slot| (level, slot))
        });
        for (level, slot) in slots {
            for vertex in patches.vertices_of(slot).iter().step_by(5) {
                let [hi, lo] = [vertex.position.hi, vertex.position.lo]
                    .map(|part| DVec3::from_array(part.map(f64::from)));
                // Rounding may lead across the border of a page, where its level is not there.
                let contact = ground.agl(Ecef(hi + lo), Query::Exact(level)).ok();
                checked += u32::from(contact.is_some());
                worst_m = contact.map_or(worst_m, |contact| worst_m.max(contact.agl_m.abs()));
            }
        }
        println!("k = {patch_depth}: {worst_m:e} m at {checked} vertices");
        assert!(checked > 3_000 && worst_m < 5e-8, "{worst_m} m");
    }
}

fn probes(default: u64) -> u64 {
    std::env::var("OVERFLY_PROBES").ok().and_then(|n| n.parse().ok()).unwrap_or(default)
}

/// Of all kinds: most of them within the pages, some far away, some refused.
fn probe(region: overfly_core::ground::Region, i: u64) -> (Geodetic, Query) {
    let place = match mix(i) % 8 {
        0 => at(180.0 * unit(i) - 90.0, 720.0 * unit(!i) - 360.0),
        1 => Geodetic { lat_rad: 2.0, ..place_in(region, i) },
        _ => place_in(region, i),
    };
    let query = match mix(i ^ 5) % 4 {
        0 => Query::BestResident,
        1 => Query::Within(Metres(0.1 + 400.0 * unit(i ^ 6))),
        _ => Query::Exact(u8::try_from(mix(i ^ 9) % 36).unwrap()),
    };
    (place, query)
}

fn digest_of(ground: &Ground, region: overfly_core::ground::Region, from: u64, to: u64) -> u64 {
    (from..to).fold(0, |sum, i| {
        let (place, query) = probe(region, i);
        sum.wrapping_add(mix(bits_of(&ground.height(place, query)) ^ i))
    })
}

#[test]
fn the_same_bits_from_any_thread_in_any_order_of_arrival_and_after_eviction() {
    let generator = generator();
    let region = disc(mountain(&generator), 20_000.0);
    let mut pages = pages_of(&generator, region, 30);
    let count = probes(100_000);
    let ground = ground_of(&pages, true);
    let alone = digest_of(&ground, region, 0, count);
    let shared = std::thread::scope(|scope| {
        let run = |turn: u64| {
            let ground = ground.clone();
            let (from, to) = (count * turn / 4, count * (turn + 1) / 4);
            scope.spawn(move || digest_of(&ground, region, from, to))
        };
        let threads = [0, 1, 2, 3].map(run);
        threads.into_iter().map(|t| t.join().unwrap()).fold(0_u64, u64::wrapping_add)
    });
    assert_eq!(shared, alone);
    pages.sort_by_key(|page| mix(page.key.bits()));
    let mut other = ground_of(&pages, true);
    assert_eq!(digest_of(&other, region, 0, count), alone);
    let snapshot = other.clone();
    pages.iter().step_by(2).for_each(|page| remove(&mut other, page.key));
    assert_ne!(digest_of(&other, region, 0, count), alone);
    assert_eq!(digest_of(&snapshot, region, 0, count), alone);
    for page in pages.iter().step_by(2) {
        assert!(other.insert(Arc::clone(page)).is_none());
    }
    assert_eq!(digest_of(&other, region, 0, count), alone);
    assert_eq!(other.pages(), pages.len());
}

#[test]
fn exact_and_within_do_not_change_as_finer_pages_come() {
    let generator = generator();
    let region = disc(mountain(&generator), 3_000.0);
    let pages = pages_of(&generator, region, 36);
    let (mut ground, mut before) = (Ground::new(EARTH, true), Vec::new());
    for (page, next) in pages.iter().zip(pages.iter().skip(1).map(Some).chain([None])) {
        ground.insert(Arc::clone(page));
        if next.is_some_and(|next| next.key.depth() == page.key.depth()) {
            continue;
        }
        let answers: Vec<_> = (0..2_000_u64)
            .map(|i| {
                let level = u8::try_from(mix(i) % 37).unwrap();
                let bound = Metres(0.5 + 300.0 * unit(i ^ 3));
                let query = if i % 3 == 0 { Query::Within(bound) } else { Query::Exact(level) };
                ground.height(place_in(region, i), query)
            })
            .collect();
        let stays = |(old, new): (&Answer, &Answer)| {
            !matches!(old, Answer::Ok(_)) || bits_of(old) == bits_of(new)
        };
        assert!(before.iter().zip(&answers).all(stays), "depth {}", page.key.depth());
        before = answers;
    }
    let count = before.iter().filter(|answer| matches!(answer, Answer::Ok(_))).count();
    assert!(count > 1_500, "{count} answers as asked");
}

#[test]
fn batches_equal_single_questions_bit_for_bit() {
    let generator = generator();
    let region = disc(mountain(&generator), 20_000.0);
    let ground = ground_of(&pages_of(&generator, region, 28), true);
    let places: Vec<_> = (0..1_000).map(|i| probe(region, i).0).collect();
    let mut answers = vec![Answer::NotReady; places.len()];
    for query in (0..100).map(|i| probe(region, i).1).chain([Query::Exact(57)]) {
        ground.heights(&places, query, &mut answers);
        for (&place, answer) in places.iter().zip(&answers) {
            assert_eq!(bits_of(answer), bits_of(&ground.height(place, query)), "{place:?}");
        }
    }
}

#[test]
fn what_is_no_question_is_refused_and_any_longitude_is_fine() {
    let generator = generator();
    let ground = ground_of(&pages_of(&generator, disc(at(10.0, 20.0), 1e3), 20), true);
    let refused = |place: Geodetic, query| ground.height(place, query) == Answer::Refused;
    let here = at(10.0, 20.0);
    for wrong in [f64::NAN, f64::INFINITY, 1.571, -1.571] {
        assert!(refused(Geodetic { lat_rad: wrong, ..here }, Query::Exact(10)));
    }
    for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(refused(Geodetic { lon_rad: wrong, ..here }, Query::Exact(10)));
        let point = Ecef(DVec3::new(7e6, wrong, 0.0));
        assert_eq!(ground.agl(point, Query::Exact(10)), Answer::Refused);
    }
    assert!(refused(here, Query::Exact(LEVEL_MAX + 1)));
    assert!(refused(here, Query::Within(Metres(f64::NAN))));
    let turns = Geodetic { lon_rad: here.lon_rad + 200.0 * core::f64::consts::PI, ..here };
    let (once, often) = (exact(&ground, here, 20), exact(&ground, turns, 20));
    assert!((once.height_m - often.height_m).abs() < 1e-4);
    assert!(ground.height(at(10.0, 1e15), Query::Exact(4)).ok().is_some());
    assert_eq!(Ground::new(EARTH, true).height(here, Query::BestResident), Answer::NotReady);
    assert!(matches!(ground.height(here, Query::Exact(40)), Answer::Coarser(h) if h.level == 20));
    for centre in [DVec3::ZERO, DVec3::new(1e-3, 0.0, 0.0), DVec3::splat(1e20)] {
        assert!(ground.agl(Ecef(centre), Query::Exact(4)).ok().unwrap().agl_m.is_finite());
    }
}

/// Height of the plane at `side`, extended to the nearby `middle`: what is left of a difference
/// between two sides is a step, not a slope.
fn extended_m(ground: &Ground, side: DVec3, middle: DVec3, level: u8) -> Option<f64> {
    let foot = EARTH.surface_from_normal(side);
    let contact = ground.agl(Ecef(foot), Query::Exact(level)).ok()?;
    let normal = contact.ground.normal;
    let away = EARTH.surface_from_normal(middle) - foot;
    Some(contact.ground.height_m - normal.dot(away) / normal.dot(side))
}

/// Pairs of places 1e-9 rad on either side of a border, and what it is.
fn borders() -> Vec<(&'static str, Geodetic, Geodetic)> {
    let around = |lat: f64, lon: f64, (dlat, dlon): (f64, f64)| {
        let middle = at(lat, lon);
        let move_by = |s: f64| Geodetic {
            lat_rad: middle.lat_rad + s * dlat,
            lon_rad: middle.lon_rad + s * dlon,
            height_m: 0.0,
        };
        (move_by(1e-9), move_by(-1e-9))
    };
    let mut all = Vec::new();
    let mut add = |what, lat, lon, step| {
        let (a, b) = around(lat, lon, step);
        all.push((what, a, b));
    };
    for lat in [-61.3, -20.0, 0.0, 33.33, 75.0] {
        add("the antimeridian", lat, 180.0, (0.0, 1.0));
        add("a quadrant's border", lat, 90.0, (0.0, 1.0));
        add("a quadrant's border", lat, 0.0, (0.0, 1.0));
    }
    for lon in [0.0, 90.0, 180.0, -90.0, 33.0] {
        add("the equator", 0.0, lon, (1.0, 0.0));
        add("a corner of the equator", 0.0, lon, (1.0, 1.0));
    }
    for lat in [1.0, -1.0_f64] {
        for lon in [0.0, 45.0, 100.0] {
            let pole = |lon: f64| Geodetic {
                lat_rad: lat * (core::f64::consts::FRAC_PI_2 - 1e-9),
                ..at(0.0, lon)
            };
            all.push(("a pole", pole(lon), pole(lon + 180.0)));
        }
    }
    all
}

#[test]
fn no_border_is_a_step() {
    let generator = generator();
    let mut worst_m = 0.0_f64;
    for (what, a, b) in borders() {
        let mut ground = Ground::new(EARTH, false);
        for level in [0, 5, 12, 17, 24, 31, 32] {
            for key in [a, b].map(|side| Place::of(side.normal()).triangle(level).0.page()) {
                hold(&mut ground, key, |key| surveyed(&generator.page(key)));
            }
            let (low, high) = (exact(&ground, a, level), exact(&ground, b, level));
            let middle = (a.normal() + b.normal()).normalize();
            let sides = [a, b].map(|side| extended_m(&ground, side.normal(), middle, level));
            let step_m = (sides[0].unwrap() - sides[1].unwrap()).abs();
            worst_m = worst_m.max(step_m);
            assert!(step_m < 1e-3, "{what}: {step_m} m at {a:?}, level {level}");
            assert!((low.sea_level_m - high.sea_level_m).abs() < 1e-3, "{what}");
        }
    }
    println!("worst step at 1e-9 rad either side: {worst_m:e} m");
}

/// Makes a page unless it is there.
fn hold(ground: &mut Ground, key: PageKey, make: impl FnOnce(PageKey) -> Arc<Page>) {
    if !ground.contains(key) {
        ground.insert(make(key));
    }
}

/// The step at `middle` between two sides, whose pages are made if they are not there.
fn step_between(
    generator: &Generator,
    ground: &mut Ground,
    (sides, middle): ([DVec3; 2], DVec3),
    level: u8,
) -> f64 {
    for key in sides.map(|side| Place::of(side).triangle(level).0.page()) {
        hold(ground, key, |key| generator.page(key));
    }
    let [a, b] = sides.map(|side| extended_m(ground, side, middle, level).unwrap());
    (a - b).abs()
}

#[test]
fn page_borders_are_no_steps_at_any_level() {
    let generator = generator();
    let place = mountain(&generator);
    let mut worst_m = [0.0_f64; 45];
    for depth in 1..=16_u8 {
        let inside = Place::of(place.normal());
        let key = inside.page(depth);
        let mut ground = Ground::new(EARTH, true);
        for i in 0..40 {
            let corner = key.sample(usize::from(i % 2 == 0) * 64, 0);
            let along = key.sample(usize::from(i % 2 == 0) * 64, 64);
            let share = unit(u64::from(depth) << 8 | i);
            let middle = (corner.as_dvec3() * share + along.as_dvec3() * (1.0 - share)).normalize();
            let across = (corner - along).as_dvec3().normalize().cross(middle);
            let sides = [1e-9, -1e-9].map(|s| (middle + across * s).normalize());
            for level in [2 * depth + 11, 2 * depth + 12] {
                let step_m = step_between(&generator, &mut ground, (sides, middle), level);
                let kept_m = &mut worst_m[usize::from(level)];
                *kept_m = kept_m.max(step_m);
                assert!(
                    step_m < step_bound_m(level).max(1e-3),
                    "{step_m} m at depth {depth}, level {level}"
                );
            }
        }
    }
    println!("{:?}", worst_m.map(|m| format!("{m:.1e}")));
}

/// What a step may be: f·e²/(8R), the edge at most 2.45 cells of 10 000 km/2ⁿ, where slopes differ
/// by at most 2.
fn step_bound_m(level: u8) -> f64 {
    let edge_m = 2.45 * 1.0e7 / f64::from(1_u32 << (level / 2));
    EARTH.f * edge_m * edge_m / (8.0 * 6.3e6) * 2.0 + 2e-8
}

/// The greatest step across edges of triangles of one level on mountains.
fn step_of_level(ground: &Ground, region: overfly_core::ground::Region, level: u8) -> f64 {
    (0..3_000_u64).fold(0.0, |worst: f64, i| {
        let place = Place::of(place_in(region, i).normal());
        let (cell, corners, _) = place.triangle(level);
        let edge = |a: usize, b: usize, share: f64| {
            let (a, b) = (cell.point(corners[a]).as_dvec3(), cell.point(corners[b]).as_dvec3());
            (a * share + b * (1.0 - share), a - b)
        };
        let which = usize::try_from(mix(i) % 3).unwrap();
        let (on, along) = edge(which, (which + 1) % 3, unit(i ^ 77));
        let across = along.normalize().cross(on.normalize());
        let on = on.normalize();
        let at_side = |s: f64| extended_m(ground, (on + across * s).normalize(), on, level);
        let (Some(a), Some(b)) = (at_side(1e-12), at_side(-1e-12)) else { return worst };
        worst.max((a - b).abs())
    })
}

#[test]
fn steps_between_triangles_shrink_with_the_square_of_their_edge() {
    let generator = generator();
    let region = disc(mountain(&generator), 2_000.0);
    let ground = ground_of(&pages_of(&generator, region, 36), false);
    for level in 12..=36 {
        let step_m = step_of_level(&ground, region, level);
        println!("level {level}: step {step_m:e} m");
        assert!(step_m < step_bound_m(level), "level {level}: {step_m} m");
        assert!(level < 33 || step_m < 1e-6, "level {level}: {step_m} m");
    }
}

#[test]
fn moving_by_a_centimetre_moves_the_ground_by_less_than_two() {
    let generator = generator();
    let region = disc(mountain(&generator), 1_500.0);
    let ground = ground_of(&pages_of(&generator, region, 36), true);
    let (mut worst_m, mut steep) = (0.0_f64, 0);
    for i in 0..40_000_u64 {
        let from = place_in(region, i);
        let turn = Geodetic::from_degrees(0.0, 360.0 * unit(i ^ 0xC3), 0.0).normal();
        let to = beside(from, 0.01 * turn.x, 0.01 * turn.y);
        let level = 24 + u8::try_from(mix(i) % 13).unwrap();
        let (a, b) = (exact(&ground, from, level), exact(&ground, to, level));
        let gentle = [a, b].iter().all(|h| h.normal.dot(from.normal()) > 0.5_f64.sqrt());
        steep += u32::from(!gentle);
        if gentle {
            worst_m = worst_m.max((a.height_m - b.height_m).abs());
        }
    }
    println!("1 cm moved the ground by {worst_m} m at most; {steep} places were steeper than 45°");
    assert!(worst_m < 0.02 && worst_m > 0.003, "{worst_m}");
}

#[test]
fn agl_is_signed_and_agrees_with_height() {
    let generator = generator();
    let region = disc(mountain(&generator), 10_000.0);
    let ground = ground_of(&pages_of(&generator, region, 28), true);
    for i in 0..3_000_u64 {
        let place = place_in(region, i);
        let height = exact(&ground, place, 28);
        let agl_m = if i % 3 == 0 { -50.0 } else { 1e4 } * unit(i ^ 4);
        let point = Geodetic { height_m: height.height_m + agl_m, ..place };
        let point = EARTH.ecef_from_geodetic(point);
        let contact = ground.agl(point, Query::Exact(28)).ok().unwrap();
        assert!((contact.agl_m - agl_m).abs() < 2e-8, "{} {agl_m}", contact.agl_m);
        assert!(contact.agl_m.signum() == agl_m.signum());
        assert!(((point.0 - contact.contact.0).length() - agl_m.abs()).abs() < 2e-8);
        assert!((contact.ground.normal - height.normal).length() < 1e-9);
        assert!((contact.ground.normal.length() - 1.0).abs() < 1e-12);
        assert!(contact.ground.normal.dot(place.normal()) > 0.0);
    }
}

/// The worst difference from a level to any finer one and to the ground, as a share of its bound.
fn worst_ratio(heights: &[Height], ground_m: f64) -> f64 {
    let ratios = heights.iter().enumerate().flat_map(|(level, height)| {
        let others_m = heights[level..].iter().map(|finer| finer.height_m).chain([ground_m]);
        others_m.map(|other_m| (height.height_m - other_m).abs() / height.bound_m)
    });
    ratios.fold(0.0, f64::max)
}

#[test]
fn heights_stray_from_finer_levels_and_the_planet_by_no_more_than_their_bound() {
    let wet = generator();
    // Bounds of a scene's pages are those of what it draws: without a sea they know of the bed.
    let dry = Generator::new(&SceneSettings { sea: false, ..scene(4, 30_000) });
    let mut worst = 0.0_f64;
    for (generator, region, sea) in [
        (&wet, disc(mountain(&wet), 4_000.0), true),
        (&wet, disc(shore(&wet), 4_000.0), true),
        (&dry, disc(shore(&wet), 4_000.0), false),
    ] {
        let ground = ground_of(&pages_of(generator, region, 34), sea);
        for i in 0..400 {
            let place = place_in(region, i);
            let ground_m = generator.planet().unwrap().sample(place.normal()).height_m;
            let ground_m = if sea { ground_m.max(0.0) } else { ground_m };
            let heights: Vec<_> = (0..=34).map(|level| exact(&ground, place, level)).collect();
            worst = worst.max(worst_ratio(&heights, ground_m));
        }
    }
    println!("worst error over bound: {worst:.3}");
    assert!(worst <= 1.0, "{worst}");
    assert!(worst > 0.05, "{worst}: the bounds say nothing");
}

#[test]
fn within_takes_the_coarsest_level_that_is_good_enough() {
    let generator = generator();
    let region = disc(mountain(&generator), 2_000.0);
    let ground = ground_of(&pages_of(&generator, region, 34), true);
    for i in 0..500_u64 {
        let place = place_in(region, i);
        let bound_m = 2.0 + 500.0 * unit(i) * unit(i ^ 1);
        match ground.height(place, Query::Within(Metres(bound_m))) {
            Answer::Ok(height) => {
                assert!(height.bound_m <= bound_m);
                assert_eq!(height, exact(&ground, place, height.level));
                let coarser = (11..height.level).map(|level| exact(&ground, place, level).bound_m);
                assert!(coarser.into_iter().all(|other_m| other_m > bound_m));
            }
            Answer::Coarser(height) => {
                assert!(height.bound_m > bound_m);
                assert_eq!(height.level, 34);
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_survey_lifts_the_ground_to_its_sea_level_and_names_its_origin() {
    let generator = generator();
    for (centre, sea) in
        [(mountain(&generator), true), (shore(&generator), true), (shore(&generator), false)]
    {
        let region = disc(centre, 5_000.0);
        let pages = pages_of(&generator, region, 28);
        let plain = ground_of(&pages, sea);
        let lifted: Vec<_> = pages.iter().map(|page| surveyed(page)).collect();
        let lifted = ground_of(&lifted, sea);
        let (mut wet, mut filled) = (0, 0);
        for i in 0..2_000 {
            let place = place_in(region, i);
            let (below, above) = (exact(&plain, place, 28), exact(&lifted, place, 28));
            let sea_level_m = f64::from(sea_level_m(place.normal()));
            assert!((above.sea_level_m - sea_level_m).abs() < 1e-3);
            assert!((above.height_m - below.height_m - above.sea_level_m).abs() < 1e-3);
            assert_eq!((below.sea_level_m, below.origin), (0.0, Origin::Procedural));
            assert_eq!(below.water, above.water);
            assert!(sea || !above.water);
            assert_ne!(above.origin, Origin::Procedural);
            wet += u32::from(above.water);
            filled += u32::from(above.origin == Origin::Filled);
        }
        assert!((500..1500).contains(&filled), "{filled}");
        assert_eq!(wet > 100, sea && centre == shore(&generator), "{wet}");
    }
}

#[test]
fn normals_are_those_of_the_planes() {
    let generator = generator();
    let region = disc(mountain(&generator), 3_000.0);
    let ground = ground_of(&pages_of(&generator, region, 26), true);
    for i in 0..500 {
        let place = Place::of(place_in(region, i).normal());
        let (cell, corners, _) = place.triangle(26);
        let points = corners.map(|corner| {
            let normal = normal_of(cell.point(corner));
            let foot = EARTH.surface_from_normal(normal);
            foot + normal * -ground.agl(Ecef(foot), Query::Exact(26)).ok().unwrap().agl_m
        });
        let height = exact(&ground, place_in(region, i), 26);
        let plane = (points[1] - points[0]).cross(points[2] - points[0]).normalize();
        assert!(plane.dot(height.normal).abs() > 1.0 - 1e-9, "{plane} {}", height.normal);
    }
}

#[test]
fn a_bare_page_has_the_samples_of_the_whole_one_and_knows_nothing_between_them() {
    let generator = Generator::new(&scene(4, 1000));
    for key in [PageKey::root(2), PageKey::new(0, 3, 5, 2), PageKey::new(1, 14, 9000, 77)] {
        let (whole, bare) = (generator.page(key), generator.bare_page_from(key, &[]));
        assert_eq!(bare.key, key);
        assert_eq!(bare.heights_m.map(f32::to_bits), whole.heights_m.map(f32::to_bits));
        assert!(bare.bounds.iter().all(|bound| bound.variation_m == f32::INFINITY));
        assert!(bare.bounds.iter().all(|bound| bound.error_even_m == f32::INFINITY));
        assert!(whole.bounds.iter().all(|bound| bound.error_odd_m.is_finite()));
    }
}
