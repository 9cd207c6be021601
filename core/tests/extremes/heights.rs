//! Cases 21 to 27 and 29: ground as high as its planet, flat, needles, pits, cliffs, noise, denormals.
//!
//! In:    synthetic ground on spheres.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: shapes of the body itself (`bodies`).

use crate::gauge::Gauge;
use crate::rig::view;
use crate::synthetic::Relief;
use crate::world::{World, bare, down_on, sphere, unit};
use glam::{DVec3, IVec3};
use overfly_core::camera::{Camera, View};
use overfly_core::datasource::{Page, PageKey};
use overfly_core::frame::Terrain;
use overfly_core::geodesy::{Ecef, Geodetic};
use overfly_core::lattice::{RADIUS, fold, normal_of};
use overfly_core::lod::screen_error::{Horizon, Sight};
use std::collections::BTreeSet;
use std::sync::Arc;

const RADIUS_M: f64 = 6.4e6;

/// Distance on the screen of two points in front of the eye, in pixels.
fn apart_px(camera: &Camera, a: DVec3, b: DVec3) -> Option<f64> {
    let pixel = |at: DVec3| {
        let away = at - camera.eye.0;
        let depth_m = camera.forward.dot(away);
        let [right, up] = [camera.right, camera.up].map(|axis| axis.dot(away) / depth_m);
        let inside = right.abs() <= camera.half_tangents[0] && up.abs() <= camera.half_tangents[1];
        (depth_m > camera.near_m).then_some((right, up, inside))
    };
    let ((ar, au, inside), (br, bu, _)) = (pixel(a)?, pixel(b)?);
    inside.then(|| glam::DVec2::new(ar - br, au - bu).length() * camera.pixels_per_radian)
}

/// Whether no ground stands between the eye and a point: marched, the point's own end left out.
fn is_seen(world: &World, eye: DVec3, point: DVec3) -> bool {
    (1..400).all(|step| {
        let at = eye + (point - eye) * (f64::from(step) / 402.0);
        at.length() > world.surface(at.normalize()).length()
    })
}

#[test]
fn case_21_ground_twice_as_high_as_its_planet_is_whole_and_nothing_seen_is_culled() {
    // From -0.99 to 1.99 radii.
    let relief = Relief::Tilt { mean_m: 0.5 * RADIUS_M, swing_m: 1.49 * RADIUS_M };
    let body = sphere(RADIUS_M);
    let mut settings = bare(body, 4, 60_000);
    settings.lod.tolerance.0 = 4.0;
    let mut world = World::synthetic(&settings, relief);
    let mut checked = 0;
    for (lat, above_m, pitch_deg) in
        [(20.0, 1e5, -20.0), (-80.0, 3e6, -60.0), (-89.0, 4e4, 10.0), (5.0, 2e7, -60.0)]
    {
        let here = world.eye_above(lat, 30.0, above_m);
        world.settled(&[view(&body, here, 170.0, pitch_deg)]);
        let camera = world.output.views[0].camera;
        let gauge = Gauge::of(&world);
        for seed in 0..12_000_u64 {
            let axis = |salt: u64| unit(seed << 8 | salt) * 2.0 - 1.0;
            let normal = DVec3::new(axis(1), axis(2), axis(3)).normalize();
            let truth = world.surface(normal);
            let (radius_m, slot) = gauge.meet(normal);
            let Some(px) = apart_px(&camera, truth, normal * radius_m) else { continue };
            if is_seen(&world, camera.eye.0, truth) {
                checked += 1;
                let bound_px = world.output.counts.error_px_bound;
                assert!(px <= bound_px, "{px} of {bound_px} px at {normal}, eye {lat} {above_m}");
                let mut ranges = world.output.views[0].ranges.iter();
                assert!(ranges.any(|range| range.patches.contains(&slot)), "{normal} is not drawn");
            }
        }
    }
    assert!(checked > 1000, "{checked} places were seen");
}

#[test]
fn case_22_ground_below_the_centre_is_refused_as_source_and_as_page() {
    let body = sphere(RADIUS_M);
    let settings = bare(body, 4, 30_000);
    for height_m in [-RADIUS_M, -2.0 * RADIUS_M, -6.3937e6, f64::NEG_INFINITY] {
        let ground =
            crate::synthetic::Synthetic { relief: Relief::Flat { height_m }, body, patch_depth: 4 };
        let generator = overfly_core::datasource::generate::Generator::with_archives(
            &settings,
            vec![ground.facts()],
        );
        let Err(fault) = Terrain::checked(&settings, &generator) else { panic!("{height_m} m") };
        let words = fault.to_string();
        assert!(words.starts_with("least height of the sources in metres is "), "{words}");
        assert!(words.contains("allowed is -6393600.0 to "), "{words}");
    }
    let mut world = World::synthetic(&settings, Relief::Flat { height_m: 0.0 });
    let looking = [down_on(&body, Geodetic::from_degrees(20.0, 30.0, 1e5))];
    let before = world.settled(&looking);
    type Breaks = fn(&mut Page);
    let broken: [(Breaks, &str); 4] = [
        (|page| page.heights_m[7] = -6.4e6, "height is -6400000 m, allowed is -6393600 to "),
        (|page| page.heights_m[4224] = f32::NAN, "height is NaN m"),
        (|page| page.bounds[3].error_odd_m = f32::INFINITY, "bound is inf m, allowed is 0 to "),
        (|page| page.bounds[288].variation_m = -1.0, "bound is -1 m, allowed is 0 to "),
    ];
    for (breaks, expected) in broken {
        let mut page = Arc::unwrap_or_clone(world.page(PageKey::new(0, 3, 1, 1)));
        breaks(&mut page);
        world.input.arrived.push(Arc::new(page));
        let words = world.try_frame(&looking).unwrap_err().to_string();
        assert!(words.starts_with("page 3/0/1/1: ") && words.contains(expected), "{words}");
        world.input.arrived.clear();
        world.frame(&looking);
        assert_eq!(world.output.digest, before);
    }
}

#[test]
fn case_23_a_flat_ocean_has_as_many_triangles_as_its_curvature_asks_for() {
    let body = sphere(RADIUS_M);
    let mut settings = bare(body, 4, 400_000);
    let mut leaves = Vec::new();
    for tolerance_px in [0.002, 0.004, 0.008] {
        settings.lod.tolerance.0 = tolerance_px;
        let mut world = World::synthetic(&settings, Relief::Flat { height_m: 0.0 });
        world.settled(&[view(&body, Geodetic::from_degrees(20.0, 30.0, 3e4), 30.0, -20.0)]);
        assert_eq!(world.output.counts.error_px_bound, tolerance_px, "the tolerance decides");
        let errors_px = Gauge::of(&world).errors_px(&world, 0.0, 50);
        let most_px = errors_px[errors_px.len() - 1];
        assert!(errors_px.len() > 1000 && most_px <= tolerance_px, "{most_px}");
        let patches = world.terrain.patches();
        let flat = |slot| patches.vertices_of(slot).iter().all(|vertex| vertex.height_m == 0.0);
        assert!((0..patches.used_end()).all(flat), "no vertex is off the sea");
        leaves.push(f64::from(world.output.counts.leaves));
    }
    println!("{leaves:?} leaves");
    // A sagitta falls as the square of an edge: half the tolerance, about twice the triangles.
    for pair in leaves.windows(2) {
        assert!(pair[0] / pair[1] > 1.3 && pair[0] / pair[1] < 2.7, "{leaves:?}");
    }
}

/// Centres of the split diamonds: what the mesh is.
fn split(world: &World) -> BTreeSet<[i32; 3]> {
    let lod = world.terrain.lod();
    let diamonds = &lod.mesh.diamonds;
    let split = diamonds.ids().filter(|&id| diamonds[id].is_split());
    split.map(|id| diamonds[id].centre().to_array()).collect()
}

/// What is refined for its error is the same. Two margins are wider where ground is far above the
/// ellipsoid: the range of heights takes 0 in, so that more of the far side might be seen, and the
/// picture's edges count the height. One is narrower: a cap of normals spreads the radius by one
/// hundredth more than it spreads the height. So the raised body has nearly all that the larger one
/// has, and more.
#[test]
fn case_24_a_body_raised_by_1e5_m_has_the_mesh_of_a_larger_one_and_wider_margins() {
    let (low, high) = (sphere(RADIUS_M), sphere(RADIUS_M + 1e5));
    for (eye_m, pitch_deg, share_most) in [(3e7, -90.0, 1.08), (3e4, -20.0, 1.8)] {
        let world = |body, height_m: f64| {
            let mut settings = bare(body, 4, 400_000);
            settings.lod.tolerance.0 = 0.1;
            let mut world = World::synthetic(&settings, Relief::Flat { height_m });
            let here = Geodetic::from_degrees(20.0, 30.0, eye_m + height_m);
            world.settled(&[view(&body, here, 30.0, pitch_deg)]);
            world
        };
        let (raised, larger) = (world(low, 1e5), world(high, 0.0));
        assert_eq!(raised.output.counts.error_px_bound, larger.output.counts.error_px_bound);
        let (raised, larger) = (split(&raised), split(&larger));
        println!("{} and {} split", raised.len(), larger.len());
        let lacks = larger.difference(&raised).count();
        assert!(larger.len() > 300 && lacks * 50 <= larger.len(), "{lacks} of {}", larger.len());
        assert!(raised.len() as f64 <= share_most * larger.len() as f64, "{}", raised.len());
    }
}

/// A lattice point amid a face, a sample of deep pages only.
fn spot() -> IVec3 {
    let along = ((RADIUS / 3) & !2047) | 1024;
    fold(0, along, along)
}

/// A view at the spot from this far away and a twentieth of it up.
fn towards(world: &World, away_m: f64) -> View {
    let target = world.body().surface_from_normal(normal_of(spot()));
    let there = world.body().geodetic_from_ecef(Ecef(target));
    let turn = away_m / RADIUS_M;
    let from = Geodetic { lat_rad: there.lat_rad - turn, height_m: away_m * 0.05, ..there };
    view(&world.body(), from, 0.0, -3.0)
}

/// The highest drawn vertex.
fn peak_m(world: &World, sign: f32) -> f32 {
    let patches = world.terrain.patches();
    let live = (0..patches.used_end()).filter(|&slot| patches.leaf[slot as usize].is_some());
    let heights = live.flat_map(|slot| patches.vertices_of(slot).iter().map(|v| v.height_m * sign));
    heights.fold(0.0, f32::max)
}

/// A needle or pit of 1 km over 6 m to each side.
fn needle(height_m: f64) -> Relief {
    Relief::Needle { at: spot(), half: 1024.0, height_m }
}

#[test]
fn case_25_a_needle_appears_where_its_bound_says_and_is_never_missed() {
    let body = sphere(RADIUS_M);
    let tolerance_px = 20.0;
    for height_m in [1e3, -1e3] {
        let mut settings = bare(body, 4, 100_000);
        settings.lod.tolerance.0 = tolerance_px;
        let mut world = World::synthetic(&settings, needle(height_m));
        let camera = Camera::new(&towards(&world, 3e4), &body);
        // The needle is in the middle of the picture; its region may reach the corner.
        let far_m = 1e3 * camera.pixels_per_radian / tolerance_px;
        let corner = 1.05 * camera.corner_factor;
        for (share, shows) in [(1.5 * corner, false), (corner, false), (0.95, true), (0.24, true)] {
            world.settled(&[towards(&world, far_m * share)]);
            let drawn_m = peak_m(&world, if height_m > 0.0 { 1.0 } else { -1.0 });
            let expected = if shows { drawn_m == 1e3 } else { drawn_m == 0.0 };
            assert!(expected, "{drawn_m} m drawn of {height_m} at {share} of {far_m} m");
            let bound_px = world.output.counts.error_px_bound;
            assert!(bound_px <= tolerance_px, "{bound_px}");
            let gauge = Gauge::of(&world);
            let camera = world.output.views[0].camera;
            let normal = normal_of(spot());
            let drawn = normal * gauge.radius_m(normal);
            let px = apart_px(&camera, world.surface(normal), drawn).expect("it is in the picture");
            assert!(px <= bound_px && (px < 1e-6 || !shows), "{px} of {bound_px} px");
        }
    }
}

/// A cliff has no foot of its own in the mesh, so its triangles become slivers as the cells do not
/// become narrower than the last level; how many is the business of the measured T1.
#[test]
fn case_26_a_cliff_is_refined_to_the_last_level_and_its_error_is_told() {
    let body = sphere(RADIUS_M);
    let relief = Relief::Cliff { east_of: f64::from(spot().x) + 0.5, height_m: 300.0 };
    let mut settings = bare(body, 4, 60_000);
    settings.lod.level_max = 24;
    let mut world = World::synthetic(&settings, relief);
    world.settled(&[towards(&world, 8e3)]);
    let horizon = Horizon::new(&body, relief.range_m());
    let sight = Sight::new(&world.output.views[0].camera, horizon);
    let lod = world.terrain.lod();
    let diamonds = &lod.mesh.diamonds;
    let crossed = diamonds.ids().filter(|&id| {
        let xs = diamonds.shape(id).corners().map(|c| f64::from(c.x) - f64::from(spot().x));
        !diamonds[id].is_split() && xs.iter().any(|x| *x > 0.5) && xs.iter().any(|x| *x < 0.5)
    });
    let seen = crossed.filter(|&id| sight.sees(&lod.cover.region[id]));
    let errors: Vec<(u8, f64)> =
        seen.map(|id| (diamonds[id].level(), lod.cover.region[id].error_m)).collect();
    assert!(errors.len() > 20, "{}", errors.len());
    assert!(errors.iter().all(|&(_, error_m)| error_m >= 300.0), "{errors:?}");
    assert!(errors.iter().any(|&(level, _)| level == 24));
    let bound_px = world.output.counts.error_px_bound;
    assert!(bound_px > settings.lod.tolerance.0, "{bound_px}");
    drop(lod);
    let (gauge, camera) = (Gauge::of(&world), world.output.views[0].camera);
    let mut worst_px = 0.0_f64;
    for seed in 0..2000_u64 {
        let aside = (unit(seed) - 0.5) * 4e5;
        let along = (unit(!seed) - 0.5) * 4e6;
        let place = spot().as_dvec3() + DVec3::new(aside, along, -aside - along);
        let normal = place.normalize();
        let truth = world.surface(normal);
        let px = apart_px(&camera, truth, normal * gauge.radius_m(normal)).unwrap_or(0.0);
        assert!(px <= bound_px, "{px} of {bound_px} px");
        worst_px = worst_px.max(px);
    }
    assert!(worst_px > settings.lod.tolerance.0, "the cliff itself was measured: {worst_px}");
}

#[test]
fn case_27_white_noise_is_beyond_any_budget_and_the_reached_bound_is_told() {
    let body = sphere(RADIUS_M);
    let settings = bare(body, 4, 30_000);
    let mut world = World::synthetic(&settings, Relief::Noise { most_m: 500.0 });
    world.settled(&[view(&body, Geodetic::from_degrees(20.0, 30.0, 3e4), 30.0, -30.0)]);
    let counts = world.output.counts;
    assert!(counts.triangles > 29_000, "{counts:?}");
    let bound_px = counts.error_px_bound;
    assert!(bound_px > settings.lod.tolerance.0 * 2.0, "{bound_px}");
    let (gauge, camera) = (Gauge::of(&world), world.output.views[0].camera);
    let mut worst_px = 0.0_f64;
    for seed in 0..20_000_u64 {
        let axis = |salt: u64| unit(seed << 8 | salt) * 0.4 - 0.2;
        let ground = body.surface_from_normal(camera.normal).normalize();
        let normal = (ground + DVec3::new(axis(1), axis(2), axis(3))).normalize();
        let truth = world.surface(normal);
        let px = apart_px(&camera, truth, normal * gauge.radius_m(normal)).unwrap_or(0.0);
        assert!(px <= bound_px, "{px} of {bound_px} px");
        worst_px = worst_px.max(px);
    }
    println!("{worst_px} of {bound_px} px");
    assert!(worst_px > 0.1 * bound_px, "the bound is not far off: {worst_px} of {bound_px}");
}

/// How long denormals take is for benches: no time is measured in a test.
#[test]
fn case_29_denormal_heights_are_as_good_as_zero() {
    let body = sphere(RADIUS_M);
    let digest = |height_m: f64, scale: f64| {
        let body = if scale == 1.0 { body } else { sphere(scale) };
        let mut world = World::synthetic(&bare(body, 4, 60_000), Relief::Flat { height_m });
        let here = Geodetic::from_degrees(20.0, 30.0, 0.01 * body.a_m);
        world.settled(&[view(&body, here, 30.0, -20.0)])
    };
    let (zero, zero_on_a_ball) = (digest(0.0, 1.0), digest(0.0, 2.0));
    for height_m in [1e-310, -1e-310, 1e-40, -1e-40, f64::from(f32::from_bits(1)), 5e-324] {
        let (found, on_a_ball) = (digest(height_m, 1.0), digest(height_m, 2.0));
        assert_eq!((found.mesh, found.vertices), (zero.mesh, zero.vertices), "{height_m:e}");
        assert_eq!(
            (on_a_ball.mesh, on_a_ball.vertices),
            (zero_on_a_ball.mesh, zero_on_a_ball.vertices)
        );
    }
}
