//! Cases 1 to 9: poles, edges, the axis, the centre, underground, very near and very far.
//!
//! In:    poses over the Earth and over spheres.
//! Out:   passes or fails.
//! Keeps: nothing.
//! Not here: motion between poses (`motion`), lenses (`numbers`).

use crate::gauge::{Gauge, levels, lost_px, worse_by};
use crate::rig::{scene, view};
use crate::synthetic::Relief;
use crate::world::{EARTH, World, bare, down_on, sphere, unit};
use glam::{DVec3, IVec3};
use overfly_core::camera::{Camera, View};
use overfly_core::geodesy::{Ecef, Ellipsoid, Geodetic};
use overfly_core::ground::{Ground, Query, Region};
use overfly_core::lattice::{RADIUS, fold, key_of};
use overfly_core::lod::audit;

fn at(lat_deg: f64, lon_deg: f64, height_m: f64) -> Geodetic {
    Geodetic::from_degrees(lat_deg, lon_deg, height_m)
}

/// The octahedron's vertices: poles, and four on the equator.
const VERTICES: [(f64, f64); 6] =
    [(90.0, 0.0), (-90.0, 0.0), (0.0, 0.0), (0.0, 90.0), (0.0, 180.0), (0.0, -90.0)];

#[test]
fn case_01_poles_and_octahedron_vertices_are_like_anywhere_else() {
    for (lat, lon) in VERTICES {
        let digests = [0, 1].map(|_| {
            let mut world = World::procedural(&scene(4, 30_000));
            let here = world.eye_above(lat, lon, 900.0);
            world.settled(&[view(&EARTH, here, 30.0, -40.0)])
        });
        assert_eq!(digests[0], digests[1], "{lat} {lon}");
    }
}

/// Leaf triangles around a lattice point.
fn valence(world: &World, point: IVec3) -> usize {
    let (lod, patches) = (world.terrain.lod(), world.terrain.patches());
    let all = audit::triangles(&lod.mesh.diamonds, &lod.cover, &patches);
    all.iter().filter(|triangle| triangle.contains(&point)).count()
}

/// Errors over a smooth sphere from 100 km, ahead and down.
fn errors_over(lat_deg: f64, lon_deg: f64) -> (Vec<f64>, World) {
    let body = sphere(6.4e6);
    let mut settings = bare(body, 4, 60_000);
    settings.lod.tolerance.0 = 0.5;
    let mut world = World::synthetic(&settings, Relief::Flat { height_m: 0.0 });
    world.settled(&[view(&body, at(lat_deg, lon_deg, 1e5), 20.0, -45.0)]);
    (Gauge::of(&world).errors_px(&world, 0.0, 70), world)
}

/// The octahedron's cells are not all of one shape, and leaves halve in area from level to level: so
/// errors are not spread alike, not even at places amid the faces. What holds: the vertices of a kind
/// are alike, none is worse than controls amid the faces by more than one of these is worse than the
/// others, and all keep the bound; what is certain of the frame is little more than it shows.
#[test]
fn case_01_errors_at_the_vertices_are_spread_alike_and_no_worse_than_amid_the_faces() {
    let controls = [(35.26, 45.0), (35.26, 135.0), (20.0, 20.0), (-35.26, -45.0), (55.0, 60.0)];
    let controls = controls.map(|(lat, lon)| errors_over(lat, lon).0);
    let sorted = |mut errors_px: Vec<f64>| {
        errors_px.sort_by(f64::total_cmp);
        errors_px
    };
    let amid = sorted(controls.concat());
    let spread = (0..controls.len()).map(|one| {
        let others = controls.iter().enumerate().filter(|&(at, _)| at != one);
        let others = others.flat_map(|(_, errors_px)| errors_px.iter().copied());
        worse_by(&controls[one], &sorted(others.collect()))
    });
    let spread = spread.fold(0.0, f64::max);
    assert!(spread < 0.2, "places amid the faces differ by {spread}");
    let mut kinds: [Vec<Vec<f64>>; 2] = [Vec::new(), Vec::new()];
    for (lat, lon) in VERTICES {
        let (errors_px, world) = errors_over(lat, lon);
        assert!(errors_px.len() > 4000, "the picture is full of ground");
        let bound_px = world.output.counts.error_px_bound;
        let most_px = errors_px[errors_px.len() - 1];
        let worse = worse_by(&errors_px, &amid);
        println!("{lat} {lon}: worse by {worse:.3}, {most_px:.3} of {bound_px:.3} px");
        assert!(worse < spread, "{lat} {lon}: worse than amid a face by {worse}");
        let certain_px = world.terrain.bound_px(&world.output);
        println!("certain {certain_px:.3} px");
        assert!(certain_px <= bound_px && most_px <= certain_px, "{certain_px} of {bound_px}");
        assert!(most_px > 0.6 * certain_px, "{most_px} of {certain_px}");
        let point = (normal_at(lat, lon) * f64::from(RADIUS)).round().as_ivec3();
        let around = valence(&world, point);
        assert!(around == 4 || around == 8, "{around} triangles around {point}");
        let kind = &mut kinds[usize::from(lat == 0.0)];
        let alike =
            |one: &Vec<f64>| worse_by(one, &errors_px).max(worse_by(&errors_px, one)) < 0.05;
        assert!(kind.iter().all(alike), "{lat} {lon} is unlike others of its kind");
        kind.push(errors_px);
    }
}

fn normal_at(lat_deg: f64, lon_deg: f64) -> DVec3 {
    at(lat_deg, lon_deg, 0.0).normal()
}

#[test]
fn case_02_edges_have_the_same_keys_from_both_faces_and_the_antimeridian_is_no_place() {
    for along in (0..=RADIUS).step_by(1 << 25) {
        for (a, b) in [(0, 3), (1, 2)] {
            assert_eq!(key_of(fold(a, along, 0)), key_of(fold(b, along, 0)));
            assert_eq!(key_of(fold(a, RADIUS, along)), key_of(fold(b, RADIUS, along)));
        }
    }
    let flown = |lons: [f64; 2]| {
        let mut settings = scene(4, 1_000_000);
        settings.lod.tolerance.0 = 12.0;
        let mut world = World::procedural(&settings);
        // The second frame crosses the equator and the antimeridian at once.
        world.settled(&[view(&EARTH, at(0.001, lons[0], 5e3), 40.0, -30.0)]);
        world.frame(&[view(&EARTH, at(-0.001, lons[1], 5e3), 40.0, -30.0)]);
        world.check();
        world.settled(&[view(&EARTH, at(-0.001, lons[1], 5e3), 40.0, -30.0)])
    };
    let (east, west) = (flown([179.999, -179.999]), flown([179.999, 180.001]));
    assert_eq!(
        (east.mesh, east.vertices),
        (west.mesh, west.vertices),
        "longitudes jump, ground not"
    );
    let cold = flown([-179.999, -179.999]);
    assert_eq!(
        (east.mesh, east.vertices),
        (cold.mesh, cold.vertices),
        "and nothing is left behind"
    );
}

#[test]
fn case_03_on_the_axis_longitude_is_0_and_the_basis_is_fixed() {
    for body in [EARTH, sphere(1e6), Ellipsoid { a_m: 1e6, f: -0.2 }] {
        for north in [1.0, -1.0] {
            let eye = Ecef(DVec3::new(0.0, 0.0, north * (body.b_m() + 50.0)));
            let there = body.geodetic_from_ecef(eye);
            assert_eq!(there.lon_rad.to_bits(), 0);
            assert!((there.height_m - 50.0).abs() < 8e-9, "{there:?}");
            assert!((there.normal() - DVec3::Z * north).length() < 1e-15);
            let enu = there.enu_axes();
            assert_eq!(enu.x_axis, DVec3::Y, "east is +y, as the longitude says");
            assert!((enu.y_axis + DVec3::X * north).length() < 1e-15);
        }
    }
    let mut world = World::procedural(&scene(4, 30_000));
    let mut down = down_on(&EARTH, at(90.0, 0.0, 4e3));
    down.eye = Ecef(DVec3::new(0.0, 0.0, EARTH.b_m() + 4e3));
    let digest = world.settled(&[down]);
    down.eye = Ecef(DVec3::new(-0.0, -0.0, EARTH.b_m() + 4e3));
    assert_eq!(world.settled(&[down]), digest, "there is one axis");
}

/// No flag is set: an eye at the centre is like one at any other place, and its normal is north.
#[test]
fn case_04_at_the_centre_north_is_up_and_nothing_is_nan() {
    for body in [EARTH, sphere(6.4e6)] {
        let there = body.geodetic_from_ecef(Ecef(DVec3::ZERO));
        assert!((there.lat_rad - core::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert!((there.height_m + body.b_m()).abs() < 1e-6, "{there:?}");
        let mut settings = scene(4, 30_000);
        settings.body = body;
        let digests = [0, 1].map(|_| {
            let mut world = World::procedural(&settings);
            let mut centre = view(&body, at(0.0, 0.0, 0.0), 0.0, 0.0);
            centre.eye = Ecef(DVec3::ZERO);
            let digest = world.settled(&[centre]);
            assert!((world.output.views[0].camera.normal - DVec3::Z).length() < 1e-15);
            digest
        });
        assert_eq!(digests[0], digests[1]);
    }
}

#[test]
fn case_05_underground_the_budget_is_kept_and_heights_above_terrain_are_negative_and_right() {
    let mut settings = scene(4, 30_000);
    settings.sea = false;
    let mut world = World::procedural(&settings);
    let here = world.eye_above_land(-1.0);
    world.settled(&[view(&EARTH, here, 30.0, -10.0)]);
    assert_eq!(world.output.views[0].camera.near_m, 0.1);
    assert!(world.output.counts.drawn > 100, "back faces are drawn: {:?}", world.output.counts);
    let half = Geodetic { height_m: -EARTH.a_m / 2.0, ..here };
    world.settled(&[view(&EARTH, half, 30.0, -10.0)]);

    let mut ground = Ground::new(EARTH, false);
    let region = Region { centre: here, radius_m: 30.0 };
    for key in ground.pages_of(region, 50, 10_000).unwrap() {
        ground.insert(world.page(key));
    }
    let contact = ground.agl(EARTH.ecef_from_geodetic(here), Query::Exact(50)).ok().unwrap();
    let (agl_m, bound_m) = (contact.agl_m, contact.ground.bound_m);
    let off_m = (agl_m + 1.0).abs();
    assert!(off_m <= bound_m && off_m < 0.05, "{agl_m} m, known to {bound_m} m");
}

/// A picture of full size, as the expected figures are for.
fn full_size(body: &Ellipsoid, at: Geodetic, pitch_deg: f64) -> View {
    View { size_px: [1920, 1080], ..view(body, at, 30.0, pitch_deg) }
}

#[test]
fn case_06_at_1_m_vertices_are_where_they_belong_to_a_few_ten_thousandths_of_a_pixel() {
    let mut world = World::procedural(&scene(4, 100_000));
    let here = world.eye_above_land(1.0);
    world.settled(&[full_size(&EARTH, here, -20.0)]);
    let ([pair_px, eye_px], seen) = lost_px(&world);
    let [_, deepest] = levels(&world);
    println!("{pair_px:.2e} and {eye_px:.2e} px of {seen} vertices, level {deepest}");
    assert!(seen > 10_000 && pair_px < 2.5e-4 && eye_px < 2.5e-4);
    // A cell of depth L of the octahedron has lattice level 2 L.
    assert!(deepest + 4 >= 48, "{deepest}");
    // D32F, reversed, near 0.1 m: a step of depth at 1 m.
    let at_m = |depth: f32| 0.1 / f64::from(depth);
    let step_m = at_m(0.1) - at_m(0.1_f32.next_up());
    assert!(step_m > 7e-8 && step_m < 7.6e-8, "{step_m}");
}

/// What lies nearer than `near_m` is not drawn, so ground right below the eye shows a hole, with
/// the far side of the body's surface behind it: documented with `View::near_m`.
#[test]
fn case_07_at_1_cm_the_near_plane_cuts_the_ground_and_nothing_else_happens() {
    let mut world = World::procedural(&scene(4, 60_000));
    let here = world.eye_above_land(0.01);
    let digest = world.settled(&[full_size(&EARTH, here, -30.0)]);
    let draws = &world.output.views[0];
    assert_eq!((draws.ranges[0].near_m, draws.camera.near_m), (0.1, 0.1));
    let ground_m = draws.camera.height_m - world.height_m(here.normal());
    assert!((ground_m - 0.01).abs() < 1e-6 && ground_m < draws.camera.near_m);
    assert_eq!(world.settled(&[full_size(&EARTH, here, -30.0)]), digest);
}

/// Seen from 1e9 m the Earth is 12 px wide, so it is refined; from 1 AU it is a root mesh.
#[test]
fn case_08_far_away_a_few_triangles_are_enough() {
    let body = sphere(6.4e6);
    for (height_m, leaves_most) in [(1e9, 4000), (1.496e11, 8)] {
        let mut settings = bare(body, 4, 60_000);
        settings.lod.tolerance.0 = 0.25;
        let mut world = World::synthetic(&settings, Relief::Flat { height_m: 0.0 });
        let looking = full_size(&body, at(20.0, 30.0, height_m), -90.0);
        world.settled(&[View {
            orientation: down_on(&body, at(20.0, 30.0, 1.0)).orientation,
            ..looking
        }]);
        let leaves = world.output.counts.leaves;
        let ([pair_px, eye_px], seen) = lost_px(&world);
        println!("{height_m:e}: {leaves} leaves, {pair_px:.2e} and {eye_px:.2e} px of {seen}");
        assert!((8..=leaves_most).contains(&leaves), "{leaves} leaves at {height_m} m");
        assert!(seen > 10 && pair_px < 2.7e-4 && eye_px < 2.7e-4);
        let gauge = Gauge::of(&world);
        let camera = &world.output.views[0].camera;
        let most_px = (0..4000).map(|i| radial_px(&world, &gauge, camera, i)).fold(0.0, f64::max);
        println!("    {most_px} px");
        assert!(most_px < world.output.counts.error_px_bound);
        let depth = camera.near_m / height_m;
        assert!(depth > f64::from(f32::MIN_POSITIVE), "depth stays a number: {depth}");
    }
}

/// Radial error at a random place that faces the eye.
fn radial_px(world: &World, gauge: &Gauge, camera: &Camera, seed: u64) -> f64 {
    let axis = |salt: u64| unit(seed ^ salt << 32) * 2.0 - 1.0;
    let normal = DVec3::new(axis(1), axis(2), axis(3)).normalize();
    let away = world.surface(normal) - camera.eye.0;
    if away.dot(normal) > 0.0 {
        return 0.0;
    }
    let error_m = (gauge.radius_m(normal) - world.surface(normal).length()).abs();
    let across = normal.cross(camera.forward).length();
    error_m * across * camera.pixels_per_radian / camera.forward.dot(away)
}

#[test]
fn case_09_beyond_where_digits_end_the_body_is_a_point() {
    for height_m in [1e18, 1e23, 1e30 / 2.0] {
        let mut settings = scene(4, 30_000);
        settings.body = EARTH;
        let mut world = World::procedural(&settings);
        let mut far = full_size(&EARTH, at(20.0, 30.0, 1.0), -90.0);
        far.eye = Ecef(normal_at(20.0, 30.0) * height_m);
        world.settled(&[far]);
        assert_eq!((world.output.counts.leaves, world.output.counts.splits), (8, 0));
        let camera = &world.output.views[0].camera;
        assert!((camera.height_m / height_m - 1.0).abs() < 1e-9, "{}", camera.height_m);
        assert!((camera.normal - normal_at(20.0, 30.0)).length() < 1e-9, "{height_m}");
    }
}
