//! Lines over the ground: rays and sights against stepping and bisection.
//!
//! In:    procedural mountains; random rays from high, low, under ground, grazing.
//! Out:   passes or fails, and what was measured.
//! Keeps: nothing.
//! Not here: single heights (`ground`).

mod ground_rig;

use glam::DVec3;
use ground_rig::*;
use overfly_core::datasource::PageKey;
use overfly_core::digest::mix;
use overfly_core::geodesy::{Ecef, Geodetic};
use overfly_core::ground::{Answer, Ground, Hit, Place, Query, Refraction, Region, Sight};
use overfly_core::units::Metres;

/// Height of a point above the surface.
fn above_m(ground: &Ground, point: DVec3, query: Query) -> f64 {
    ground.agl(Ecef(point), query).found().expect("resident").agl_m
}

/// First place below the surface by steps of `step_m`, then by bisection.
fn stepped(
    ground: &Ground,
    (origin, direction): (DVec3, DVec3),
    (max_m, step_m): (f64, f64),
    query: Query,
) -> Option<f64> {
    let below = |t: f64| above_m(ground, origin + direction * t, query) < 0.0;
    let steps = (1..).map(|i| f64::from(i) * step_m).take_while(|&t| t < max_m + step_m);
    let first_m = steps.map(|t| t.min(max_m)).find(|&t| below(t))?;
    let (mut low, mut high) = (first_m - step_m, first_m);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        (low, high) = if below(middle) { (low, middle) } else { (middle, high) };
    }
    Some(high)
}

/// A random ray over a region: its beginning above the ground, and its direction.
fn ray_over(ground: &Ground, region: Region, query: Query, seed: u64) -> (DVec3, DVec3) {
    let from = place_in(region, seed);
    let ground_m = ground.height(from, query).found().unwrap().height_m;
    let agl_m = [2.0, 50.0, 400.0, 3_000.0][usize::try_from(mix(seed) % 4).unwrap()];
    let from = Geodetic { height_m: ground_m + agl_m * (0.1 + unit(seed ^ 1)), ..from };
    let turn = Geodetic::from_degrees(0.0, 360.0 * unit(seed ^ 2), 0.0).normal();
    // From steeply down to slightly up, most of them nearly level.
    let pitch = [-1.0, -0.2, -0.05, 0.02][usize::try_from(mix(seed ^ 3) % 4).unwrap()];
    let local = DVec3::new(turn.x, turn.y, pitch * unit(seed ^ 4));
    (EARTH.ecef_from_geodetic(from).0, (from.enu_axes() * local).normalize())
}

fn hit_of(answer: Answer<Option<Hit>>) -> Option<Hit> {
    answer.found().expect("all pages are resident")
}

/// Rays against stepping: how many hit, the greatest difference, and which levels were hit.
fn compare(ground: &Ground, region: Region, query: Query, rays: u64) -> (u32, f64, u64) {
    let (max_m, step_m) = (5_000.0, 4.0);
    let (mut hits, mut worst_m, mut levels) = (0, 0.0_f64, 0);
    for seed in 0..rays {
        let (origin, direction) = ray_over(ground, region, query, seed);
        let hit = hit_of(ground.ray(Ecef(origin), direction * 3.0, max_m, query));
        let slow = stepped(ground, (origin, direction), (max_m, step_m), query);
        levels |= hit.map_or(0, |hit| 1 << hit.level);
        match (hit, slow) {
            (Some(hit), Some(slow_m)) if hit.distance_m > slow_m - step_m => {
                worst_m = worst_m.max((hit.distance_m - slow_m).abs());
                hits += 1;
            }
            // Steps may pass over a summit or a dip; then the surface itself must be there.
            (Some(hit), _) => {
                let earlier = slow.is_none_or(|slow_m| hit.distance_m < slow_m);
                assert!(earlier, "ray {seed} hit at {} m, not {slow:?}", hit.distance_m);
                let at_hit_m = above_m(ground, hit.point.0, query);
                assert!(at_hit_m.abs() < 1e-5, "ray {seed}: {at_hit_m} m above at {hit:?}");
                let behind_m = above_m(ground, hit.point.0 + direction * 1e-3, query);
                assert!(behind_m < 1e-5, "ray {seed}: {behind_m} m");
            }
            (None, None) => {}
            (None, Some(slow_m)) => panic!("ray {seed} missed the ground at {slow_m} m"),
        }
    }
    (hits, worst_m, levels)
}

#[test]
fn rays_hit_first_where_stepping_does() {
    let generator = generator();
    let centre = mountain(&generator);
    let wide = disc(centre, 16_000.0);
    let ground = ground_of(&pages_of(&generator, wide, 28), true);
    let near = disc(centre, 6_000.0);
    for level in [28, 27, 24, 15, 9] {
        let (hits, worst_m, _) = compare(&ground, near, Query::Exact(level), 300);
        println!("level {level}: {hits} hits, {worst_m:e} m apart at most");
        assert!(hits > 60, "{hits}");
        // Walls of prisms lean by as much as verticals miss edges.
        let most_m = if level < 20 { 2e-2 } else { 1e-3 };
        assert!(worst_m < most_m, "level {level}: {worst_m} m");
    }
}

#[test]
fn rays_meet_ground_of_mixed_levels_and_its_steps() {
    let generator = generator();
    let centre = mountain(&generator);
    let mut pages = pages_of(&generator, disc(centre, 16_000.0), 26);
    let fine = pages_of(&generator, disc(centre, 2_500.0), 34);
    pages.extend(fine.into_iter().filter(|page| page.key.depth() > 7));
    let ground = ground_of(&pages, false);
    for query in [Query::BestResident, Query::Within(Metres(30.0)), Query::Within(Metres(10.0))] {
        let (hits, worst_m, levels) = compare(&ground, disc(centre, 6_000.0), query, 300);
        println!("{query:?}: {hits} hits, levels {levels:b}, {worst_m:e} m apart at most");
        assert!(levels.count_ones() > 1, "{levels:b}");
        assert!(hits > 60 && worst_m < 1e-3, "{hits} {worst_m}");
    }
}

#[test]
fn a_ray_says_when_it_passed_what_is_coarse_or_not_there() {
    let generator = generator();
    let centre = mountain(&generator);
    let pages = pages_of(&generator, disc(centre, 2_000.0), 26);
    let ground = ground_of(&pages, true);
    let above = Geodetic { height_m: 12_000.0, ..centre };
    let (eye, axes) = (EARTH.ecef_from_geodetic(above), above.enu_axes());
    let down = ground.ray(eye, -axes.z_axis, 1e5, Query::Exact(26));
    assert!(matches!(down, Answer::Ok(Some(hit)) if hit.level == 26), "{down:?}");
    let up = ground.ray(eye, axes.z_axis, f64::INFINITY, Query::Exact(26));
    assert_eq!(up, Answer::Ok(None));
    let aslant = ground.ray(eye, axes.x_axis - axes.z_axis * 0.07, 1e6, Query::Exact(26));
    assert!(matches!(aslant, Answer::Coarser(Some(hit)) if hit.level < 26), "{aslant:?}");
    let mut ground = ground;
    remove(&mut ground, Place::of(-centre.normal()).page(0));
    let other_side = ground.ray(Ecef(-eye.0), axes.z_axis, 1e5, Query::Exact(26));
    assert_eq!(other_side, Answer::NotReady);
    let deep = EARTH.ecef_from_geodetic(Geodetic { height_m: -500.0, ..centre });
    let under = ground.ray(deep, axes.x_axis, 1e4, Query::Exact(26)).ok().flatten();
    assert_eq!(under.map(|hit| hit.distance_m), Some(0.0));
    for (direction, max_m) in [(DVec3::ZERO, 1.0), (DVec3::X, -1.0), (DVec3::X, f64::NAN)] {
        assert_eq!(ground.ray(eye, direction, max_m, Query::Exact(9)), Answer::Refused);
    }
}

#[test]
fn rays_over_the_poles_and_from_orbit_hit_the_ground() {
    let generator = generator();
    let roots: Vec<_> = (0..4).map(PageKey::root).collect();
    let pages: Vec<_> = roots.into_iter().map(|key| generator.page(key)).collect();
    let ground = ground_of(&pages, true);
    for i in 0..400_u64 {
        let from = at(180.0 * unit(i) - 90.0, 360.0 * unit(!i) - 180.0);
        let height_m = [3e4, 4e5, 3.6e7, 4e8][usize::try_from(i % 4).unwrap()];
        let eye = EARTH.ecef_from_geodetic(Geodetic { height_m, ..from }).0;
        let goal = at(180.0 * unit(i ^ 99) - 90.0, 360.0 * unit(i ^ 98)).normal() * 5.0e6;
        let direction = (goal - eye).normalize();
        let hit = hit_of(ground.ray(Ecef(eye), direction, f64::INFINITY, Query::Exact(12)));
        let hit = hit.expect("it aims at the inside of the body");
        // Steps across edges of this level reach 4 cm.
        assert!(above_m(&ground, hit.point.0, Query::Exact(12)).abs() < 0.05, "{i}: {hit:?}");
        let slow = stepped(&ground, (eye, direction), (hit.distance_m, 2e4), Query::Exact(12));
        assert!(slow.is_none_or(|slow_m| (slow_m - hit.distance_m).abs() < 1.0), "{i}: {slow:?}");
    }
}

#[test]
fn sights_are_the_same_both_ways_and_agree_with_stepping() {
    let generator = generator();
    let centre = mountain(&generator);
    let ground = ground_of(&pages_of(&generator, disc(centre, 16_000.0), 24), true);
    let query = Query::Exact(24);
    let (mut clear, mut blocked) = (0, 0);
    for seed in 0..250_u64 {
        let ends = [seed << 8, seed << 8 | 1].map(|seed| {
            let place = place_in(disc(centre, 8_000.0), seed);
            let ground_m = ground.height(place, query).ok().unwrap().height_m;
            let height_m = ground_m + 2.0 + 1_500.0 * unit(seed ^ 5) * unit(seed ^ 6);
            EARTH.ecef_from_geodetic(Geodetic { height_m, ..place })
        });
        for refraction in [Refraction::None, Refraction::FourThirds] {
            let there = ground.line_of_sight(ends[0], ends[1], refraction, query).ok().unwrap();
            let back = ground.line_of_sight(ends[1], ends[0], refraction, query).ok().unwrap();
            let least_m = least_clearance_m(&ground, ends, refraction, query);
            match (there, back) {
                (Sight::Clear { clearance_m }, Sight::Clear { clearance_m: other_m }) => {
                    assert_eq!(clearance_m.to_bits(), other_m.to_bits());
                    let (low_m, high_m) = (least_m - 8.0, least_m + 1e-3);
                    assert!((low_m..=high_m).contains(&clearance_m), "{clearance_m} {least_m}");
                    clear += 1;
                }
                (Sight::Blocked(_), Sight::Blocked(_)) => {
                    assert!(least_m < 8.0, "{seed}: blocked, yet {least_m} m clear");
                    blocked += 1;
                }
                other => panic!("{other:?}"),
            }
        }
    }
    println!("{clear} clear, {blocked} blocked");
    assert!(clear > 50 && blocked > 50, "{clear} {blocked}");
}

/// Least height of a sight above the surface at steps of some metres.
fn least_clearance_m(
    ground: &Ground,
    [a, b]: [Ecef; 2],
    refraction: Refraction,
    query: Query,
) -> f64 {
    let away = b.0 - a.0;
    let length_m = away.length();
    let bend = if refraction == Refraction::None { 0.0 } else { 1.0 / (8.0 * 6_371_008.77) };
    (0..=2_000).fold(f64::INFINITY, |least_m, i| {
        let share = f64::from(i) / 2_000.0;
        let bend_m = bend * share * (1.0 - share) * length_m * length_m;
        least_m.min(above_m(ground, a.0 + away * share, query) + bend_m)
    })
}

#[test]
fn refraction_lets_radio_see_beyond_the_optical_horizon() {
    let generator = generator();
    let roots: Vec<_> = (0..4).map(PageKey::root).collect();
    let mut flat: Vec<_> = roots.into_iter().map(|key| generator.page(key)).collect();
    for page in &mut flat {
        let page = std::sync::Arc::make_mut(page);
        page.heights_m.fill(0.0);
        page.bounds.fill(overfly_core::datasource::page::Bound::default());
    }
    // Coarse triangles sag: two places over one flat triangle.
    let ground = ground_of(&flat, false);
    let eye =
        |lon: f64, height_m: f64| EARTH.ecef_from_geodetic(Geodetic { height_m, ..at(10.2, lon) });
    let query = Query::Exact(12);
    let sight = |height_m: f64, refraction| {
        let (a, b) = (eye(20.0, height_m), eye(23.0, height_m));
        let answer = ground.line_of_sight(a, b, refraction, query).ok().unwrap();
        if let Sight::Clear { clearance_m } = answer { Some(clearance_m) } else { None }
    };
    let (straight, bent) =
        (sight(3_000.0, Refraction::None), sight(3_000.0, Refraction::FourThirds));
    let gain_m = bent.unwrap() - straight.unwrap();
    let half_m = 0.5 * (eye(20.0, 3e3).0 - eye(23.0, 3e3).0).length();
    let most_m = half_m * half_m / (8.0 * 6_371_008.77);
    assert!(gain_m > 0.3 * most_m && gain_m <= most_m + 1e-3, "{gain_m} of {most_m} m");
    let between = (0..4_000).map(f64::from).find(|&h| sight(h, Refraction::FourThirds).is_some());
    let height_m = between.expect("high enough is clear");
    assert_eq!(sight(height_m, Refraction::None), None, "{height_m} m");
    let nobody = Ground::new(EARTH, false);
    let answer = nobody.line_of_sight(eye(0.0, 1.0), eye(1.0, 1.0), Refraction::None, query);
    assert_eq!(answer, Answer::NotReady);
}
