//! Cases 19, 20, 37 and 38: bodies of 1 m to 1e12 m, flat ones, egg-shaped ones, two at once.
//!
//! In:    synthetic ground on ellipsoids of every size and shape.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: relief as high as the body (`heights`).

use crate::gauge::lost_px;
use crate::rig::view;
use crate::synthetic::Relief;
use crate::world::{EARTH, World, bare, sphere, unit};
use glam::DVec3;
use overfly_core::camera::View;
use overfly_core::datasource::generate::Generator;
use overfly_core::frame::Terrain;
use overfly_core::geodesy::{Ecef, Ellipsoid, Geodetic};
use overfly_core::lattice::{RADIUS, fold, normal_of};
use overfly_core::settings::SceneSettings;

/// A picture of full size over a sphere, `height` radii up, with a near plane to match.
fn looking(body: &Ellipsoid, height: f64) -> View {
    let here = Geodetic::from_degrees(20.0, 30.0, height * body.a_m);
    // From high up the body is below.
    let view = view(body, here, 30.0, if height < 0.5 { -30.0 } else { -85.0 });
    View { size_px: [1920, 1080], near_m: 1e-6 * body.a_m, ..view }
}

/// A relief of a tenth of the radius; the same on every body but for its size.
fn tenth(body: &Ellipsoid) -> Relief {
    Relief::Tilt { mean_m: 0.0, swing_m: body.a_m / 16.0 }
}

fn settings_of(body: Ellipsoid) -> SceneSettings {
    let mut settings = bare(body, 4, 60_000);
    settings.depth.splits_m.clear();
    settings
}

/// Powers of two scale every number of a frame exactly: any length that is not a body's own, such
/// as an epsilon in metres, would show.
#[test]
fn case_19_bodies_of_1_m_and_1e9_m_have_the_same_mesh_to_the_last_triangle() {
    for (height, tolerance_px) in [(0.5, 4.0), (0.1, 0.5), (1e-3, 2.0)] {
        let meshes = [0, 10, 20, 30, 39].map(|power| {
            let body = sphere((1_u64 << power) as f64);
            let mut settings = settings_of(body);
            settings.lod.tolerance.0 = tolerance_px;
            let mut world = World::synthetic(&settings, tenth(&body));
            let digest = world.settled(&[looking(&body, height)]);
            assert!(world.output.counts.leaves > 100, "{:?}", world.output.counts);
            (digest.mesh, world.output.counts.error_px_bound.to_bits())
        });
        assert!(meshes.iter().all(|mesh| *mesh == meshes[0]), "{height} radii up: {meshes:x?}");
    }
}

#[test]
fn case_19_vertices_are_where_they_belong_on_bodies_of_1_m_and_1e9_m() {
    for radius_m in [1.0, 1e3, 1e9] {
        let body = sphere(radius_m);
        let mut world = World::synthetic(&settings_of(body), tenth(&body));
        for above in [1e-2, 0.3, 10.0] {
            let here = world.eye_above(20.0, 30.0, above * radius_m);
            world.settled(&[looking(&body, here.height_m / radius_m)]);
            let ([pair_px, eye_px], seen) = lost_px(&world);
            println!("{radius_m:e} m, {above} radii up: {pair_px:.2e}, {eye_px:.2e} px of {seen}");
            assert!(seen > 100 && pair_px < 3.1e-4 && eye_px < 3.1e-4, "{pair_px} {eye_px}");
        }
    }
}

/// A step of f64 is 1.2e-4 m there and one of two-float pairs 3.6e-3 m, and there is no exact path
/// from lattice differences. The lattice ends at cells of some kilometres, so that only an eye that
/// stands at a vertex sees it: from 2e3 m up all is as on the Earth, the rounding of the places in
/// f64 included; a vertex 1 m before the eye is 0.7 px off as a pair, and 0.3 px in f64, which
/// subtracts the same pairs.
#[test]
fn case_20_on_a_body_of_1e12_m_only_vertices_at_the_eye_itself_are_off() {
    let body = sphere(1e12);
    let mut settings = settings_of(body);
    settings.lod.level_max = 52;
    let mut world = World::synthetic(&settings, Relief::Noise { most_m: 1e3 });
    // Half a step of f64 in each axis.
    let own_m = 0.5 * 1.73 * 1.23e-4;
    for height_m in [2e3, 1e5, 1e7, 1e12] {
        let mut near = looking(&body, height_m / body.a_m);
        near.near_m = 0.1;
        world.settled(&[near]);
        let ([pair_px, eye_px], seen) = lost_px(&world);
        let own_px = own_m * world.output.views[0].camera.pixels_per_radian / (height_m - 1e3);
        println!("{height_m:e} m up: {pair_px:.2e}, {eye_px:.2e} px of {seen}, own {own_px:.1e}");
        assert!(seen > 100 && pair_px + own_px < 3.1e-4 && eye_px + own_px < 3.1e-4);
    }
    let vertex = fold(0, (RADIUS / 3) & !0xFFFF, (RADIUS / 3) & !0xFFFF);
    let mut here = body.geodetic_from_ecef(Ecef(world.surface(normal_of(vertex))));
    here.height_m += 1.0;
    world.settled(&[View { near_m: 0.1, size_px: [1920, 1080], ..view(&body, here, 30.0, -89.0) }]);
    let ([pair_px, eye_px], seen) = lost_px(&world);
    println!("1 m off a vertex: {pair_px:.2e}, {eye_px:.2e} px of {seen}");
    assert!(seen > 0 && pair_px > 0.01, "else pairs would be good enough here: {pair_px}");
    assert!(pair_px < 2.0 && eye_px < 0.6, "{pair_px} {eye_px}");
}

/// What is refused, in words.
fn refused(body: Ellipsoid) -> String {
    let settings = bare(body, 4, 30_000);
    let generator = Generator::new(&settings);
    match Terrain::checked(&settings, &generator) {
        Ok(_) => panic!("{body:?} was taken"),
        Err(fault) => fault.to_string(),
    }
}

#[test]
fn case_19_radii_that_no_body_has_are_refused() {
    for radius_m in [0.0, -1.0, 0.5, 1e13, f64::NAN, f64::INFINITY] {
        let expected = format!("body.a_m is {radius_m:?}, allowed is 1.0 to 1000000000000.0");
        assert_eq!(refused(sphere(radius_m)), expected);
    }
}

/// Each planet is a terrain of its own with axes of its own, and shares nothing with the other:
/// what a host draws first follows from the distances, which both give.
#[test]
fn case_37_two_planets_with_the_camera_inside_both_know_nothing_of_each_other() {
    let bodies = [EARTH, Ellipsoid { a_m: 5e6, f: 0.1 }];
    let inside = |i: usize| {
        let mut view = view(&bodies[i], Geodetic::from_degrees(10.0, 20.0, -1e6), 30.0, -10.0);
        // The other centre lies 3e6 m along x.
        view.eye = Ecef(DVec3::new(2e6 - 3e6 * i as f64, 1e5, 2e5));
        view
    };
    let world =
        |i: usize| World::synthetic(&bare(bodies[i], 4, 30_000), Relief::Noise { most_m: 3e3 });
    let alone = [0, 1].map(|i| world(i).settled(&[inside(i)]));
    let mut both = [world(0), world(1)];
    for _ in 0..400 {
        both.iter_mut().enumerate().for_each(|(i, world)| world.frame(&[inside(i)]));
    }
    let together = [0, 1].map(|i| both[i].settled(&[inside(i)]));
    assert_eq!(alone, together);
    assert_ne!(alone[0].mesh, alone[1].mesh);
    let cameras = [0, 1].map(|i| both[i].output.views[0].camera);
    assert!(cameras.iter().all(|camera| camera.height_m < 0.0), "inside both");
    assert_eq!(cameras[0].forward.length(), cameras[1].forward.length());
}

/// The worst way from a point to its geodetic place and back, in shares of the greatest radius.
fn round_trip(body: &Ellipsoid) -> f64 {
    let size_m = body.a_m.max(body.b_m());
    let points = (0..4000_u64).map(|i| {
        let axis = |salt: u64| unit(i << 8 | salt) * 2.0 - 1.0;
        let scale = DVec3::new(body.a_m, body.a_m, body.b_m());
        DVec3::new(axis(1), axis(2), axis(3)).normalize() * scale * (0.9 + unit(i ^ 7 << 40))
    });
    let back = |point: DVec3| body.ecef_from_geodetic(body.geodetic_from_ecef(Ecef(point))).0;
    points.map(|point| (back(point) - point).length() / size_m).fold(0.0, f64::max)
}

/// Karney did not analyse his inverse above e = 0.707, f = 0.29; what it gives there was measured.
#[test]
fn case_38_flat_and_long_bodies_keep_their_digits_and_stay_whole() {
    for (f, most) in [
        (0.0, 1e-15),
        (1.0 / 298.257, 2e-15),
        (0.3, 2e-15),
        (0.5, 4e-15),
        (0.9, 1e-13),
        (0.99, 1e-11),
        (-0.5, 2e-15),
        (-1.0, 4e-15),
    ] {
        let body = Ellipsoid { a_m: 1e6, f };
        let worst = round_trip(&body);
        println!("f = {f}: {worst:.1e} of its size there and back");
        assert!(worst < most, "f = {f}: {worst}");
        let mut world = World::synthetic(&bare(body, 4, 30_000), Relief::Noise { most_m: 10.0 });
        for (lat, height_m) in [(0.0, 1e3), (89.9, 1e3), (40.0, 1e5), (40.0, 1e8)] {
            let here = Geodetic::from_degrees(lat, 30.0, height_m);
            world.settled(&[view(&body, here, 30.0, -30.0)]);
        }
    }
    for f in [1.0, 0.995, 2.0, -1.5, f64::NAN, f64::NEG_INFINITY] {
        let expected = format!("body.f is {f:?}, allowed is -1.0 to 0.99");
        assert_eq!(refused(Ellipsoid { a_m: 1e6, f }), expected);
    }
}
